"""Draws walls into square faces: concrete, from the bottom to the surface."""

import math
from collections.abc import Sequence
from typing import Any

import numpy as np
from numpy.typing import NDArray

from world.rendering.cube_faces import Window, pixel_axis
from world.rendering.light import LampBeam, rgb, rgba_words
from world.rendering.objects.seabed_and_walls import Wall, inverse_range_to_wall
from world.rendering.procedural_textures import TONES
from world.rendering.scenes import ScenePose, SeabedScene
from world.rendering.seabed import rotate
from world.rendering.textured_planes import TexturedPlane, TextureSampler, Words

Floats = NDArray[np.floating[Any]]

FAINTEST = 1e-4  # nearness beyond which nothing is seen
BAND = 32  # rows of a face that are looked at together
DARK, BRIGHT = rgb(0.16, 0.16, 0.14)[:, 0], rgb(0.75, 0.73, 0.66)[:, 0]


def draw_wall(
    face: Words,
    near: NDArray[np.float32],
    turn: NDArray[np.float64],
    window: Window,
    wall: Wall,
    pose: ScenePose,
    scene: SeabedScene,
    lights: Sequence[LampBeam],
) -> None:
    """Draw a wall into a window of a face (w, w) where it is nearer than what is there.

    `near` (w, w) is 1 over the distance along the face's axis, and becomes that of the wall; `turn` (3, 3) rotates the
    face's frame to NED, and the camera is at a `pose`.
    """
    (first, last), (left, right) = window
    axis, place = pixel_axis(face.shape[0]).astype(np.float64), (pose.north, pose.east, pose.depth)
    for start in range(first, last, BAND):
        rows = slice(start, min(start + BAND, last))
        x, y = np.meshgrid(axis[left:right], axis[rows])
        rays = rotate(turn, np.stack((x.ravel(), y.ravel(), np.ones(x.size))))
        found = inverse_range_to_wall(wall, place, rays)
        shown = near[rows, left:right]
        own = np.flatnonzero(found > np.maximum(shown.ravel(), FAINTEST))
        if own.size:
            mask = np.unravel_index(own, shown.shape)
            shown[mask] = found[own]
            points = rays[:, own] / found[own]
            face[rows, left:right][mask] = _colors(wall, points, 2.0 / face.shape[0], pose, scene, lights)


def _colors(
    wall: Wall, points: Floats, pixel: float, pose: ScenePose, scene: SeabedScene, lights: Sequence[LampBeam]
) -> Words:
    """RGBA words (n,) of a wall at points (3, n; m, NED from the camera), for pixels of an angle (rad)."""
    (an, ae), (bn, be) = ((n - pose.north, e - pose.east) for n, e in wall)
    length = math.hypot(bn - an, be - ae)
    cos, sin = (bn - an) / length, (be - ae) / length
    along, aside = (points[0] - an) * cos + (points[1] - ae) * sin, an * sin - ae * cos
    toward = (-sin, cos) if aside > 0.0 else (sin, -cos)  # where its side that is seen looks to
    layer = scene.bottom_layers[0]
    print_ = TextureSampler(
        layer, TexturedPlane(1, 1.0, scene.bottom_layers, np.empty(0, dtype=np.uint32)), 1.0, (0.0, 0.0), 0.0
    )
    away = np.sqrt(np.sum(points**2, axis=0))
    sine = np.maximum(np.abs(aside) / away, 0.02)
    level = np.ceil(np.log2(pixel * away / layer.texel) - 0.75 * np.log2(sine) - 0.3)
    level = np.clip(level, 0, print_.coarsest).astype(np.int32)
    column, row = (
        (values / layer.texel + far).astype(np.int32) for values, far in ((along, 1 << 20), (pose.depth + points[2], 0))
    )
    tones = (print_.sample(column, row, level) % TONES).astype(np.float32) / (TONES - 1)
    lit, veil = scene.ground_and_veil_light(pose, lights, points, scene.daylight_share_by_normal(*toward, 0.0))
    linear = ((DARK + (BRIGHT - DARK) * tones) * lit).astype(np.float32)
    return rgba_words(linear, veil.astype(np.float32))
