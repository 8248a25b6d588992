"""Mini underwater gliders (MUGs): bright yellow bodies, drawn over the faces of a fisheye camera."""

import math
from collections.abc import Callable
from dataclasses import dataclass
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from support.rotations import Vector
from world.objects import DIAMETER, LENGTH
from world.rendering.cube_faces import Window, pixel_axis
from world.rendering.light import rgb
from world.rendering.objects.seabed_and_walls import RestingBody

Floats = NDArray[np.floating[Any]]

Pixels = tuple[NDArray[np.intp], NDArray[np.intp]]
"""Rows and columns."""
HiddenTest = Callable[[Pixels, Floats], NDArray[np.bool_]]
"""Mask of the pixels (n,) of a body, at 1 over the distance along the axis of the face (n,), that are hidden."""

YELLOW = rgb(3.2, 1.9, 0.02)
RIM = math.radians(80.0)  # beyond the rim of a face, which is at 45°


class Glider(NamedTuple):
    """A glider in a scene: m north and east of its origin, `height` m above the ground beneath the camera.

    It points to `heading` (rad); its sizes are in m. `id` is its number in labels, from 1; 0 if it has none.
    """

    north: float
    east: float
    height: float = 0.0
    heading: float = 0.0
    length: float = LENGTH
    diameter: float = DIAMETER
    id: int = 0


@dataclass(frozen=True)
class CameraGlider:
    """A glider that points to `heading` (rad); its center is (north, east, down) m from the camera."""

    center: tuple[float, float, float]
    heading: float = 0.0
    length: float = LENGTH
    radius: float = DIAMETER / 2


def glider_contact_geometry(
    north: float, east: float, down: float, heading: float, length: float, radius: float
) -> RestingBody:
    """Pose of a glider whose middle is at a place (m; north, east, down)."""
    points = np.empty((3, 3))
    aside = (length / 2 - radius) * np.array((-1.0, 0.0, 1.0))
    points[:, 0] = north + aside * math.cos(heading)
    points[:, 1] = east + aside * math.sin(heading)
    points[:, 2] = down
    return points, radius, length


def draw_glider(
    face: NDArray[np.uint8],
    turn: NDArray[np.float64],
    window: Window,
    mug: CameraGlider,
    light: Callable[[Floats, Floats], Floats],
    sun: Vector = (0.0, 0.0, -1.0),
    hidden: HiddenTest | None = None,
) -> None:
    """Draws a glider into a window of a face (w, w, 4); `turn` (3, 3) rotates its optical frame to NED.

    `light(reflected, distance)` is what the camera sees, 0 to 255, of reflectances (3, n, m) at distances (n, m) in m;
    `sun` is the direction to the sun; `hidden` marks those of its pixels that are behind something else.
    """
    width = face.shape[0]
    center = turn.T @ np.array(mug.center)
    bow = turn.T @ np.array([math.cos(mug.heading), math.sin(mug.heading), 0.0])
    touched = _touched(center, mug.length / 2, width, window)
    if touched is None:
        return
    axis = pixel_axis(width)
    x, y = np.meshgrid(axis[touched[1]], axis[touched[0]])
    ray = np.stack([x, y, np.ones_like(x)])
    norm = np.linalg.norm(ray, axis=0)
    ray /= norm
    # Nearest points of the ray and of the body's axis.
    along, ahead, aside = _dot(bow, ray), _dot(center, ray), float(center @ bow)
    half = mug.length / 2 - mug.radius
    place = np.clip((along * ahead - aside) / np.maximum(1 - along * along, 1e-9), -half, half)
    distance = ahead + place * along
    apart = center[:, None, None] + place * bow[:, None, None] - distance * ray
    gap = np.linalg.norm(apart, axis=0)
    pixel = distance * 2 / width / norm**2
    cover = np.where(distance > 0, np.clip((mug.radius - gap) / pixel + 0.5, 0.0, 1.0), 0.0)
    if not cover.any():
        return
    if hidden is not None:
        own = np.nonzero(cover > 0.0)
        pixels = own[0] + touched[0].start, own[1] + touched[1].start
        cover[own] *= ~hidden(pixels, norm[own] / distance[own])
    own = np.nonzero(cover)
    if not own[0].size:
        return
    box = tuple(slice(int(places.min()), int(places.max()) + 1) for places in own)
    apart, ray, gap, distance, cover = apart[:, *box], ray[:, *box], gap[box], distance[box], cover[box]
    normal = -apart / mug.radius - ray * np.sqrt(np.clip(1 - (gap / mug.radius) ** 2, 0.0, 1.0))
    lit = 0.4 + 0.6 * np.clip(_dot(turn.T @ np.array(sun), normal), 0.0, 1.0)
    color = np.moveaxis(light((YELLOW * lit).astype(np.float32), distance.astype(np.float32)), 0, -1)
    shown = face[touched[0], touched[1], :3][box]
    shown[...] = np.rint(shown + (color - shown) * cover[..., np.newaxis])


def _dot(vector: NDArray[np.float64], field: NDArray[np.float64]) -> NDArray[np.float64]:
    return np.tensordot(vector, field, axes=1)


def _touched(center: NDArray[np.float64], radius: float, width: int, window: Window) -> tuple[slice, slice] | None:
    """Rows and columns of a face that a ball can touch; None if there are none."""
    x, y, z = (float(value) for value in center)
    spans: list[slice] = []
    for across, (first, last) in zip((y, x), window, strict=True):
        away = math.hypot(across, z)
        if away > radius:
            middle, half = math.atan2(across, z), math.asin(radius / away)
            low, high = (
                (math.tan(max(-RIM, min(RIM, angle))) + 1) * width / 2 for angle in (middle - half, middle + half)
            )
            first, last = max(first, math.floor(low) - 1), min(last, math.ceil(high) + 1)
        if first >= last:
            return None
        spans.append(slice(first, last))
    return spans[0], spans[1]
