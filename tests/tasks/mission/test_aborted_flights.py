"""Flights of the profile hexa-00 that an Abort ends, or that its autopilot does not begin or continue: the reason."""

import pytest
from aloft import CCU, HOVER, OWN, Flight

import imc
from tests.tasks.mission.test_multirotor_faults import brown_outs

pytestmark = pytest.mark.heavy

START = imc.PlanControl(op=imc.PlanControl.Op.START, plan_id="hover", arg=HOVER, dst=OWN, src=CCU)


def dips(*times):
    """Losses of power for 0.3 s, so many seconds after the start of the plan at 5 s."""
    return 5.0, brown_outs(0.3, *times, restarting=())


@pytest.mark.parametrize("times", [(0.5, 2.5), (0.2, 0.7), (1.5, 3.5)])
def test_a_plan_ends_at_once_with_the_reason_for_which_its_vehicle_lands(times, tmp_path):
    flight = Flight(tmp_path, dips(*times), seconds=30.0)
    assert "landing: the power fails again and again" in flight.log
    assert "entity errors: Autopilot; last Autopilot: landing: the power fails again and again" in flight.log
    assert flight.modes == ["GROUND", "GUIDED", "LAND", "GROUND"]


def test_a_plan_that_does_not_take_off_ends_at_once_with_the_reason(tmp_path):
    flight = Flight(tmp_path, dips(0.5, 2.5), (30.0, START), seconds=40.0)
    assert "entity errors: Autopilot; last Autopilot: does not take off: the power fails again and again" in flight.log
    assert flight.modes == ["GROUND", "GUIDED", "LAND", "GROUND"]


@pytest.mark.parametrize("at", [4.9, 5.0, 5.05])
def test_no_flight_begins_after_an_abort(at, tmp_path):
    """The first one comes just before the command of its plan is carried out."""
    flight = Flight(tmp_path, (at, imc.Abort(src=CCU, dst=OWN)), seconds=20.0)
    assert flight.modes == ["GROUND"]
    assert flight.op_modes[-1] == "SERVICE"
