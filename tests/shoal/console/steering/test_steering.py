"""Steering from the page of a shipped boat: the dead-man switch, silence, old commands, the lease, other plans."""

import json

import pytest

from shoal.console import Role, Users
from tests.outside import until
from tests.shoal.console.operator_page import OperatorPage, frame_of, vehicle_page
from tests.shoal.console.steering.steering_pilot import steering_pilot

NAME = "otter"
PASSWORD = "correct horse"
PLAN = 'plan: "east"\nmaneuvers:\n- goto: {lat: 41.1850°, lon: -8.7000°, depth: 0, speed: 1.0 m/s}\n'

pytestmark = pytest.mark.heavy


@pytest.fixture(scope="module")
def page(tmp_path_factory):
    folder = tmp_path_factory.mktemp("access")
    for name, role in (("anna", Role.OPERATE), ("wanda", Role.WATCH)):
        Users(folder).add(name, role, PASSWORD)
    words = ("--set", f"Transports.Console:Access Folder={folder}")
    with vehicle_page(tmp_path_factory.mktemp("vehicle"), *words, profile=NAME) as found:
        found.log_in()
        until(lambda: state(found, "plan").get("mode") == "service", 40.0)
        yield found


def state(page: OperatorPage, section: str) -> dict:
    return frame_of(page)["vehicles"].get(NAME, {}).get(section, {})


def entries(page: OperatorPage) -> list[str]:
    return [entry[4] for entry in frame_of(page)["log"] if "steering" in entry[4]]


def rests(page: OperatorPage) -> bool:
    return state(page, "plan")["motors"] == "at rest"


def refusal(page: OperatorPage) -> str:
    with steering_pilot(page, NAME) as pilot:
        return pilot.wait_for_end()


def test_the_boat_follows_the_stick_while_it_is_held_and_rests_when_it_is_let_go(page):
    with steering_pilot(page, NAME) as pilot:
        pilot.wait_until_steered()
        until(lambda: pilot.newest["axes"] == ["Heading", "Thrust"])
        pilot.hold(ahead=1.0)
        until(lambda: state(page, "state")["speed"] > 0.8, told=lambda: pilot.news[-1])
        before = state(page, "state")["heading"]
        pilot.hold(ahead=1.0, turn=1.0)
        until(lambda: 20.0 < (state(page, "state")["heading"] - before) % 360.0 < 180.0)
        pilot.words = {"held": False, "ahead": 1.0}
        until(lambda: rests(page))
        assert pilot.newest["state"] == "steered"
        pilot.say(end=True)
        assert pilot.wait_for_end() == "the operator has ended it"
    until(lambda: state(page, "plan")["mode"] == "service")
    assert entries(page)[-2:] == ["local: steering begins", "local: steering ends: the operator has ended it"]


@pytest.mark.parametrize("way", ["frozen", "closed", "old"])
def test_a_page_that_freezes_or_goes_or_sends_what_is_old_stops_the_boat(page, way):
    with steering_pilot(page, NAME) as pilot:
        pilot.wait_until_steered()
        pilot.hold(ahead=0.5)
        until(lambda: state(page, "plan")["motors"] == "turning")
        if way == "frozen":
            pilot.frozen = True
            assert pilot.wait_for_end() == "its page has been silent for 3 s"
        elif way == "closed":
            pilot.close()
        else:
            pilot.answers_ticks = False  # as if all that it sends were delayed
            until(lambda: "too late" in pilot.newest["text"], told=lambda: pilot.newest)
        until(lambda: rests(page))
    until(lambda: state(page, "plan")["mode"] == "service")


def test_one_page_steers_and_only_who_may_operate_and_has_the_lease(page):
    anna, wanda = (page.another(user=name, password=PASSWORD) for name in ("anna", "wanda"))
    with steering_pilot(wanda, NAME) as pilot:
        assert pilot.wait_for_end() == "wanda may watch: this needs the role operate"
    page.lease(NAME, "take")
    until(lambda: refusal(anna) == "local commands this vehicle: take the lease first")  # the one before has ended
    with steering_pilot(page, NAME) as first:
        first.wait_until_steered()
        with steering_pilot(page, NAME) as second:
            assert second.wait_for_end() == "another page steers this vehicle"
        assert anna.lease(NAME, "take")["ok"]
        page.lease(NAME, "hand over")
        assert first.wait_for_end() == "anna commands this vehicle: take the lease first"
    with steering_pilot(page, NAME) as pilot:
        assert "anna commands" in pilot.wait_for_end()
    anna.lease(NAME, "hand over")
    with steering_pilot(page, "nobody") as pilot:
        assert pilot.wait_for_end() == "there is no such vehicle"
    assert json.loads(page.request("POST", "/api/order", {"vehicle": NAME, "order": "steer"})[1])["ok"] is False


def test_a_plan_that_starts_meanwhile_is_executed_and_ends_the_steering(page):
    assert page.order(NAME, "put", text=PLAN)["ok"]
    with steering_pilot(page, NAME) as pilot:
        pilot.wait_until_steered()
        pilot.hold(ahead=-1.0)
        assert page.order(NAME, "start", plan="east")["ok"]
        assert pilot.wait_for_end() == "the vehicle is not steered any more: it executes east"
    until(lambda: state(page, "plan")["name"] == "east")
    assert page.order(NAME, "stop")["ok"]


def test_an_abort_ends_the_steering(page):
    with steering_pilot(page, NAME) as pilot:
        pilot.wait_until_steered()
        pilot.hold(ahead=1.0)
        assert page.order(NAME, "abort")["ok"]
        assert "the vehicle is not steered any more: mode" in pilot.wait_for_end()
    until(lambda: state(page, "plan")["mode"] == "service")
