"""Pixels of moving points under a rolling shutter."""

from collections.abc import Callable

import numpy as np
from numpy.typing import ArrayLike, NDArray

from world.optics.camera_model import CameraModel, Floats

STEPS = 5


def row_time(readout: float, rows: ArrayLike, height: int) -> Floats:
    """Exposure times of rows: s from the middle row, for rows in px from the upper edge of a picture `height` px high.

    `readout` (s) passes over all rows.
    """
    return readout * (np.clip(np.nan_to_num(np.asarray(rows, float), nan=0.5 * height) / height, 0.0, 1.0) - 0.5)


def project_by_row(
    optics: CameraModel,
    readout: float,
    points_at: Callable[[Floats], Floats],
    shape: tuple[int, ...],
) -> tuple[Floats, NDArray[np.bool_]]:
    """Pixels (*shape, 2) of moving points, each in the row that is exposed when it is seen there, and which are valid.

    `points_at(times)` returns the points (*shape, 3) in m, in the optical frame of the camera at times of that shape,
    in s from the middle row.
    """
    pixels, valid = optics.project(points_at(np.zeros(shape)))
    for _ in range(STEPS if readout else 0):
        pixels, valid = optics.project(points_at(row_time(readout, pixels[..., 1], optics.height)))
    return pixels, valid
