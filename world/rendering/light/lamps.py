"""Lamps of a vehicle: how they light the ground, bodies, and the water before the camera."""

import math
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from support.pose import Pose
from support.rotations import Vector
from world.rendering.cube_faces import pixel_axis

Floats = NDArray[np.floating[Any]]

NODES = 17  # across a face, between which the light of the water is interpolated
SAMPLES = 24  # along a ray
NEAREST = 0.05  # m from the camera and from a lamp, within which there is no water
DARK = -40.0  # powers of two; less light would be denormal numbers, which are slow
LENGTHS = 5.0  # attenuation lengths after which nothing is seen


@dataclass(frozen=True)
class Lamp:
    """A lamp at `mount` in its vehicle; unturned it shines ahead. `flux` is in lm.

    `width` is the angle (rad) of its beam, at whose rim the intensity is half of that on the axis. Raises ValueError.
    """

    mount: Pose
    flux: float = 1500.0
    width: float = math.radians(80.0)

    def __post_init__(self) -> None:
        if not all(map(math.isfinite, self.mount)):
            raise ValueError(f"the mount of a lamp is not finite: {tuple(self.mount)}")
        if not 0.0 <= self.flux < math.inf:
            raise ValueError(f"flux = {self.flux:g} lm of a lamp is not a finite number from 0")
        if not 0.0 < self.width <= math.pi:
            raise ValueError(f"a beam of {math.degrees(self.width):g}° is not within 0 and 180°")

    @property
    def candela(self) -> float:
        """Intensity on the axis: the flux by the solid angle that the beam is worth."""
        angle = np.linspace(0.0, math.pi, 2001)
        return self.flux / (
            math.tau * float(np.trapezoid(self.relative_intensity(np.cos(angle)) * np.sin(angle), angle))
        )

    def relative_intensity(self, cosine: Floats) -> Floats:
        """Intensity by the cosine of the angle off the axis, 1 on it: a bell curve."""
        angle = np.arccos(np.clip(cosine, -1.0, 1.0))
        return np.exp2(np.maximum(-((angle * (2.0 / self.width)) ** 2), DARK))


def parse_lamp(text: str) -> Lamp:
    """The lamp of "x y z pitch yaw flux width", in m, °, lm and °; raises ValueError."""
    try:
        x, y, z, pitch, yaw, flux, width = map(float, text.split())
    except ValueError:
        raise ValueError(f"{text!r} is not forward, right, down, pitch, yaw, flux and width of a lamp") from None
    return Lamp(Pose(x, y, z, 0.0, math.radians(pitch), math.radians(yaw)), flux, math.radians(width))


class LampBeam(NamedTuple):
    """A lamp in one picture: `position` (m) and unit vector `axis` in NED, both from the camera."""

    lamp: Lamp
    position: Vector
    axis: Vector
    candela: float

    def illuminance(self, points: Floats, attenuation: Floats) -> tuple[Floats, Floats]:
        """Light (3, ...) that gets to points (3, ...; m, NED from the camera), in lux on a surface that faces the lamp.

        With it, the component (...) of its direction that goes down. `attenuation` (3,) is in 1/m.
        """
        shape = 3, *(1,) * (points.ndim - 1)
        apart = points - np.reshape(np.array(self.position, points.dtype), shape)
        distance = np.maximum(np.sqrt(np.sum(apart**2, axis=0)), NEAREST)
        cosine = np.sum(apart * np.reshape(np.array(self.axis, points.dtype), shape), axis=0) / distance
        lux = self.candela * self.lamp.relative_intensity(cosine) / distance**2
        return lux * np.exp(np.maximum(-np.reshape(attenuation, shape) * distance, DARK)), apart[2] / distance


