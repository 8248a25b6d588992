"""Steering of an AUV and a multirotor from their own pages: each with the axes that it has."""

import pytest

from shoal.console.steering.remote_steering import StickPosition
from tests.outside import until
from tests.shoal.console.operator_page import OperatorPage, frame_of, vehicle_page
from tests.shoal.console.steering.steering_pilot import steering_pilot

AUV, MULTIROTOR = "lauv-noptilus-1", "hexa-00"
UP = 'plan: "up"\nspeed: 2 m/s\nmaneuvers:\n- takeoff: {lat: 41.185°, lon: -8.7062°, altitude: 12}\n'


def section(page: OperatorPage, vehicle: str, name: str) -> dict:
    return frame_of(page)["vehicles"].get(vehicle, {}).get(name, {})


@pytest.mark.parametrize(
    ("offer", "text"),
    [
        (("Heading", "Thrust"), "Heading=-64;Thrust=127"),
        (("Heading", "Thrust", "Pitch"), "Heading=-64;Thrust=127;Pitch=32"),
        (("Heading", "Thrust", "Pitch", "Roll"), "Heading=-64;Thrust=32;Pitch=-127;Roll=0"),
        (("Heading", "Lights"), "Heading=-64"),
        ((), ""),
    ],
)
def test_a_stick_moves_the_axes_that_a_vehicle_offers(offer, text):
    words = {"ahead": 3, "turn": -0.5, "up": 0.25, "side": float("nan")}
    assert StickPosition.parse(words).remote_actions(offer) == text


@pytest.mark.parametrize("value", [None, "1", True, [1], float("inf"), 10**400, {}])
def test_what_is_no_number_is_neutral(value):
    assert StickPosition.parse({"ahead": value}) == StickPosition()


@pytest.mark.heavy
def test_an_auv_is_steered_at_the_surface_and_down(tmp_path):
    with vehicle_page(tmp_path, profile=AUV) as page:
        page.log_in()
        until(lambda: section(page, AUV, "plan").get("mode") == "service", told=lambda: page.lines[-5:])
        with steering_pilot(page, AUV) as pilot:
            pilot.wait_until_steered()
            until(lambda: pilot.newest["axes"] == ["Heading", "Pitch", "Thrust"])
            pilot.hold(ahead=1.0)
            until(lambda: section(page, AUV, "state")["speed"] > 0.8)
            pilot.hold(ahead=1.0, up=-1.0)
            until(lambda: section(page, AUV, "state")["depth"] > 1.0)
            pilot.words = {"held": False}
            until(lambda: section(page, AUV, "plan")["motors"] == "at rest")
            assert pilot.newest["state"] == "steered"


@pytest.mark.heavy
def test_a_multirotor_is_steered_in_the_air_only(tmp_path):
    with vehicle_page(tmp_path, profile=MULTIROTOR) as page:
        page.log_in()
        until(lambda: section(page, MULTIROTOR, "plan").get("mode") == "service", told=lambda: page.lines[-5:])
        with steering_pilot(page, MULTIROTOR) as pilot:
            assert "the vehicle is on the ground, a Takeoff must come first" in pilot.wait_for_end()
        stored = page.order(MULTIROTOR, "put", text=UP)
        assert stored["ok"], stored
        assert page.order(MULTIROTOR, "start", plan="up")["ok"]
        until(lambda: section(page, MULTIROTOR, "state")["altitude"] > 10.0, told=lambda: page.lines[-5:])
        with steering_pilot(page, MULTIROTOR) as pilot:
            pilot.wait_until_steered()
            until(lambda: pilot.newest["axes"] == ["Heading", "Pitch", "Roll", "Thrust"])
            pilot.hold(ahead=1.0)
            until(lambda: section(page, MULTIROTOR, "state")["speed"] > 3.0)
            pilot.words = {"held": False}
            until(lambda: section(page, MULTIROTOR, "state")["speed"] < 1.0)
            height = section(page, MULTIROTOR, "state")["altitude"]
            pilot.hold(up=1.0)
            until(lambda: section(page, MULTIROTOR, "state")["altitude"] > height + 3.0)
