"""Brightness and color of water, sea surface, sky and seabed: linear light, 0 to 1, color is the first axis."""

import math
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from world.rendering.procedural_textures import TONES
from world.sea import KOSCHMIEDER_CONSTANT, jerlov_colors

Floats = NDArray[np.floating[Any]]

OPAQUE = np.uint32(0xFF000000)
ROWS = 1024  # steps of the sine of the elevation, from the horizon to the nadir or the zenith
SUMS = 2 * TONES  # the tones of two textures are added
BRIGHT = 112  # sum of tones that only one of a hundred places exceeds where the sand is light
DARKEST = 1.0  # lux at which a camera still gets a bright picture
WHITE = 0.95  # linear light that a camera allows such places
DOWNWARD = 0.5  # the glow of water seen straight down
WINDOW = math.cos(math.asin(1 / 1.34))  # cosine of the zenith angle of the rim of Snell's window


def rgb(red: float, green: float, blue: float) -> Floats:
    """(3, 1, 1)"""
    return np.array([red, green, blue], dtype=np.float32)[:, np.newaxis, np.newaxis]


def palette_elevation_sines() -> Floats:
    """(ROWS, 1) sines of the elevation."""
    return ((np.arange(ROWS, dtype=np.float32) + 0.5) / ROWS)[:, np.newaxis]


def palette_texture_tones() -> Floats:
    """(SUMS,) texture from 0 to 1."""
    return np.arange(SUMS, dtype=np.float32) / (SUMS - 2)


@dataclass(frozen=True)
class OpticalMedium:
    """Water or air: `attenuation` along a beam and `extinction` of daylight with depth, in 1/m by color.

    `glow` is the light that an infinite layer of it scatters from the horizon to the camera; it fills in by `filling`.
    """

    attenuation: Floats
    extinction: Floats
    glow: Floats
    filling: Floats

    def daylight(self, depth: Any, exposed_at: float) -> Floats:
        """Light at `depth` m (one or many) for a camera whose exposure is right for green light at `exposed_at` m."""
        brightest = 60.0  # largest exponent: white anyway, and within single precision
        return np.exp(np.minimum(self.extinction[1] * exposed_at - self.extinction * depth, brightest))

    @property
    def backscatter_coefficient(self) -> Floats:
        """(3, 1, 1) 1/m that is scattered backwards: of daylight, a third of its share comes up again (Gordon 1975)."""
        return 3.0 * DOWNWARD * self.glow * self.extinction

    def transmission(self, distance: Floats) -> Floats:
        """(3, n, m) share of the light left after a distance (n, m) in m."""
        return np.exp(-self.attenuation * distance)

    def glow_share_by_distance(self, distance: Floats) -> Floats:
        """(3, n, m) share of the glow between the camera and a distance (n, m) in m."""
        return 1 - np.exp(-self.filling * distance)


def green_water(visibility: float, slant: float = 1.0) -> OpticalMedium:
    """Green coastal water; `visibility` is that of green light, in m. Daylight goes `slant` times the depth."""
    beam = KOSCHMIEDER_CONSTANT / visibility * rgb(1.4, 1.0, 1.08)
    fall = slant * KOSCHMIEDER_CONSTANT / visibility * rgb(0.28, 0.2, 0.23)
    return OpticalMedium(beam, fall, rgb(0.014, 0.115, 0.145), beam)


def jerlov_water(kind: str, slant: float = 1.0) -> OpticalMedium:
    """Water of one of Jerlov's types (see world.sea.jerlov_colors)."""
    direct, veil, daylight, glow = (rgb(*colors) for colors in jerlov_colors(kind))
    return OpticalMedium(direct, slant * daylight, glow / DOWNWARD, veil)


def hazy_air(visibility: float) -> OpticalMedium:
    beam = KOSCHMIEDER_CONSTANT / visibility * rgb(1.0, 1.1, 1.25)
    return OpticalMedium(beam, rgb(0.0, 0.0, 0.0), rgb(0.60, 0.71, 0.80), beam)


