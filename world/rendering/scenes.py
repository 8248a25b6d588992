"""The two scenes of a camera: over a seabed under water, and over the sea in the air."""

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from functools import partial
from typing import Any

import numpy as np
from numpy.typing import NDArray

from support.pose import Pose
from support.rotations import Vector, to_ned
from world.rendering import procedural_textures
from world.rendering.light import lamps, water_optics
from world.rendering.light.lamps import Beam
from world.rendering.textured_planes import Layer, Plane
from world.sea import Waves
from world.sun import Sun

Floats = NDArray[np.floating[Any]]

CLOUDS = 900.0  # height of the clouds, m
Look = Callable[[Floats, Floats], Floats]  # from reflectances and distances to 0..255
REACH = 64  # m, to which caustics are seen
FLAKE = 0.6  # reflectance of marine snow
SHALLOWEST = 0.05  # m; any closer, a few texels of the surface would fill the upper view


SHADE = 0.4  # share of the daylight that comes from all sides
LOWEST = 0.05  # sine of the elevation of a sun that lights slopes


# Places on the ground (3, n) for a camera at a height of 1, as far as five times that.
_away, _bearing = (a.ravel() for a in np.meshgrid(np.linspace(0.0, 6.0, 13), np.linspace(0.0, math.tau, 17)))
GRID = np.stack([_away * np.cos(_bearing), _away * np.sin(_bearing), np.ones_like(_away)])


@dataclass(frozen=True)
class Standpoint:
    """Where a vehicle is: m north and east of the scene's origin, Euler angles of body to NED in rad.

    `height` is m above the seabed or the sea surface, `depth` m below the sea surface; `time` in s moves the waves.
    """

    north: float
    east: float
    height: float
    depth: float = 0.0
    roll: float = 0.0
    pitch: float = 0.0
    yaw: float = 0.0
    time: float = 0.0

    @property
    def pose(self) -> Pose:
        """In north, east and down of the world."""
        return Pose(self.north, self.east, self.depth, self.roll, self.pitch, self.yaw)

    def carried(self, mount: Pose) -> "Standpoint":
        """Where a sensor is, by its place in the vehicle; angles stay those of the vehicle."""
        if mount.place == (0.0, 0.0, 0.0):
            return self
        north, east, down = to_ned(self.pose.rotation, mount.place)
        return replace(
            self,
            north=self.north + north,
            east=self.east + east,
            height=self.height - down,
            depth=self.depth + down,
        )


