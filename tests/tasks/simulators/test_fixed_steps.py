"""The motion of simulated vehicles fits their times, also where the computer is late."""

import math
import time
from itertools import pairwise

import pytest

import imc
from runtime import Task, periodic
from runtime.kernel import ScaledClock, WallClock
from runtime.profile import load_profile
from runtime.vehicle import build
from tasks.simulators.fixed_steps import FixedSteps
from tests.outside import ALONE


class Late(Task):
    """Keeps the computer busy: an eighth of a second, three times a second."""

    @periodic(3.0)
    def dawdle(self) -> None:
        time.sleep(0.125)


def truth(name, clock, seconds, folder, *tasks):
    """The SimulatedState of a shipped vehicle on a clock."""
    profile = load_profile(name, overrides=[*ALONE, "Simulators.GPS:Activation Depth=1"])
    vehicle = build(profile, profile.parse_modes(["Simulation"]), clock=clock, log_root=folder).vehicle
    found = []
    vehicle.observe(imc.SimulatedState, found.append)
    for task in tasks:
        vehicle.add(task, task.__name__)
    vehicle.start()
    vehicle.run(seconds)
    vehicle.close()
    return found


def path_and_integral(states):
    """Path (m) through the water, and the speed integrated over the times."""
    path = math.fsum(math.dist((a.x, a.y, a.z), (b.x, b.y, b.z)) for a, b in pairwise(states))
    speeds = [math.hypot(s.u, s.v, s.w) for s in states]
    times = [s.timestamp for s in states]
    pairs = zip(pairwise(speeds), pairwise(times), strict=True)
    return path, math.fsum(0.5 * (u + v) * (b - a) for (u, v), (a, b) in pairs)


@pytest.mark.heavy
@pytest.mark.alone
@pytest.mark.parametrize("name", ["lauv-noptilus-1", "otter"])
def test_a_late_computer_costs_no_way_at_real_time(name, tmp_path):
    states = truth(name, WallClock(), 6.0, tmp_path, Late)
    assert len(states) < 550  # many ticks were merged
    path, integral = path_and_integral(states)
    assert path > 0.3
    assert path == pytest.approx(integral, rel=1e-3)


@pytest.mark.heavy
def test_a_scaled_clock_gives_way_and_no_tick_is_lost(tmp_path):
    states = truth("lauv-noptilus-1", ScaledClock(100_000.0), 60.0, tmp_path)
    assert {round(100.0 * (b.timestamp - a.timestamp)) for a, b in pairwise(states)} == {1}
    path, integral = path_and_integral(states)
    assert path > 50.0
    assert path == pytest.approx(integral, rel=1e-3)


def test_the_actuators_of_a_computer_that_stands_still_stop_and_its_steps_are_bounded():
    steps, done = FixedSteps(100.0, 2.0), []

    def step(seconds: float) -> None:
        done.append(seconds)

    assert steps.run(0, 1, step, lambda: done.append("released")) == ""
    assert steps.run(10_000_000_000, 999, step, lambda: done.append("released")) == ""
    assert done.index("released") == 201
    assert len(done) == 1001
    assert steps.time == 9.99
    done.clear()
    text = steps.run(110_000_000_000, 10_000, step, lambda: None)
    assert text == "the computer stood still for 100.0 s; the last 40.0 s of them are not simulated"
    assert len(done) == 6000