def glow_by_elevation(glow: Floats, upward: Floats) -> Floats:
    """(3, n, m) glow of water by the sine of the elevation (n, m): brightest from above."""
    return glow * (DOWNWARD + 1.1 * (0.5 + 0.5 * upward) ** 1.3)


def sand_palette() -> Floats:
    """(3, 1, SUMS) reflectance of sand by texture."""
    dark, bright = rgb(0.17, 0.14, 0.09), rgb(2.9, 2.3, 1.55)
    return dark + (bright - dark) * palette_texture_tones() ** 1.6


def surface_palette_from_below(roughness: float = 1.0) -> Floats:
    """(3, ROWS, SUMS): the sky inside Snell's window, a mirror of the deep outside; waves blur the rim."""
    cosine = palette_elevation_sines() + 0.55 * np.float32(roughness) * (palette_texture_tones() - 0.5)
    inside = np.clip((cosine - WINDOW) / 0.14 + 0.5, 0.0, 1.0)
    inside = inside * inside * (3 - 2 * inside)
    window = rgb(1.15, 1.3, 1.45) * (0.45 + 0.55 * np.clip(cosine, 0.0, 1.0))
    mirror = rgb(0.02, 0.14, 0.16) * (0.75 + 1.1 * palette_texture_tones())
    return mirror + (window - mirror) * inside


def sky_color(sine: Floats) -> Floats:
    """(3, n, m) clear sky by the sine of the elevation (n, m)."""
    horizon, zenith = rgb(0.60, 0.71, 0.80), rgb(0.075, 0.20, 0.50)
    return zenith + (horizon - zenith) * np.exp(-4.0 * sine)


def surface_palette_from_above(roughness: float = 1.0) -> Floats:
    """(3, ROWS, SUMS): the sea from above: mirrored sky (Schlick's Fresnel term), light from below, foam on crests."""
    slope = np.float32(roughness) * (palette_texture_tones() - 0.5)
    cosine = np.clip(0.93 * palette_elevation_sines() + 0.07 + 0.6 * slope, 0.0, 1.0)
    mirrored = 0.02 + 0.70 * (1 - cosine) ** 5
    body = rgb(0.006, 0.055, 0.085) * (1.0 + 1.6 * np.clip(slope + 0.1, 0.0, 1.0))
    foam = np.clip((slope - 0.36) / 0.10, 0.0, 1.0) * 0.7
    colors = body + (sky_color(cosine) - body) * mirrored
    return colors + (0.85 - colors) * foam


def cloud_palette() -> Floats:
    """(3, ROWS, SUMS): clouds in front of the sky."""
    clear = sky_color(palette_elevation_sines())
    cover = np.clip((palette_texture_tones() - 0.08) * 2.4, 0.0, 1.0)
    white = 0.95 - 0.35 * np.clip(palette_texture_tones() * 1.5 - 0.45, 0.0, 1.0)
    return clear + (white - clear) * cover


def gamma_encode(linear: Floats) -> Floats:
    """Linear light to 0..255, with a gamma of 2."""
    return np.sqrt(np.clip(linear, 0.0, 1.0)) * np.float32(255.0)


def add_backscatter(pixels: NDArray[np.uint8], veil: Floats) -> None:
    """Adds linear light (3, n, m) to pixels (n, m, 4)."""
    linear = (pixels[..., :3] / np.float32(255.0)) ** 2 + np.moveaxis(veil, 0, -1)
    pixels[..., :3] = gamma_encode(linear)


def rgba_words(linear: Floats, veil: Floats | None = None) -> NDArray[np.uint32]:
    """Flat RGBA words of (3, n, m) linear light, that of a `veil` (3, n, 1) added. Overwrites `linear`."""
    if veil is not None:
        linear += veil
    np.minimum(linear, 1.0, out=linear)
    np.sqrt(linear, out=linear)
    linear *= np.float32(255.0)
    red, green, blue = linear.astype(np.int32).view(np.uint32)  # NumPy is slower to make numbers without a sign
    green <<= 8
    blue <<= 16
    red |= green
    red |= blue
    red |= OPAQUE
    return red.ravel()
