"""Every parameter of the simulators has a description."""

import pytest

from tasks.simulators.depth_sensor import DepthSensor
from tasks.simulators.estimated_state import EstimatedState
from tasks.simulators.gps import GPS
from tasks.simulators.imu import IMU
from tasks.simulators.mug_detection_camera import MUGDetectionCamera


@pytest.mark.parametrize("task", [DepthSensor, EstimatedState, GPS, IMU, MUGDetectionCamera])
def test_unit_and_sentence(task):
    for parameter in task.parameters().values():
        assert parameter.description.endswith("."), parameter.name
        assert parameter.unit or parameter.type in (str, bool), parameter.name