class Seabed:
    """Rippled sand below, the waves of the sea surface above, and water in between."""

    visibility = 20.0

    def __init__(self, visibility: float, seed: int, waves: Waves, sun: Sun, water: str = ""):
        self.water = water_optics.typed_water(water, sun.slant) if water else water_optics.water(visibility, sun.slant)
        self.sun, self.lux = sun.towards_under_water, sun.lux
        sand, swell, ground = procedural_textures.under_water(seed)
        self.bottom = Layer(ground, 0.0625, 1.1), Layer(sand, 0.012, 0.3)
        self.surface = Layer(swell, 0.02, 0.5, 0.7), Layer(swell, 0.083, 0.9, 1.6)
        self.bottom_colours, self.surface_colours = (
            water_optics.seabed(),
            water_optics.surface_from_below(waves.roughness),
        )

    def planes(self, pose: Standpoint, lights: Sequence[Beam] = ()) -> tuple[Plane, Plane]:
        """The planes below and above the camera, also by the light of lamps."""
        depth, (lit, aperture) = max(pose.depth, SHALLOWEST), self._lit(pose, lights)
        on_bottom, on_top, around = (lit(d) for d in (depth + pose.height, 0.0, depth))
        sand = self._palette(self.bottom_colours * on_bottom, 1, pose.height, around)
        shade = partial(self._shade, pose.height, on_bottom, around, aperture, lights) if lights else None
        return (
            Plane(1, pose.height, self.bottom, sand, shade),
            Plane(-1, depth, self.surface, self._palette(self.surface_colours * on_top, -1, depth, around)),
        )

    def surface_plane(self, pose: Standpoint, lights: Sequence[Beam] = (), highest: float = 1.0) -> Plane:
        """The plane above the camera, for rays up to an elevation whose sine is `highest`."""
        depth, (lit, _) = max(pose.depth, SHALLOWEST), self._lit(pose, lights)
        seen = min(water_optics.ROWS, max(1, math.ceil(highest * water_optics.ROWS)))
        words = np.zeros((water_optics.ROWS, water_optics.SUMS), dtype=np.uint32)
        palette = self._palette(self.surface_colours[:, :seen] * lit(0.0), -1, depth, lit(depth), seen)
        words[:seen] = palette.reshape(seen, -1)
        return Plane(-1, depth, self.surface, words.ravel())

    def facing(self, north: Any, east: Any, up: Any) -> Any:
        """Daylight on what looks to a direction (unit vectors, one or many), as share of that on level ground."""
        sun = self.sun
        if sun[2] > -LOWEST:
            return SHADE + (1.0 - SHADE) * up
        return SHADE + (1.0 - SHADE) * np.clip((north * sun[0] + east * sun[1] - up * sun[2]) / -sun[2], 0.0, 2.0)

    def ground(self, pose: Standpoint, lights: Sequence[Beam], points: Floats, facing: Any) -> tuple[Floats, Floats]:
        """What the camera sees of white ground, and of the water before it: (3, n) by color, linear light.

        The ground is at points (3, n; m, NED from the camera); `facing` (n,) is its share of daylight.
        """
        depth, (lit, aperture) = max(pose.depth, SHALLOWEST), self._lit(pose, lights)
        away = np.sqrt(np.sum(points**2, axis=0))[np.newaxis]
        on_ground = lit(np.maximum(depth + points[2:], 0.0)) * facing
        if lights:
            on_ground = on_ground + aperture * self._lamplight(points[:, np.newaxis], lights)
        veil = self._glow(-points[2] / away, lit(depth)) * self.water.veil(away)
        return (on_ground * self.water.transmission(away))[:, 0], veil[:, 0]

    def seen(self, pose: Standpoint, place: Vector, lights: Sequence[Beam] = ()) -> Look:
        """How a body near the ground looks from the camera (see glider.draw); `place` is NED, m from the camera."""
        depth, (daylight, aperture) = max(pose.depth, SHALLOWEST), self._lit(pose, lights)
        lit = daylight(depth + pose.height)
        if lights:
            lit = lit + aperture * water_optics.rgb(*lamps.on_body(lights, place, self.water.attenuation))
        glow = self._glow(np.array([[_sine(place)]], dtype=np.float32), daylight(depth))

        def look(reflected: Floats, distance: Floats) -> Floats:
            left, veil = self.water.transmission(distance), self.water.veil(distance)
            return water_optics.encode(reflected * lit * left + glow * veil)

        return look

    def shown(self, pose: Standpoint, lights: Sequence[Beam] = ()) -> Floats:
        """The share of green light from the ground that is the sun's, by distance (m) from 0 to REACH."""
        depth, (daylight, aperture) = max(pose.depth, SHALLOWEST), self._lit(pose, lights)
        away = np.arange(REACH, dtype=np.float32)[np.newaxis]
        sand = float(self.bottom_colours[1, 0, water_optics.SUMS // 2])
        lit, lamp = float(daylight(depth + pose.height)[1, 0, 0]), 0.0
        if lights:
            below = np.array([[[0.0]], [[0.0]], [[pose.height]]])
            lamp = aperture * float(self._lamplight(below, lights)[1, 0, 0])
        ground = sand * (lit + lamp) * self.water.transmission(away)[1, 0]
        veil = (self._glow(np.full_like(away, -0.7), daylight(depth)) * self.water.veil(away))[1, 0]
        return (ground / (ground + veil + 1e-9) * (lit / (lit + lamp + 1e-9))).astype(np.float32)

    def afloat(self, pose: Standpoint, points: Floats, lights: Sequence[Beam] = ()) -> Floats:
        """Linear light (3, n) of white flakes in the water at points (3, n; m, NED from the camera)."""
        depth, (daylight, aperture) = max(pose.depth, SHALLOWEST), self._lit(pose, lights)
        away, lit = np.sqrt(np.sum(points**2, axis=0))[np.newaxis], daylight(depth)
        for beam in lights:
            lit = lit + aperture * beam.reach(points, self.water.attenuation.ravel())[0][:, np.newaxis]
        veil = self._glow(-points[2] / away, daylight(depth)) * self.water.veil(away)
        return (FLAKE * lit * self.water.transmission(away) + veil)[:, 0]

    def veil(self, pose: Standpoint, turn: NDArray[np.float64], width: int, lights: Sequence[Beam]) -> Floats:
        """Light of lamps (3, width, width) that the water throws back into a face (see lamps.veil)."""
        water, (_, aperture) = self.water, self._lit(pose, lights)
        return aperture * lamps.veil(
            lights, turn, width, pose.height, water.attenuation.ravel(), water.backward.ravel()
        )

    def _lit(self, pose: Standpoint, lights: Sequence[Beam] = ()) -> tuple[Callable[[Any], Floats], float]:
        """Light by depth (m) for a camera that does not burn out bright sand, and what one lux counts for it.

        Bright sand is that straight below, and, where there are lamps, all around, behind the glare of the water.
        """
        depth = max(pose.depth, SHALLOWEST)
        at_camera = self.lux * math.exp(-min(float(self.water.extinction[1, 0, 0]) * depth, 80.0))
        sensitive = min(1.0, at_camera / water_optics.DARKEST)
        on_bottom, around = (sensitive * self.water.daylight(d, depth) for d in (depth + pose.height, depth))
        points = GRID * pose.height if lights else np.array([[0.0], [0.0], [pose.height]])
        away = np.sqrt(np.sum(points**2, axis=0))[np.newaxis].astype(np.float32)
        lux = 1.0 / max(at_camera, water_optics.DARKEST)
        if lights:
            on_bottom = on_bottom + lux * self._lamplight(points[:, np.newaxis], lights)
        bright = self.bottom_colours[..., water_optics.BRIGHT, np.newaxis] * on_bottom * self.water.transmission(away)
        bright += self._glow(np.array([[-1.0]], dtype=np.float32), around) * self.water.veil(away)
        if lights:
            bright += lux * self._glare(points / away, pose.height, lights)[:, np.newaxis]
        aperture = min(1.0, water_optics.WHITE / max(float(bright.max()), 1e-9))
        return lambda d: aperture * sensitive * self.water.daylight(d, depth), aperture * lux

    def _glare(self, rays: Floats, height: float, lights: Sequence[Beam]) -> Floats:
        return lamps.glare(lights, rays, height, self.water.attenuation.ravel(), self.water.backward.ravel())

    def _lamplight(self, points: Floats, lights: Sequence[Beam]) -> Floats:
        return lamps.on_ground(lights, points, self.water.attenuation.ravel())

    def _shade(
        self,
        height: float,
        on_bottom: Floats,
        around: Floats,
        aperture: float,
        lights: Sequence[Beam],
        points: Floats,
        tones: NDArray[Any],
    ) -> NDArray[np.uint32]:
        """RGBA words (n, m) of the bottom at points (3, n, m; m, NED from the camera) by its sum of tones (n, m)."""
        away = np.sqrt(np.sum(points**2, axis=0)).astype(np.float32)
        lit = on_bottom + aperture * self._lamplight(points, lights).astype(np.float32)
        linear = self.bottom_colours[:, 0][:, tones] * lit * self.water.transmission(away)
        veil = self._glow(-height / away, around) * self.water.veil(away)
        return water_optics.rgba_words(linear, veil).reshape(tones.shape)

    def _glow(self, sine: Floats, around: Floats) -> Floats:
        return water_optics.sideways(self.water.glow * around, sine)

    def _palette(
        self, colours: Floats, side: int, distance: float, around: Floats, rows: int = water_optics.ROWS
    ) -> NDArray[np.uint32]:
        sines = water_optics.sines()[:rows]
        away = distance / sines
        veil = self._glow(-side * sines, around) * self.water.veil(away)
        return water_optics.rgba_words(colours * self.water.transmission(away), veil)


class SeaSurface:
    """A wind sea below, sky and clouds above."""

    visibility = 20e3

    def __init__(self, visibility: float, seed: int, waves: Waves, sun: Sun, water: str = ""):
        self.air = water_optics.air(visibility)
        self.sun, self.lit = sun.towards, min(1.0, sun.lux / water_optics.DARKEST)
        swell, sky = procedural_textures.in_air(seed)
        self.sea = Layer(swell, 0.045, 0.4, 1.2), Layer(swell, 0.31, 0.75, 3.4)
        self.sky = Layer(sky, 3.0, 0.2, 6.0), Layer(sky, 11.0, 1.3, 6.0)
        self.sea_colours = water_optics.sea(waves.roughness)
        self.sky_words = water_optics.rgba_words(self._hazy(water_optics.clouds(), CLOUDS))

    def planes(self, pose: Standpoint, lights: Sequence[Beam] = ()) -> tuple[Plane, Plane]:
        """The planes below and above the camera; lamps do not shine so far."""
        sea = water_optics.rgba_words(self._hazy(self.sea_colours, pose.height))
        return Plane(1, pose.height, self.sea, sea), Plane(-1, CLOUDS, self.sky, self.sky_words)

    def seen(self, pose: Standpoint, place: Vector, lights: Sequence[Beam] = ()) -> Look:
        """How a body near the surface looks from the camera (see glider.draw)."""

        def look(reflected: Floats, distance: Floats) -> Floats:
            left = self.air.transmission(distance)
            return water_optics.encode(self.lit * (reflected * left + self.air.glow * (1 - left)))

        return look

    def _hazy(self, colours: Floats, distance: float) -> Floats:
        left = self.air.transmission(distance / water_optics.sines())
        return self.lit * (colours * left + self.air.glow * (1 - left))


def _sine(place: Vector) -> float:
    """Of the elevation of a place (NED)."""
    return -place[2] / math.hypot(*place) if any(place) else -1.0


Surroundings = Seabed | SeaSurface
SCENES: tuple[str, ...] = ("Seabed", "Sea Surface")


def surroundings(
    scene: str,
    visibility: float,
    seed: int,
    waves: Waves | None = None,
    sun: Sun | None = None,
    water: str = "",
) -> Surroundings:
    """The scene of this name; `visibility` in m, 0 for the default of the scene; `seed` is that of its textures.

    Of Jerlov's types of water, `water` is one, which has a visibility of its own.
    """
    kind = Seabed if scene == "Seabed" else SeaSurface
    return kind(visibility or kind.visibility, seed, waves or Waves(), sun or Sun(), water)
