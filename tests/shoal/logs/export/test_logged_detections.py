"""Where detections are in pictures."""

import numpy as np
import pytest

from shoal.logs.export.camera_calibration import LoggedCamera
from shoal.logs.export.logged_detections import FIELDS, MUG, STATE, SystemDetections
from shoal.logs.export.ros_standard_conversion import MapOrigin
from world.optics import PinholeModel

MODEL = PinholeModel(200, 100, 80.0, 80.0, 100.0, 50.0)
DOWN = np.array([[0.0, -1.0, 0.0, 0.0], [1.0, 0.0, 0.0, 0.0], [0.0, 0.0, 1.0, 0.0], [0.0, 0.0, 0.0, 1.0]])


def table(name: str, **columns: object) -> "np.ndarray":
    rows = np.zeros(np.size(columns["timestamp"]), [(field, "f8") for field in FIELDS[name]])
    for field, values in columns.items():
        rows[field] = values
    return rows


@pytest.mark.parametrize("readout", [0.0, 0.4])
def test_a_keypoint_lies_in_the_row_that_was_exposed_when_it_was_seen_there(readout: float) -> None:
    """4 m above the bottom, 2 m/s to the north; the picture of 1.0 s, in which up is ahead."""
    times = np.arange(41) / 20
    states = table(STATE, timestamp=times, x=2.0 * times, alt=4.0)
    glider = table(MUG, timestamp=1.0, id=1, x=1.5, y=0.5)
    camera = LoggedCamera({"readout_time": readout}, DOWN)
    found = SystemDetections(MapOrigin(0.0, 0.0, 0.0), states, glider)
    ((spot, pixel, _),) = found.project_into_photo(1.0, MODEL, camera)
    assert spot.place == pytest.approx((3.5, 0.5, 4.0), abs=1e-6)
    time = 1.0 + readout * (pixel[1] / 100.0 - 0.5)
    assert pixel == pytest.approx((100.0 + 80.0 * 0.5 / 4.0, 50.0 - 80.0 * (3.5 - 2.0 * time) / 4.0), abs=0.01)
