"""A takeoff that climbs faster than the plan says: one command, time to slow down, then one report."""

import pytest

from mavlink.autopilot.climb_speed import PERSISTENCE, SETTLING, ClimbSpeed
from mavlink.autopilot.vehicle_modes import ARDUPILOT, PX4, steered_vehicle

STEP = 0.1  # s
COPTER = steered_vehicle(ARDUPILOT, 2)


def climbed(climb, vehicle=COPTER, seconds=10.0):
    """The times of commands and of reports; `climb` is the speed (m/s) at a time, and the plan says 1 m/s."""
    reports, commands = [], []
    judge = ClimbSpeed(lambda text: reports.append((now, text)))
    for tick in range(round(seconds / STEP)):
        now = STEP * tick
        if judge.correction(vehicle, 1.0, climb(now), now):
            commands.append(now)
    return commands, reports


def test_an_autopilot_has_time_to_slow_down_after_the_command():
    commands, reports = climbed(lambda t: 2.5 if t < PERSISTENCE + SETTLING - 0.5 else 1.0)
    assert commands == [pytest.approx(PERSISTENCE, abs=STEP)]
    assert reports == []


def test_a_climb_that_stays_too_fast_is_reported_once():
    commands, reports = climbed(lambda t: 2.5)
    ((time, text),) = reports
    assert time - commands[0] == pytest.approx(SETTLING, abs=1.5 * STEP)
    assert text == "it climbs at 2.5 m/s, not the plan's 1 m/s"
    assert climbed(lambda t: 2.5, steered_vehicle(PX4, 2))[0] == [], "PX4 has no command for it"


def test_a_moment_of_a_faster_climb_does_not_count():
    assert climbed(lambda t: 2.5 if t % 1.0 < 0.5 else 1.0) == ([], [])
