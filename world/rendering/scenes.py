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
from world.rendering.light import lamps, scene_colors
from world.rendering.light.lamps import LampBeam
from world.rendering.textured_planes import TexturedPlane, TextureLayer
from world.sea import SeaState
from world.sun import Sun

Floats = NDArray[np.floating[Any]]

CLOUDS = 900.0  # height of the clouds, m
Appearance = Callable[[Floats, Floats], Floats]  # from reflectances and distances to 0..255
REACH = 64  # m, to which caustics are seen
FLAKE = 0.6  # reflectance of marine snow
SHALLOWEST = 1e-3  # m below the surface; nearer or above it, a view under water is that from there


SHADE = 0.4  # share of the daylight that comes from all sides
LOWEST = 0.05  # sine of the elevation of a sun that lights slopes


# Places on the ground (3, n) for a camera at a height of 1, as far as five times that.
_away, _bearing = (a.ravel() for a in np.meshgrid(np.linspace(0.0, 6.0, 13), np.linspace(0.0, math.tau, 17)))
GRID = np.stack([_away * np.cos(_bearing), _away * np.sin(_bearing), np.ones_like(_away)])


@dataclass(frozen=True)
class ScenePose:
    """Pose of a vehicle: m north and east of the scene's origin, Euler angles of body to NED in rad.

    `height` is m above the seabed or the sea surface, `depth` m below the sea surface; over soundings they must agree.
    `time` in s moves the waves.
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
        """Pose in north, east and down of the world."""
        return Pose(self.north, self.east, self.depth, self.roll, self.pitch, self.yaw)

    def at_mount(self, mount: Pose) -> "ScenePose":
        """Pose of a sensor, by its place in the vehicle; angles stay those of the vehicle."""
        if mount.position == (0.0, 0.0, 0.0):
            return self
        north, east, down = to_ned(self.pose.rotation, mount.position)
        return replace(
            self,
            north=self.north + north,
            east=self.east + east,
            height=self.height - down,
            depth=self.depth + down,
        )


class SeabedScene:
    """Rippled sand below, the waves of the sea surface above, and water in between."""

    visibility: float = 20.0

    def __init__(self, visibility: float, seed: int, waves: SeaState, sun: Sun, water: str = ""):
        self.water: scene_colors.OpticalMedium = (
            scene_colors.jerlov_water(water, sun.path_factor_under_water)
            if water
            else scene_colors.green_water(visibility, sun.path_factor_under_water)
        )
        self.sun: Vector = sun.direction_under_water
        self.lux: float = sun.lux
        sand, swell, ground = procedural_textures.underwater_textures(seed)
        self.bottom_layers: tuple[TextureLayer, TextureLayer] = (
            TextureLayer(ground, 0.0625, 1.1),
            TextureLayer(sand, 0.012, 0.3),
        )
        self.surface_layers: tuple[TextureLayer, TextureLayer] = (
            TextureLayer(swell, 0.02, 0.5, 0.7),
            TextureLayer(swell, 0.083, 0.9, 1.6),
        )
        self.bottom_colors: Floats = scene_colors.sand_palette()
        self.surface_colors: Floats = scene_colors.surface_palette_from_below(waves.roughness)

    def planes(self, pose: ScenePose, lights: Sequence[LampBeam] = ()) -> tuple[TexturedPlane, TexturedPlane]:
        """The planes below and above the camera, also by the light of lamps."""
        depth, (lit, aperture) = max(pose.depth, SHALLOWEST), self._lit(pose, lights)
        on_bottom, on_top, around = (lit(d) for d in (depth + pose.height, 0.0, depth))
        sand = self._palette(self.bottom_colors * on_bottom, 1, pose.height, around)
        shade = partial(self._shade, pose.height, on_bottom, around, aperture, lights) if lights else None
        return (
            TexturedPlane(1, pose.height, self.bottom_layers, sand, shade),
            TexturedPlane(
                -1, depth, self.surface_layers, self._palette(self.surface_colors * on_top, -1, depth, around)
            ),
        )

    def surface_plane(self, pose: ScenePose, lights: Sequence[LampBeam] = (), highest: float = 1.0) -> TexturedPlane:
        """The plane above the camera, for rays up to an elevation whose sine is `highest`."""
        depth, (lit, _) = max(pose.depth, SHALLOWEST), self._lit(pose, lights)
        seen = min(scene_colors.ROWS, max(1, math.ceil(highest * scene_colors.ROWS)))
        words = np.zeros((scene_colors.ROWS, scene_colors.SUMS), dtype=np.uint32)
        palette = self._palette(self.surface_colors[:, :seen] * lit(0.0), -1, depth, lit(depth), seen)
        words[:seen] = palette.reshape(seen, -1)
        return TexturedPlane(-1, depth, self.surface_layers, words.ravel())

    def daylight_share_by_normal(self, north: Any, east: Any, up: Any) -> Any:
        """Daylight on what looks to a direction (unit vectors, one or many), as share of that on level ground."""
        sun = self.sun
        if sun[2] > -LOWEST:
            return SHADE + (1.0 - SHADE) * up
        return SHADE + (1.0 - SHADE) * np.clip((north * sun[0] + east * sun[1] - up * sun[2]) / -sun[2], 0.0, 2.0)

    def ground_and_veil_light(
        self, pose: ScenePose, lights: Sequence[LampBeam], points: Floats, facing: Any
    ) -> tuple[Floats, Floats]:
        """Light of white ground in the camera, and of the water before it: (3, n) by color, linear light.

        The ground is at points (3, n; m, NED from the camera); `facing` (n,) is its share of daylight.
        """
        depth, (lit, aperture) = max(pose.depth, SHALLOWEST), self._lit(pose, lights)
        away = np.sqrt(np.sum(points**2, axis=0))[np.newaxis]
        on_ground = lit(np.maximum(depth + points[2:], 0.0)) * facing
        if lights:
            on_ground = on_ground + aperture * self._lamplight(points[:, np.newaxis], lights)
        veil = self._glow(-points[2] / away, lit(depth)) * self.water.glow_share_by_distance(away)
        return (on_ground * self.water.transmission(away))[:, 0], veil[:, 0]

    def body_appearance(self, pose: ScenePose, place: Vector, lights: Sequence[LampBeam] = ()) -> Appearance:
        """Appearance of a body near the ground from the camera (see draw_glider); `place` is NED, m from the camera."""
        depth, (daylight, aperture) = max(pose.depth, SHALLOWEST), self._lit(pose, lights)
        lit = daylight(depth + pose.height)
        if lights:
            lit = lit + aperture * scene_colors.rgb(*lamps.body_illuminance(lights, place, self.water.attenuation))
        glow = self._glow(np.array([[_sine(place)]], dtype=np.float32), daylight(depth))

        def look(reflected: Floats, distance: Floats) -> Floats:
            left, veil = self.water.transmission(distance), self.water.glow_share_by_distance(distance)
            return scene_colors.gamma_encode(reflected * lit * left + glow * veil)

        return look

    def ground_sunlight_share(self, pose: ScenePose, lights: Sequence[LampBeam] = ()) -> Floats:
        """The share of green light from the ground that is the sun's, by distance (m) from 0 to REACH."""
        depth, (daylight, aperture) = max(pose.depth, SHALLOWEST), self._lit(pose, lights)
        away = np.arange(REACH, dtype=np.float32)[np.newaxis]
        sand = float(self.bottom_colors[1, 0, scene_colors.SUMS // 2])
        lit, lamp = float(daylight(depth + pose.height)[1, 0, 0]), 0.0
        if lights:
            below = np.array([[[0.0]], [[0.0]], [[pose.height]]])
            lamp = aperture * float(self._lamplight(below, lights)[1, 0, 0])
        ground = sand * (lit + lamp) * self.water.transmission(away)[1, 0]
        veil = (self._glow(np.full_like(away, -0.7), daylight(depth)) * self.water.glow_share_by_distance(away))[1, 0]
        return (ground / (ground + veil + 1e-9) * (lit / (lit + lamp + 1e-9))).astype(np.float32)

    def flake_light(self, pose: ScenePose, points: Floats, lights: Sequence[LampBeam] = ()) -> Floats:
        """Linear light (3, n) of white flakes in the water at points (3, n; m, NED from the camera)."""
        depth, (daylight, aperture) = max(pose.depth, SHALLOWEST), self._lit(pose, lights)
        away, lit = np.sqrt(np.sum(points**2, axis=0))[np.newaxis], daylight(depth)
        for beam in lights:
            lit = lit + aperture * beam.illuminance(points, self.water.attenuation.ravel())[0][:, np.newaxis]
        veil = self._glow(-points[2] / away, daylight(depth)) * self.water.glow_share_by_distance(away)
        return (FLAKE * lit * self.water.transmission(away) + veil)[:, 0]

    def lamp_backscatter(
        self, pose: ScenePose, turn: NDArray[np.float64], width: int, lights: Sequence[LampBeam]
    ) -> Floats:
        """Light of lamps (3, width, width) that the water throws back into a face (see lamps.face_backscatter)."""
        water, (_, aperture) = self.water, self._lit(pose, lights)
        return aperture * lamps.face_backscatter(
            lights, turn, width, pose.height, water.attenuation.ravel(), water.backscatter_coefficient.ravel()
        )

    def _lit(self, pose: ScenePose, lights: Sequence[LampBeam] = ()) -> tuple[Callable[[Any], Floats], float]:
        """Light by depth (m) for a camera that does not burn out bright sand, and what one lux counts for it.

        Bright sand is that straight below, and, where there are lamps, all around, behind the glare of the water.
        """
        depth = max(pose.depth, SHALLOWEST)
        at_camera = self.lux * math.exp(-min(float(self.water.extinction[1, 0, 0]) * depth, 80.0))
        sensitive = min(1.0, at_camera / scene_colors.DARKEST)
        on_bottom, around = (sensitive * self.water.daylight(d, depth) for d in (depth + pose.height, depth))
        points = GRID * pose.height if lights else np.array([[0.0], [0.0], [pose.height]])
        away = np.sqrt(np.sum(points**2, axis=0))[np.newaxis].astype(np.float32)
        lux = 1.0 / max(at_camera, scene_colors.DARKEST)
        if lights:
            on_bottom = on_bottom + lux * self._lamplight(points[:, np.newaxis], lights)
        bright = self.bottom_colors[..., scene_colors.BRIGHT, np.newaxis] * on_bottom * self.water.transmission(away)
        bright += self._glow(np.array([[-1.0]], dtype=np.float32), around) * self.water.glow_share_by_distance(away)
        if lights:
            bright += lux * self._glare(points / away, pose.height, lights)[:, np.newaxis]
        aperture = min(1.0, scene_colors.WHITE / max(float(bright.max()), 1e-9))
        return lambda d: aperture * sensitive * self.water.daylight(d, depth), aperture * lux

    def _glare(self, rays: Floats, height: float, lights: Sequence[LampBeam]) -> Floats:
        return lamps.backscatter(
            lights, rays, height, self.water.attenuation.ravel(), self.water.backscatter_coefficient.ravel()
        )

    def _lamplight(self, points: Floats, lights: Sequence[LampBeam]) -> Floats:
        return lamps.ground_illuminance(lights, points, self.water.attenuation.ravel())

    def _shade(
        self,
        height: float,
        on_bottom: Floats,
        around: Floats,
        aperture: float,
        lights: Sequence[LampBeam],
        points: Floats,
        tones: NDArray[Any],
    ) -> NDArray[np.uint32]:
        """RGBA words (n, m) of the bottom at points (3, n, m; m, NED from the camera) by its sum of tones (n, m)."""
        away = np.sqrt(np.sum(points**2, axis=0)).astype(np.float32)
        lit = on_bottom + aperture * self._lamplight(points, lights).astype(np.float32)
        linear = self.bottom_colors[:, 0][:, tones] * lit * self.water.transmission(away)
        veil = self._glow(-height / away, around) * self.water.glow_share_by_distance(away)
        return scene_colors.rgba_words(linear, veil).reshape(tones.shape)

    def _glow(self, sine: Floats, around: Floats) -> Floats:
        return scene_colors.glow_by_elevation(self.water.glow * around, sine)

    def _palette(
        self, colors: Floats, side: int, distance: float, around: Floats, rows: int = scene_colors.ROWS
    ) -> NDArray[np.uint32]:
        sines = scene_colors.palette_elevation_sines()[:rows]
        away = distance / sines
        veil = self._glow(-side * sines, around) * self.water.glow_share_by_distance(away)
        return scene_colors.rgba_words(colors * self.water.transmission(away), veil)


class SeaSurfaceScene:
    """A wind sea below, sky and clouds above."""

    visibility: float = 20e3

    def __init__(self, visibility: float, seed: int, waves: SeaState, sun: Sun, water: str = ""):
        self.air: scene_colors.OpticalMedium = scene_colors.hazy_air(visibility)
        self.sun: Vector = sun.direction
        self.brightness: float = min(1.0, sun.lux / scene_colors.DARKEST)
        swell, sky = procedural_textures.wave_and_cloud_textures(seed)
        self.sea_layers: tuple[TextureLayer, TextureLayer] = (
            TextureLayer(swell, 0.045, 0.4, 1.2),
            TextureLayer(swell, 0.31, 0.75, 3.4),
        )
        self.sky_layers: tuple[TextureLayer, TextureLayer] = (
            TextureLayer(sky, 3.0, 0.2, 6.0),
            TextureLayer(sky, 11.0, 1.3, 6.0),
        )
        self.sea_colors: Floats = scene_colors.surface_palette_from_above(waves.roughness)
        self.sky_words: NDArray[np.uint32] = scene_colors.rgba_words(self._hazy(scene_colors.cloud_palette(), CLOUDS))

    def planes(self, pose: ScenePose, lights: Sequence[LampBeam] = ()) -> tuple[TexturedPlane, TexturedPlane]:
        """The planes below and above the camera; lamps do not shine so far."""
        sea = scene_colors.rgba_words(self._hazy(self.sea_colors, pose.height))
        return TexturedPlane(1, pose.height, self.sea_layers, sea), TexturedPlane(
            -1, CLOUDS, self.sky_layers, self.sky_words
        )

    def body_appearance(self, pose: ScenePose, place: Vector, lights: Sequence[LampBeam] = ()) -> Appearance:
        """Appearance of a body near the surface from the camera (see glider.draw_glider)."""

        def look(reflected: Floats, distance: Floats) -> Floats:
            left = self.air.transmission(distance)
            return scene_colors.gamma_encode(self.brightness * (reflected * left + self.air.glow * (1 - left)))

        return look

    def _hazy(self, colors: Floats, distance: float) -> Floats:
        left = self.air.transmission(distance / scene_colors.palette_elevation_sines())
        return self.brightness * (colors * left + self.air.glow * (1 - left))


def _sine(place: Vector) -> float:
    """Sine of the elevation of a place (NED)."""
    return -place[2] / math.hypot(*place) if any(place) else -1.0


Scene = SeabedScene | SeaSurfaceScene
SCENES: tuple[str, ...] = ("Seabed", "Sea Surface")


def make_scene(
    scene: str,
    visibility: float,
    seed: int,
    waves: SeaState | None = None,
    sun: Sun | None = None,
    water: str = "",
) -> Scene:
    """The scene of this name; `visibility` in m, 0 for the default of the scene; `seed` is that of its textures.

    Of Jerlov's types of water, `water` is one, which has a visibility of its own.
    """
    kind = SeabedScene if scene == "Seabed" else SeaSurfaceScene
    return kind(visibility or kind.visibility, seed, waves or SeaState(), sun or Sun(), water)
