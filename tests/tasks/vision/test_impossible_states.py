"""States that no vehicle can be in: cameras and sensors say so, publish nothing of them, and go on."""

import math

import pytest

import imc
from runtime.testing import simulate
from tasks.simulated_world import TrueState
from tasks.simulators.dvl import DVL
from tasks.simulators.gps import GPS
from tasks.simulators.imu import IMU
from tasks.simulators.mug_detection_camera import MUGDetectionCamera
from tasks.vision.fisheye_camera import FisheyeCamera

FAULT, NORMAL = (imc.EntityState.State[name] for name in ("FAULT", "NORMAL"))
CAMERA = FisheyeCamera, {"size": 32, "face_size": 16}
MEASURED = (imc.GpsFix, imc.Acceleration, imc.AngularVelocity, imc.GroundVelocity, imc.EstimatedMugState)
WRONG = [("x", 1e30), ("z", math.inf), ("psi", 1e30), ("lat", 2.0), ("lon", 1e30)]
TASKS = [CAMERA, (MUGDetectionCamera, {}), (IMU, {}), (GPS, {"activation_depth": 10.0}), (DVL, {})]


def follow(kind, task, parameters, wrong):
    """A run of 6.5 s with states of 5 Hz, those of a kind wrong for 3 s; without truth if that is EstimatedState."""
    feed = []
    for n in range(30):
        time = n / 5 + 0.05
        bad = wrong if 1.0 <= time < 4.0 else {}
        here = {"timestamp": time, "z": 5.0, "lat": 0.7}
        if kind is imc.SimulatedState:
            feed += [kind(**{**here, **bad}), imc.EstimatedState(**here, depth=5.0, alt=4.0)]
        else:
            feed.append(kind(**{**here, "depth": 5.0, "alt": 4.0, **bad}))
    return simulate(task, feed=feed, seconds=6.5, **parameters)


@pytest.mark.parametrize(("field", "value"), [*WRONG, ("u", 1e30), ("r", -1e30), ("svy", 1e30), ("w", math.nan)])
@pytest.mark.parametrize(("task", "parameters"), TASKS)
def test_a_truth_that_cannot_be_is_named(task, parameters, field, value):
    run = follow(imc.SimulatedState, task, parameters, {field: value})
    said = [message.description for message in run.of(imc.EntityState) if message.state == FAULT]
    assert any(text.startswith("SimulatedState makes no sense") for text in said)
    assert run.task.entity.state == NORMAL
    numbers = [value for kind in MEASURED for m in run.of(kind) for value in (getattr(m, f, 0.0) for f in "xyz")]
    assert all(abs(number) < 1e3 for number in numbers)


@pytest.mark.parametrize(("field", "value"), [*WRONG, ("alt", 1e30)])
@pytest.mark.parametrize(("task", "parameters"), TASKS[:2])
def test_an_estimate_that_cannot_be_is_named(task, parameters, field, value):
    run = follow(imc.EstimatedState, task, parameters, {field: value})
    said = {message.description.partition(" (")[0] for message in run.of(imc.EntityState) if message.state == FAULT}
    assert said <= {"no position or attitude", "no altitude", "altitude out of range"}
    assert said
    assert run.task.entity.state == NORMAL


def test_velocities_that_cannot_be_do_not_move_an_estimate():
    run = follow(imc.EstimatedState, *CAMERA, {"vx": 1e30, "q": -1e30})
    assert all(frame.pose is not None and abs(frame.pose[:3, 3]).max() < 10.0 for frame in run.frames)


def test_a_truth_from_before_the_clock_was_set_back_is_none():
    truth = TrueState(None)
    truth.update(imc.SimulatedState(timestamp=5000.0, u=2.0))
    assert truth.pose_at(5000.5, 1.0).north == pytest.approx(1.0)
    assert truth.pose_at(1400.0, 1.0) is None
