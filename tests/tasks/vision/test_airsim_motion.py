"""Where AirSim's vehicle and camera are, by what it tells, or by what the states of Shoal's vehicle say."""

import itertools
import math

import msgspec
import numpy as np
import pytest

import imc
from runtime import State
from support.pose import Pose
from tests.tasks.vision.airsim_standin import StandIn, about, times
from tests.tasks.vision.test_airsim import LAT, LON, NOWHERE, shot, truth


@pytest.mark.parametrize(
    ("question", "fields", "said"),
    [
        ("simGetGroundTruthKinematics", {"position": {**NOWHERE, "x_val": -1e300}}, "a pose"),
        ("simGetGroundTruthKinematics", {"linear_velocity": {**NOWHERE, "x_val": 1e39}}, "a motion"),
        ("simGetGroundTruthKinematics", {"angular_velocity": NOWHERE}, "a motion"),
        ("getHomeGeoPoint", {"latitude": 91.0}, "a place"),
        ("getHomeGeoPoint", {"altitude": math.inf}, "a place"),
    ],
)
def test_motions_and_places_that_cannot_be_are_named(question, fields, said):
    def change(method, answer):
        if method != question:
            return answer
        kind, number, error, result = msgspec.msgpack.decode(answer)
        return msgspec.msgpack.encode([kind, number, error, result | fields])

    with StandIn() as server:
        server.fault = change
        run = shot(server, feed=[], pose_from="AirSim", publish_truth=True)
        assert f"{said} that is none: " in run.task.entity.description
        assert (run.task.entity.state, run.frames) == (State.ERROR, [])


class Moving(StandIn):
    """Its vehicle goes on between two answers, to the north and turning, once `fast` (m/s) is set."""

    def __init__(self, fast=0.0):
        super().__init__()
        self.fast, self.lags = fast, itertools.cycle((0.005, 0.04, 0.02, 0.03, 0.01))

    def go_on(self):
        seconds = next(self.lags)
        self.place = self.place + np.array([self.fast, 0.0, 0.0]) * seconds
        self.turn = times(self.turn, about(2, 0.1 * self.fast * seconds))

    def _answer(self, number, method, given):
        if method in ("simGetGroundTruthKinematics", "simGetImages"):
            self.go_on()
        return super()._answer(number, method, given)


def flown(server):
    return shot(server, seconds=2.0, feed=[], pose_from="AirSim", publish_truth=True, cameras=["front_center"])


def test_the_mount_is_exact_once_the_vehicle_has_been_at_rest_and_so_is_its_place():
    with Moving() as server:

        def start(method, answer):
            if method == "simGetImages":
                server.fast = 10.0
            return answer

        def wait(method, answer):
            if method == "simGetImages":
                server.fault = start
            return answer

        server.fault = wait
        run = flown(server)
    assert len(run.frames) >= 9
    for frame in run.frames:
        assert frame.mount[:3, 3] == pytest.approx(server.lever, abs=1e-6)
    told = run.of(imc.SimulatedState)
    assert told[-1].x > 3.0
    for state, frame in zip(told, run.frames, strict=True):
        body = Pose(state.x, state.y, state.z, state.phi, state.theta, state.psi).transform
        assert body[:3, :3] @ server.lever + body[:3, 3] == pytest.approx(frame.pose[:3, 3], abs=1e-5)


def test_the_mount_in_motion_is_as_good_as_the_least_motion_allows():
    with Moving(fast=10.0) as server:
        run = flown(server)
    off = [float(np.linalg.norm(frame.mount[:3, 3] - server.lever)) for frame in run.frames]
    assert max(off) < 10.0 * 0.06 / 2
    assert off[-1] < 10.0 * 0.015 / 2  # between the answers that were closest together


def test_a_camera_that_is_turned_in_the_vehicle_is_measured_anew():
    with Moving() as server:

        def turn(method, answer):
            if len(server.calls) > 20:
                server.lever = np.array([0.0, 0.3, 0.0])
            return answer

        server.fault = turn
        run = flown(server)
    assert run.frames[0].mount[:3, 3] == pytest.approx([0.5, 0.0, 0.1], abs=1e-6)
    assert run.frames[-1].mount[:3, 3] == pytest.approx([0.0, 0.3, 0.0], abs=1e-6)


def test_the_estimate_is_carried_on_to_the_exposure():
    moving = [(t / 5, {"lat": LAT, "lon": LON, "x": 2.0 * t / 5, "z": 3.0}) for t in range(10)]
    feed = [
        message
        for t, place in moving
        for message in (
            imc.SimulatedState(timestamp=t, u=2.0, **place),
            imc.EstimatedState(timestamp=t, vx=2.0, **place),
        )
    ]
    with StandIn() as server:
        frames = shot(server, seconds=1.9, feed=feed, frame_rate=7.0).of(imc.CameraFrame)
    assert len(frames) >= 12
    assert [frame.est_x for frame in frames] == pytest.approx([frame.x for frame in frames], abs=1e-3)


def test_without_states_of_the_last_second_there_is_a_fault_and_no_picture():
    with StandIn() as server:
        for feed in ([], [imc.EstimatedState(timestamp=0.1, lat=LAT, lon=LON, z=3.0)]):
            run = shot(server, seconds=3.0, feed=feed)
            assert run.task.entity.state is State.FAULT
            assert run.task.entity.description == "no SimulatedState or EstimatedState of the last 1 s"
            assert all(frame.time - run.vehicle.start_time <= 1.1 for frame in run.frames)
        feed = [truth(t / 10) for t in (*range(8), *range(25, 30))]
        assert shot(server, seconds=3.0, feed=feed).task.entity.state is State.NORMAL


def test_what_a_connection_was_made_with_is_not_editable():
    wanted = [imc.EntityParameter(name=name, value=value) for name, value in (("Compress", "true"), ("Timeout", "0.3"))]
    order = imc.SetEntityParameters(timestamp=0.3, name="Air", params=tuple(wanted))
    with StandIn() as server:
        run = shot(server, feed=[truth(0.0), order], entity_label="Air")
    assert (run.task.compress, run.task.timeout) == (False, 1.0)
