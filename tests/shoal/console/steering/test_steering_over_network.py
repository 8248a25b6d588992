"""Steering from `shoal console` over zenoh and UDP, and a vehicle that stands still meanwhile."""

import os
import signal

import pytest

from tests.outside import until
from tests.repeats import repeat
from tests.shoal.console.operator_page import OperatorPage, frame_of, operator_page
from tests.shoal.console.steering.steering_pilot import steering_pilot
from tests.shoal.network.running import running

NAME = "otter"
pytestmark = pytest.mark.heavy


def plan(page: OperatorPage) -> dict:
    return frame_of(page)["vehicles"].get(NAME, {}).get("plan", {})


@pytest.mark.parametrize("network", ["zenoh", repeat("udp")])
def test_a_boat_is_steered_and_one_that_stood_still_rests_afterward(network, tmp_path):
    real_time = ("--clock", "real")
    with running(tmp_path, *real_time, network=network, profile=NAME) as vehicle, operator_page() as page:
        page.log_in()
        until(lambda: plan(page).get("mode") == "service", 60.0, told=lambda: plan(page))
        with steering_pilot(page, NAME) as pilot:
            pilot.wait_until_steered()
            until(lambda: pilot.newest["axes"] == ["Heading", "Thrust"])
            pilot.hold(ahead=1.0)
            until(lambda: plan(page)["motors"] == "turning", told=lambda: pilot.news[-2:])
            os.kill(vehicle.popen.pid, signal.SIGSTOP)
            try:
                assert pilot.wait_for_end() in ("the vehicle has not answered for 3 s", "the vehicle is lost")
            finally:
                os.kill(vehicle.popen.pid, signal.SIGCONT)
        until(lambda: plan(page)["motors"] == "at rest" and plan(page)["mode"] == "service", told=lambda: plan(page))
        printed = vehicle.log.read_text()
        assert "local: steering begins" in printed
        with steering_pilot(page, NAME) as pilot:
            pilot.wait_until_steered()
            pilot.say(end=True)
            assert pilot.wait_for_end() == "the operator has ended it"
