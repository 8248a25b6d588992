"""Caustics: lines of light on the bottom, where waves of the surface focus the sun."""

import math
from typing import Any
from zlib import crc32

import numpy as np
from numpy.random import PCG64, Generator, SeedSequence
from numpy.typing import NDArray

from world.rendering import procedural_textures
from world.rendering.cube_faces import Window
from world.rendering.light.scene_colors import OpticalMedium
from world.sea import SeaState
from world.sun import Sun

Floats = NDArray[np.floating[Any]]

SIDE, TEXELS = 8.0, 512  # m that a net covers before it repeats, and the texels across
TEXEL = SIDE / TEXELS
LONGEST, SHORTEST = 4, 36  # cycles per side of the waves that make the net: 2 m to 0.22 m long
BENT = 0.7  # root mean square of what they stretch and squeeze the light
NETS = ((0.3, 0.55), (2.4, 0.4))  # heading (rad) and speed (m/s) of the nets whose product is the light
FOCUS = 1.0  # m, depth at which the light is most uneven, in waves of the usual height
UNEVEN = 0.6  # standard deviation of the light there, by its mean
ALMOST_STRAIGHT = 0.5  # share of scattered light that is treated as unscattered
CLEAR, AIR = 0.85, 0.1  # share of daylight straight from the zenith, and optical thickness of the air
REACH, SHALLOWEST = 200.0, 0.2  # m: how far, and how deep from on, ground that is not level is lit up
STEEPEST, LEAST = 0.05, 0.004  # sine of the lowest rays, and contrast, that are worth drawing
SHIFT = np.uint16(6)
UNIT = np.uint16(1 << 6)  # factors of pixels are in 64ths, so that products fit into 16 bits
FOUR = np.uint64(0x0001000100010001)  # repeats a number of 16 bits for the channels of a pixel
BRIGHTEST = np.float32(15.5)  # times the mean light
FAR = 1 << 16  # texels; keeps places positive, so that truncation rounds down


