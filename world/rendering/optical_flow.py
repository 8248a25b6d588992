"""Optical flow: where the points of one picture are seen in the next one."""

import math
from collections.abc import Mapping

import numpy as np
from numpy.typing import NDArray

from world.optics import CameraModel, Floats
from world.rendering.camera_pose import CameraPose
from world.rendering.objects.glider import Glider
from world.rendering.seabed import rotate

ViewAndGliders = tuple[CameraPose, Mapping[int, Glider]]


def compute_flow(
    optics: CameraModel,
    rays: Floats,
    distance: Floats,
    instances: NDArray[np.uint16],
    now: ViewAndGliders,
    then: ViewAndGliders,
    *,
    level: bool,
) -> NDArray[np.float32]:
    """(n, 2) px from each pixel to where its point is seen then; NaN where it is not.

    `rays` (3, n) are in the optical frame, `distance` (n,) in m, `instances` (n,) the numbers of the objects. What is
    `level` is known by the height of both cameras above it, what is not by their depths.
    """
    (sight, gliders), (after, moved) = now, then
    toward = rotate(sight.rotation, rays)
    shown = _still_points(toward, distance, sight, after, level=level)
    for number in np.unique(instances[instances > 0]).tolist():
        own = instances == number
        if number in moved:
            points = toward[:, own] * distance[own]
            shown[:, own] = _carried(points, gliders[number], moved[number], sight, after)
        else:
            shown[:, own] = np.nan
    pixels, _ = optics.project(rotate(after.rotation.T, shown).T)
    j, i = np.divmod(np.arange(instances.size), np.intp(optics.width))
    return (pixels - np.stack((i + 0.5, j + 0.5), axis=-1)).astype(np.float32)


def _still_points(toward: Floats, distance: Floats, sight: CameraPose, after: CameraPose, *, level: bool) -> Floats:
    """(3, n) directions to the points of ground and surface from the next camera, also to those at infinity.

    A point of a plane stays on it: where it lies is known by the distances of both cameras from the plane.
    """
    sink = sight.down - after.down
    if level:
        rise = 0.0 if math.isinf(sight.depth) else sight.depth - after.depth
        sink = np.where(toward[2] < 0.0, rise, after.height - sight.height)
    nearness = 1.0 / distance
    steps = (sight.north - after.north) * nearness, (sight.east - after.east) * nearness, sink * nearness
    return toward + np.stack(steps)


def _carried(points: Floats, glider: Glider, moved: Glider, sight: CameraPose, after: CameraPose) -> Floats:
    """(3, n) m from the next camera to points of a glider, given from the first one."""
    north, east, down = points - sight.vector_to_glider(glider)[:, np.newaxis]
    turn = moved.heading - glider.heading
    c, s = math.cos(turn), math.sin(turn)
    return np.stack((c * north - s * east, s * north + c * east, down)) + after.vector_to_glider(moved)[:, np.newaxis]