def lamp_beams(lamps: Sequence[Lamp], vehicle: Pose, camera: Pose) -> tuple[LampBeam, ...]:
    """The lamps of a vehicle at a pose, seen from a camera whose mount is `camera`."""
    turn = np.array(vehicle.rotation)
    return tuple(
        LampBeam(
            lamp,
            _vector(turn @ (np.array(lamp.mount.position) - np.array(camera.position))),
            _vector(turn @ np.array(lamp.mount.rotation)[:, 0]),
            lamp.candela,
        )
        for lamp in lamps
    )


def _vector(found: Floats) -> Vector:
    x, y, z = found.tolist()
    return x, y, z


def ground_illuminance(lights: Sequence[LampBeam], points: Floats, attenuation: Floats) -> Floats:
    """Lux (3, ...) on level ground at points (3, ...; m, NED from the camera): inverse square, cosine, attenuation."""
    total = np.zeros((3, *points.shape[1:]), points.dtype)
    for beam in lights:
        lux, down = beam.illuminance(points, attenuation)
        total += lux * np.maximum(down, 0.0)
    return total


def body_illuminance(lights: Sequence[LampBeam], place: Vector, attenuation: Floats) -> Floats:
    """Lux (3,) on a small body that is at a place (m, NED from the camera) and faces the lamps."""
    points = np.reshape(place, (3, 1))
    return np.sum([beam.illuminance(points, attenuation)[0][:, 0] for beam in lights], axis=0)


def face_backscatter(
    lights: Sequence[LampBeam],
    turn: NDArray[np.float64],
    width: int,
    ground: float,
    attenuation: Floats,
    backward: Floats,
) -> Floats:
    """Light (3, width, width) that the water throws back into a face, whose optical frame `turn` rotates to NED.

    That of a grid of rays (see backscatter), between which it is interpolated. It lies over bodies, too, as if they
    were as far as the ground.
    """
    axis = np.linspace(-1.0, 1.0, NODES)
    rays = np.stack([*np.meshgrid(axis, axis), np.ones((NODES, NODES))])
    rays = np.einsum("ij,jkl->ikl", turn, rays / np.linalg.norm(rays, axis=0))
    found = backscatter(lights, rays, ground, attenuation, backward).astype(np.float32)
    place = (pixel_axis(width) + 1.0) * np.float32((NODES - 1) / 2)
    first = np.minimum(place.astype(np.int64), NODES - 2)
    share = place - first
    found = found[:, first] * (1 - share)[:, np.newaxis] + found[:, first + 1] * share[:, np.newaxis]
    return found[:, :, first] * (1 - share) + found[:, :, first + 1] * share


def backscatter(
    lights: Sequence[LampBeam], rays: Floats, ground: float, attenuation: Floats, backward: Floats
) -> Floats:
    """Light (3, ...) that the water throws back along rays (3, ...; unit vectors in NED).

    It is in the unit of a white surface in one lux. Single scattering: what `backward` (3,; 1/m) is in all, spread
    evenly over the half space behind; summed along the rays as far as the ground, `ground` m below, or as the eye.
    """
    farthest = LENGTHS / float(np.min(attenuation))
    with np.errstate(divide="ignore"):
        end = np.where(rays[2] > 0.0, np.minimum(ground / rays[2], farthest), farthest)
    share = np.reshape(np.linspace(0.0, 1.0, SAMPLES + 1), (SAMPLES + 1, *(1,) * (rays.ndim - 1)))
    steps = NEAREST * np.maximum(end / NEAREST, 2.0) ** share
    middle, length = np.sqrt(steps[1:] * steps[:-1]), np.diff(steps, axis=0)
    sight = np.exp(-np.reshape(attenuation, (3, *(1,) * rays.ndim)) * middle)
    found = np.zeros((3, *rays.shape[1:]))
    for beam in lights:
        lux, _ = beam.illuminance(rays[:, np.newaxis] * middle, attenuation)
        found += np.sum(lux * sight * length, axis=1)
    # Of radiance backward / 2 pi per lux, and 1 / pi per lux is white.
    return found * 0.5 * np.reshape(backward, (3, *(1,) * (rays.ndim - 1)))
