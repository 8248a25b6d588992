"""Lenses that move places in the plane of focal length 1: their derivatives, and the way back by Newton's method."""

import math
from collections.abc import Callable

import numpy as np

from world.optics.camera_model import Bools, Floats, normalize

NEWTON_STEPS = 20
EXACT = 1e-12  # of the focal length
WIDEST = 100.0  # of the focal length: 89.4° off the axis

Slope = tuple[Floats, Floats, Floats, Floats]
"""Derivatives (...): of x by x, of x by y, of y by x, of y by y."""


def fold_angle(edge: float) -> float | None:
    """The angle (rad) off the axis of the squared radius `edge`, from which on a picture folds; None beyond WIDEST."""
    return math.atan(math.sqrt(edge)) if edge < WIDEST**2 else None


def points_before_lens(points: Floats, edge: float) -> tuple[Floats, Floats, Bools]:
    """Places x and y (...) in the plane before a lens of points (..., 3), and which of them it does not fold."""
    x, y = points[..., 0] / points[..., 2], points[..., 1] / points[..., 2]
    return x, y, (points[..., 2] > 0.0) & (x * x + y * y < edge)


def distortion_jacobian(slope: Callable[[Floats, Floats], Slope], points: Floats) -> Floats:
    """Derivatives (..., 2, 3) of places after a lens by the points (..., 3) before the camera."""
    z = points[..., 2]
    x, y = points[..., 0] / z, points[..., 1] / z
    a, b, c, d = slope(x, y)
    rows = [[a / z, b / z, -(a * x + b * y) / z], [c / z, d / z, -(c * x + d * y) / z]]
    return np.stack([np.stack(row, axis=-1) for row in rows], axis=-2)


def invert_distortion(
    bend: Callable[[Floats, Floats], Floats],
    slope: Callable[[Floats, Floats], Slope],
    places: Floats,
    start: Floats,
    edge: float,
) -> tuple[Floats, Bools]:
    """The rays (..., 3) to the places that `bend` moves to `places` (..., 2), and which were found, from `start`.

    One beyond the squared radius `edge`, where the lens folds, is not found. A step is at most half of 1 plus the
    distance from the axis, so that a flat slope leads nowhere far.
    """
    bare = start
    with np.errstate(invalid="ignore", over="ignore", divide="ignore"):
        for _ in range(NEWTON_STEPS):
            x, y = bare[..., 0], bare[..., 1]
            error, (a, b, c, d) = bend(x, y) - places, slope(x, y)
            across = a * d - b * c
            step = (
                np.stack((d * error[..., 0] - b * error[..., 1], a * error[..., 1] - c * error[..., 0]), axis=-1)
                / across[..., None]
            )
            size = np.linalg.norm(step, axis=-1, keepdims=True)
            bare = bare - step * np.minimum(1.0, 0.5 * (1.0 + np.linalg.norm(bare, axis=-1, keepdims=True)) / size)
            bare = np.where(size > 0.0, bare, np.stack((x, y), axis=-1))
            if not (size > EXACT).any():
                break
        x, y = bare[..., 0], bare[..., 1]
        found = np.linalg.norm(bend(x, y) - places, axis=-1) < EXACT * (1.0 + np.linalg.norm(places, axis=-1))
        return normalize(np.stack((x, y, np.ones_like(x)), axis=-1)), found & (x * x + y * y < edge)
