"""What AirSim tells of its vehicle and camera when it moves by itself."""

import math

import msgspec
import pytest

from runtime import State
from tests.tasks.vision.airsim_standin import StandIn
from tests.tasks.vision.test_airsim import NOWHERE, shot


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
