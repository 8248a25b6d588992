"""Newton's method for lenses that move places in the plane of focal length 1."""

from collections.abc import Callable

import numpy as np

from world.optics.camera_model import Bools, Floats

NEWTON_STEPS = 20
EXACT = 1e-12  # of the focal length

Slope = tuple[Floats, Floats, Floats, Floats]
"""Derivatives (...): of x by x, of x by y, of y by x, of y by y."""


def invert_distortion(
    bend: Callable[[Floats, Floats], Floats], slope: Callable[[Floats, Floats], Slope], places: Floats, start: Floats
) -> tuple[Floats, Bools]:
    """The places (..., 2) that `bend` moves to `places` (..., 2), and which of them were found, from `start` (..., 2).

    A step is at most half of 1 plus the distance from the axis, so that a flat slope leads nowhere far.
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
        left = np.linalg.norm(bend(bare[..., 0], bare[..., 1]) - places, axis=-1)
        return bare, left < EXACT * (1.0 + np.linalg.norm(places, axis=-1))
