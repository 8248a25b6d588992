"""The noise-free IMU of whole vehicles: its samples, integrated for 30 s, lead to where the vehicle is."""

import numpy as np
import pytest

import imc
from shoal import fly
from shoal.missions import parse_plan
from support.rotations import rotation
from tests.repeats import repeat

HEAD = "plan: corners\norigin: 41.185°, -8.7062°\nspeed: 1.2 m/s\nmaneuvers:\n"
LEGS = "  - goto: {north: 20, at}\n  - goto: {north: 20, east: 30, at}\n  - goto: {north: -60, at}\n"
PLANS = {
    "lauv-noptilus-1": HEAD + LEGS.replace("at", "depth: 3 m"),
    "otter": HEAD + LEGS.replace("at", "depth: 0 m"),
    "hexa-00": HEAD + "  - takeoff: {altitude: 5}\n" + LEGS.replace("at", "altitude: 10"),
}
SECONDS = 30.0
GRAVITY = np.array([0.0, 0.0, 9.80665])


def turned(angles):
    """The rotation matrix of a rotation vector (rad), by Rodrigues' formula."""
    x, y, z = angles
    size = float(np.linalg.norm(angles)) or 1e-12
    k = np.array([[0.0, -z, y], [z, 0.0, -x], [-y, x, 0.0]]) / size
    return np.eye(3) + np.sin(size) * k + (1.0 - np.cos(size)) * k @ k


def position(state):
    return np.array([state.x, state.y, state.z])


def miss(truth, samples, begin):
    """How far (m) dead reckoning is off the truth after SECONDS from `begin` (s)."""
    forces = [m for m in samples if isinstance(m, imc.Acceleration) and m.time >= begin]
    rates = [m for m in samples if isinstance(m, imc.AngularVelocity) and m.time >= begin]
    time = forces[0].time
    state = truth[round(time, 4)]
    attitude = np.array(rotation(state.phi, state.theta, state.psi))
    velocity = attitude @ [state.u, state.v, state.w] + [state.svx, state.svy, state.svz]
    place = position(state)
    for force, rate in zip(forces[1:], rates[1:], strict=True):
        if force.time > forces[0].time + SECONDS + 1e-6:
            break
        step, time = force.time - time, force.time
        turn = np.array([rate.x, rate.y, rate.z]) * step
        middle = attitude @ turned(0.5 * turn)
        before, velocity = velocity, velocity + (middle @ [force.x, force.y, force.z] + GRAVITY) * step
        place = place + 0.5 * step * (before + velocity)
        attitude = attitude @ turned(turn)
    assert time == pytest.approx(forces[0].time + SECONDS, abs=0.03)
    return float(np.linalg.norm(place - position(truth[round(time, 4)])))


@pytest.mark.heavy
@pytest.mark.parametrize(
    ("profile", "rate", "limit", "more"),
    [
        ("lauv-noptilus-1", 100, 0.05, ()),
        repeat(("otter", 100, 0.05, ())),
        ("otter", 100, 0.3, ("World:Wave Height=0.5",)),
        ("hexa-00", 50, 2.0, ()),
        repeat(("hexa-00", 200, 0.3, ())),
    ],
)
def test_dead_reckoning_follows_the_truth(profile, rate, limit, more, tmp_path):
    overrides = [*more, "Simulators.IMU/AHRS:Generate Noise=false", f"Simulators.IMU/AHRS:Sampling Rate={rate}"]
    fly(parse_plan(PLANS[profile]), profile, limit=60.0, log_root=tmp_path, overrides=overrides)
    folder = max(tmp_path.rglob("Data.lsf.gz"), key=lambda file: file.stat().st_size).parent
    log = imc.Log(folder)
    truth = {round(m.timestamp, 4): m for m in log.messages("SimulatedState")}
    samples = list(log.messages("Acceleration", "AngularVelocity"))
    assert np.ptp([position(m) for m in truth.values()], axis=0).max() > 20.0
    for begin in (5.0, 15.0):
        assert miss(truth, samples, min(truth) + begin) <= limit
