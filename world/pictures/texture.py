"""Seamless procedural textures of sand, water and clouds, and pyramids of coarser and coarser copies."""

import math
from collections.abc import Callable
from typing import Any

import numpy as np
from numpy.random import Generator
from numpy.typing import NDArray

Floats = NDArray[np.floating[Any]]

SIZE = 1024
LEVELS = SIZE.bit_length()
TONES = 64  # texture values are 0 to TONES - 1
STRIDE = 2 * SIZE


def pyramid(texture: Floats) -> NDArray[np.uint8]:
    """(SIZE, STRIDE) tones: `texture` (SIZE, SIZE), 0 to 1, on the left, to its right copies of half the size each."""
    levels = np.zeros((SIZE, STRIDE), dtype=np.uint8)
    column, level = 0, texture
    while True:
        width = level.shape[0]
        levels[:width, column : column + width] = np.clip(level * TONES, 0, TONES - 1).astype(np.uint8)
        if width == 1:
            return levels
        column += width
        level = level.reshape(width // 2, 2, width // 2, 2).mean(axis=(1, 3))


def level_offset(level: NDArray[np.int32]) -> NDArray[np.int32]:
    """Column at which a level begins in its pyramid."""
    return STRIDE - (STRIDE >> level)


def sand(random: Generator) -> Floats:
    """Ripples that wind and fork, over rough ground, lit from one side."""
    winding = noise(random, lambda f, _: f**-1.9)
    ground = noise(random, lambda f, _: f**-1.6)
    grain = noise(random, lambda f, _: np.minimum(f, 200.0) ** -0.4)
    down, across = np.meshgrid(*(np.arange(SIZE, dtype=np.float32) * np.float32(math.tau / SIZE),) * 2, indexing="ij")
    phase = 34 * across + 11 * down + 5.5 * winding
    ripple = np.abs(np.sin(phase / 2 + 0.3 * np.sin(phase))) * np.clip(1.0 + 0.35 * ground, 0.2, 1.6)
    lit = ripple - np.roll(ripple, 2, axis=1)
    return _tones(0.5 + 0.16 * (ripple - 0.6) + 0.55 * lit + 0.05 * ground + 0.07 * grain)


def patches(random: Generator) -> Floats:
    """Light and dark ground, meters across."""
    return _tones(0.5 + 0.16 * noise(random, lambda f, _: f**-1.5))


def waves(random: Generator) -> Floats:
    """Slopes of a wind sea that comes from the left."""
    slope = noise(random, lambda f, bearing: f**-0.85 * (0.2 + np.cos(bearing) ** 2) * (f > 3))
    return _tones(0.5 + 0.17 * slope)


def clouds(random: Generator) -> Floats:
    """Fair-weather cumulus: 0 in the gaps."""
    return _tones(np.clip(0.55 * noise(random, lambda f, _: f**-1.8 * (f > 3)) - 0.1, 0.0, 1.0))


def noise(random: Generator, spectrum: Callable[[Floats, Floats], Floats]) -> Floats:
    """(SIZE, SIZE) seamless Gaussian noise of mean 0 and variance 1.

    `spectrum(f, bearing)` is its amplitude at f cycles per side, f >= 1, in a direction in rad.
    """
    white = np.fft.rfft2(random.standard_normal((SIZE, SIZE), dtype=np.float32))
    fy, fx = np.meshgrid(np.fft.fftfreq(SIZE, 1 / SIZE), np.fft.rfftfreq(SIZE, 1 / SIZE), indexing="ij")
    frequency = np.maximum(np.hypot(fx, fy), 1.0).astype(np.float32)
    shaped = white * spectrum(frequency, np.arctan2(fy, fx).astype(np.float32))
    shaped[0, 0] = 0.0
    field = np.fft.irfft2(shaped, s=(SIZE, SIZE))
    return (field / field.std()).astype(np.float32)


def _tones(texture: Floats) -> Floats:
    return np.clip(texture, 0.0, 1.0).astype(np.float32)