class Caustics:
    """The light of a sun on the bottom of a sea in `water`, by its mean; `strength` is 1 for a sky without clouds."""

    def __init__(self, strength: float, waves: SeaState, sun: Sun, water: OpticalMedium, seed: int = 0):
        sine = math.sin(sun.elevation)
        straight = CLEAR * math.exp(-AIR / sine) if sine > 0.01 else 0.0
        self._strength = strength * straight if waves.height else 0.0
        self._focus = FOCUS / waves.roughness
        # Beyond what all light loses with depth, that from one direction loses what is scattered out of it.
        beam, fall = float(water.attenuation[1, 0, 0]), float(water.extinction[1, 0, 0])
        self._loss = ALMOST_STRAIGHT * max(0.0, beam * sun.path_factor_under_water - fall)
        self._net = caustic_texture(Generator(PCG64(SeedSequence([seed, crc32(b"caustics")])))).ravel()

    def contrast(self, depth: Any) -> Any:
        """Standard deviation of the light at a depth (m), by its mean: 0 at the surface, most at the focus."""
        at = np.maximum(depth, 0.0) / self._focus
        return UNEVEN * self._strength * 2.0 * at / (1.0 + at * at) * np.exp(-self._loss * at * self._focus)

    def intensity(self, north: Any, east: Any, depth: Any, time: float) -> Floats:
        """The light at places (m north, east of the world's origin; depth) and a time (s), by its mean."""
        return np.maximum(1.0 + self.contrast(depth) * self._pattern(north, east, (0.0, 0.0), time), 0.0)

    def apply(
        self,
        face: NDArray[np.uint8],
        turn: NDArray[np.float64],
        window: Window,
        axis: Floats,
        place: tuple[float, float, float, float],
        time: float,
        shown: Floats,
        near: Floats | None = None,
    ) -> None:
        """Light up the ground in a window of a face (w, w, 4) whose frame `turn` rotates to NED; `axis` is pixel_axis.

        `place` is north, east, depth and height above the ground of the camera (m); `shown` is the share of what it
        sees that comes from the ground, by distance in steps of 1 m. Two by two pixels get the same light.
        With `near` (w, w), 1 over the distance along the face's axis, the ground is not level.
        """
        north, east, depth, height = place
        contrast = float(self.contrast(depth + height))
        if contrast < LEAST and near is None:
            return
        rows, columns = (slice(*ends) for ends in window)
        y, x = (axis[ends][::2] + (axis[1] - axis[0]) / 2 if len(axis) > 1 else axis[ends] for ends in (rows, columns))
        n, e, down = (a * x + (b * y[:, np.newaxis] + c) for a, b, c in turn.astype(np.float32).tolist())
        length = np.sqrt(x * x + (y * y)[:, np.newaxis] + np.float32(1.0))
        sine = down / length
        if not sine.size or (near is None and float(sine.max()) <= STEEPEST):
            return
        lit = sine > STEEPEST
        scale = np.float32(height) / np.maximum(down, np.float32(STEEPEST))
        if near is not None:
            scale = np.float32(1.0) / np.maximum(near[rows, columns][::2, ::2], np.float32(1.0 / REACH))
            ground = np.float32(depth) + down * scale
            lit, contrast, sine = ground > SHALLOWEST, self.contrast(ground), np.abs(sine)
        away: Floats = scale * length
        step: NDArray[np.int64] = away.astype(np.int64)
        blur = away * np.float32(2.0 / len(axis) / TEXEL / 6.0) / np.maximum(sine, np.float32(STEEPEST))
        share: Floats = shown.take(step, mode="clip") / (np.float32(1.0) + blur * blur)
        uneven = self._pattern(n * scale, e * scale, (north, east), time) * np.asarray(contrast, np.float32)
        share *= uneven
        share += np.float32(1.0)
        gain = np.where(lit, np.sqrt(np.clip(share, np.float32(0.05), BRIGHTEST)), np.float32(1.0))
        part = face[rows, columns]
        pairs = np.repeat((gain * UNIT + 0.5).astype(np.uint64) * FOUR, 2, axis=1)
        factors = pairs.view(np.uint16)[:, : 4 * part.shape[1]]
        for start in (0, 1):
            lines = part[start::2].reshape(-1, factors.shape[1])
            bright = lines * factors[: len(lines)]
            bright += UNIT // 2
            bright >>= SHIFT
            most = np.negative((bright > 255).view(np.uint8))  # 255 where it is more: NumPy is slow in taking the least
            part[start::2] = (bright.astype(np.uint8) | most).reshape(-1, part.shape[1], 4)
        part[..., 3] = 255

    def _pattern(self, north: Any, east: Any, origin: tuple[float, float], time: float) -> Floats:
        """Light less its mean, with a standard deviation of 1, at places from an origin (m)."""
        found: Any = 1.0
        for heading, speed in NETS:
            c, s = math.cos(heading) / TEXEL, math.sin(heading) / TEXEL
            ahead = (origin[0] * c + origin[1] * s - speed * time / TEXEL) % TEXELS + FAR
            aside = (origin[1] * c - origin[0] * s) % TEXELS + FAR
            row, column = north * c + east * s + ahead, east * c - north * s + aside
            row, column = (np.asarray(each).astype(np.int32) & (TEXELS - 1) for each in (row, column))
            found = found * self._net.take(row * TEXELS + column, mode="clip")
        return found - np.float32(1.0)


def caustic_texture(random: Generator) -> NDArray[np.float32]:
    """(TEXELS, TEXELS) seamless lines of light with a mean of 1, so uneven that the product of two deviates by 1.

    Rays that fall evenly are bent by the slopes of waves, and counted where they arrive.
    """
    f, _ = procedural_textures.noise_frequencies()
    height = procedural_textures.spectral_gaussian_noise(random, f**-2.5 * ((f >= LONGEST) & (f <= SHORTEST)))
    slopes = [0.5 * (np.roll(height, -1, axis) - np.roll(height, 1, axis)) for axis in (0, 1)]
    down, right = (0.5 * (np.roll(s, -1, axis) - np.roll(s, 1, axis)) for axis, s in enumerate(slopes))
    curl = down + right
    size = procedural_textures.SIZE
    rays = np.arange(size, dtype=np.float32)
    bend = BENT / float(np.std(curl))
    row, column = rays[:, np.newaxis] + bend * slopes[0], rays + bend * slopes[1]
    i, j = (np.floor(place * (TEXELS / size)).astype(np.int64) % TEXELS for place in (row, column))
    light = np.bincount((i * TEXELS + j).ravel(), minlength=TEXELS**2).reshape(TEXELS, TEXELS).astype(np.float64)
    for axis in (0, 1):
        light = (light + np.roll(light, 1, axis) + np.roll(light, -1, axis)) / 3.0
    light /= light.mean()
    light = 1.0 + (light - 1.0) * (math.sqrt(math.sqrt(2.0) - 1.0) / light.std())
    return np.maximum(light, 0.0).astype(np.float32)
