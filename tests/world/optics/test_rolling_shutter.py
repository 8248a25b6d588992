"""Points that move while a shutter passes over the rows of a picture."""

import numpy as np
import pytest

from world.optics import PinholeModel, project_by_row, row_time

CAMERA = PinholeModel(200, 100, 80.0, 80.0, 100.0, 50.0)


def test_a_point_is_seen_in_the_row_that_is_exposed_then() -> None:
    speeds, readout = np.array([[0.0, 0.2], [-0.3, 0.4]]), 0.5

    def points_at(times):
        return np.stack([np.full((2, 2), 0.1), 0.05 + speeds * times, np.ones((2, 2))], axis=-1)

    pixels, valid = project_by_row(CAMERA, readout, points_at, (2, 2))
    middle, slope = 80.0 * 0.05 + 50.0, 80.0 * speeds
    expected = (middle - 0.5 * readout * slope) / (1.0 - readout * slope / 100.0)
    assert valid.all()
    np.testing.assert_allclose(pixels[..., 0], 108.0)
    np.testing.assert_allclose(pixels[..., 1], expected, atol=1e-3)
    still, _ = project_by_row(CAMERA, 0.0, points_at, (2, 2))
    np.testing.assert_allclose(still[..., 1], middle)


def test_rows_beyond_the_picture_have_the_time_of_its_edge() -> None:
    times = row_time(0.4, [-9.0, 0.0, 25.0, 100.0, 300.0, np.nan], 100)
    np.testing.assert_allclose(times, [-0.2, -0.2, -0.1, 0.2, 0.2, 0.0])


def test_a_point_comes_into_the_picture_while_the_shutter_passes() -> None:
    def points_at(times):
        return np.stack([np.zeros_like(times), 0.7 - 0.5 * times, np.ones_like(times)], axis=-1)

    assert not project_by_row(CAMERA, 0.0, points_at, ())[1]
    pixel, valid = project_by_row(CAMERA, 1.0, points_at, ())
    assert valid
    assert pixel[1] == pytest.approx((50.0 + 56.0 + 20.0) / 1.4, abs=0.5)
