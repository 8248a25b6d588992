"""All simulators of the AUV together: rates, sensors compared with truth, runs continued from a snapshot."""

import math
from pathlib import Path

import numpy as np
import pytest

import imc
from runtime.kernel import VirtualClock
from runtime.profile import load_profile
from runtime.snapshot import load, restore, take_snapshot
from runtime.vehicle import Vehicle, build

PROFILE = """
[Require auv/basic.ini]
[Require auv/simulation.ini]
[General]
Vehicle = lauv-test
[Transports.Logging]
Enabled = Always
[Simulators.StreamVelocity]
Default Speed East = 0.2
[Simulators.Motor]
Command Timeout = 0
[Simulators.Servos]
Command Timeout = 0
[Plan.Autostart]
Enabled = Never
"""
LENGTH = 20.0
ABOUT_LOGS = imc.Announce | imc.EntityInfo | imc.LoggingControl
START = 1_767_225_600_000_000_000  # ns


def vehicle(folder: Path, start: int | None = None) -> Vehicle:
    path = folder.parent / "lauv-test.ini"
    path.write_text(PROFILE)
    profile = load_profile(path)
    clock = VirtualClock(profile.start_time_ns if start is None else start)
    return build(profile, {"Simulation"}, clock=clock, seed=1, log_root=folder).vehicle


def swim_to(made: Vehicle, begin: float, end: float) -> None:
    """Run from one time to another; on the way, half of the thrust, rudders to starboard, nose down."""
    for moment, fins in ((2.0, (-0.1, 0.05, 0.05, -0.1)), (8.0, (-0.05, 0.0, 0.0, -0.05))):
        if begin < moment <= end:
            _run_to(made, moment)
            made.daemon.publish(imc.SetThrusterActuation(value=0.5))
            for servo, value in enumerate(fins):
                made.daemon.publish(imc.SetServoPosition(id=servo, value=value))
    _run_to(made, end)


def _run_to(made: Vehicle, seconds: float) -> None:
    made.kernel.run(until=START + round(seconds * 1e9))


def messages(folder: Path) -> list[imc.Message]:
    (path,) = folder.glob("*/*/*")
    return list(imc.Log(path))


@pytest.fixture(scope="module")
def swim(tmp_path_factory) -> tuple[list[imc.Message], Vehicle]:
    folder = tmp_path_factory.mktemp("swim") / "log"
    made = vehicle(folder)
    made.start()
    swim_to(made, 0.0, LENGTH)
    made.close()
    return messages(folder), made


def of(found, kind, made=None, label=""):
    entity = made.entities.find(label).id if label else None
    return [m for m in found if isinstance(m, kind) and entity in (None, m.src_ent)]


def test_rates(swim):
    found, made = swim
    rates = {
        imc.SimulatedState: 100,
        imc.EulerAngles: 100,
        imc.AngularVelocity: 100,
        imc.Acceleration: 100,
        imc.Rpm: 20,
        imc.Depth: 10,
        imc.Distance: 10,
        imc.GroundVelocity: 5,
        imc.WaterVelocity: 5,
        imc.GpsFix: 1,
        imc.Temperature: 2,  # of the CTD and of the depth sensor
        imc.SoundSpeed: 1,
        imc.Voltage: 1,
        imc.Current: 1,
    }
    for kind, rate in rates.items():
        assert len(of(found, kind)) == pytest.approx(rate * LENGTH, abs=max(3, 0.02 * rate * LENGTH)), kind
    times = np.array([m.timestamp for m in of(found, imc.SimulatedState)])
    assert np.diff(times) == pytest.approx(0.01, abs=1e-6)
    assert all(entity.state.name == "NORMAL" for entity in made.entities if entity.stateful)


def test_sensors_agree_with_the_truth(swim):
    found, made = swim
    truth = {round(m.timestamp, 3): m for m in of(found, imc.SimulatedState)}
    last = of(found, imc.SimulatedState)[-1]
    assert last.z > 0.5
    assert last.r > 0.005
    assert last.svy == pytest.approx(0.2)
    for m in of(found, imc.Depth):
        assert m.value == pytest.approx(max(0.0, truth[round(m.timestamp, 3)].z), abs=0.3)
    for m in of(found, imc.GroundVelocity):
        state = truth[round(m.timestamp, 3)]
        if m.validity:
            assert m.x == pytest.approx(state.u + 0.2 * math.sin(state.psi) * math.cos(state.theta), abs=0.02)
    for m in of(found, imc.Distance, made, "Altimeter"):
        state = truth[round(m.timestamp, 3)]
        if state.z < 4.0:
            assert 3.5 < m.value * math.cos(state.theta) * math.cos(state.phi) + state.z < 5.0
    assert of(found, imc.Rpm)[-1].value == 1234
    current = of(found, imc.Current)
    assert current[-1].value > 1.5 * current[0].value


def test_specific_force_is_that_of_the_motion(swim):
    """Gravity and acceleration add up: turned to north-east-down and summed, they give the change of velocity."""
    found, _ = swim
    states = of(found, imc.SimulatedState)
    forces = {round(m.timestamp, 3): m for m in of(found, imc.Acceleration)}
    down = 0.0
    for state in states[300:1900]:
        force = forces[round(state.timestamp, 3)]
        ct, st, cr, sr = math.cos(state.theta), math.sin(state.theta), math.cos(state.phi), math.sin(state.phi)
        down += 0.01 * (-st * force.x + ct * sr * force.y + ct * cr * force.z + 9.80665)

    def sinking(m):
        return -math.sin(m.theta) * m.u + math.cos(m.theta) * (math.sin(m.phi) * m.v + math.cos(m.phi) * m.w)

    assert down == pytest.approx(sinking(states[1899]) - sinking(states[299]), abs=0.1)


@pytest.mark.heavy
@pytest.mark.computing
@pytest.mark.parametrize("time", [2.005, 9.137])
def test_it_goes_on_from_a_snapshot_with_the_same_bytes(tmp_path, time):
    first = vehicle(tmp_path / "a")
    first.start()
    swim_to(first, 0.0, time)
    state = load(take_snapshot(first))
    swim_to(first, time, LENGTH)
    first.close()
    second = vehicle(tmp_path / "b", state.time)
    restore(second, state)
    swim_to(second, time, LENGTH)
    second.close()
    whole, rest = (
        [m for m in messages(tmp_path / name) if m.timestamp > state.time / 1e9 and not isinstance(m, ABOUT_LOGS)]
        for name in "ab"
    )
    assert rest == whole
    assert len(whole) > 3000
