"""Seamless procedural textures of sand, water and clouds, and pyramids of coarser and coarser copies."""

import math
from collections.abc import Callable
from typing import Any

import numpy as np
from numpy.random import Generator
from numpy.typing import NDArray

Floats = NDArray[np.floating[Any]]

SIZE = 1024
WIDE = 2048  # size of the textures that repeat last
TONES = 64  # texture values are 0 to TONES - 1
BENDS = 256  # texels by which a texture can shift another one
STEEPEST = 9  # cycles per side of the longest waves of sand: those that shifts of its texture make unrecognizable


def pyramid(texture: Floats) -> NDArray[np.uint8]:
    """(n, 2n) tones: `texture` (n, n), 0 to 1, on the left, to its right copies of half the size each."""
    return _pyramid(texture, TONES, np.uint8)


def bending_pyramid(texture: Floats, bends: Floats) -> NDArray[np.uint16]:
    """A pyramid of tones and, times TONES, of shifts (n, n) of another texture in its texels, 0 to BENDS."""
    return _pyramid(texture, TONES, np.uint16) + TONES * _pyramid(bends / BENDS, BENDS, np.uint16)


def _pyramid(texture: Floats, steps: int, kind: type[Any]) -> NDArray[Any]:
    size = texture.shape[0]
    levels = np.zeros((size, 2 * size), dtype=kind)
    column, level = 0, texture
    while True:
        width = level.shape[0]
        levels[:width, column : column + width] = np.clip(level * steps, 0, steps - 1).astype(kind)
        if width == 1:
            return levels
        column += width
        level = 0.25 * (level[::2, ::2] + level[1::2, ::2] + level[::2, 1::2] + level[1::2, 1::2])


def sand(random: Generator) -> Floats:
    """Ripples that wind and fork, over rough ground, lit from one side."""
    winding = noise(random, lambda f, _: f**-1.9)
    ground = noise(random, lambda f, _: f**-1.6 * (f > STEEPEST))
    grain = noise(random, lambda f, _: np.minimum(f, 200.0) ** -0.4 * (f > STEEPEST))
    down, across = np.meshgrid(*(np.arange(SIZE, dtype=np.float32) * np.float32(math.tau / SIZE),) * 2, indexing="ij")
    phase = 34 * across + 11 * down + 5.5 * winding
    ripple = np.abs(np.sin(phase / 2 + 0.3 * np.sin(phase))) * np.clip(1.0 + 0.25 * ground, 0.2, 1.6)
    lit = ripple - np.roll(ripple, 2, axis=1)
    return _tones(0.5 + 0.16 * (ripple - 0.6) + 0.55 * lit + 0.05 * ground + 0.07 * grain)


def patches(random: Generator) -> Floats:
    """(WIDE, WIDE) light and dark ground, meters across."""
    return _tones(0.5 + 0.16 * wide_noise(random, 256, lambda f: f**-1.5))


def bends(random: Generator, spread: float) -> Floats:
    """(WIDE, WIDE) smooth shifts about BENDS / 2, with a standard deviation of `spread` texels."""
    return BENDS / 2 + spread * wide_noise(random, 32, lambda f: (f > 14).astype(np.float32))


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


def wide_noise(random: Generator, finest: int, spectrum: Callable[[Floats], Floats]) -> Floats:
    """(WIDE, WIDE) seamless Gaussian noise of mean 0 and variance 1 with at most `finest` cycles per side."""
    numbers = random.standard_normal((2, 2 * finest, finest + 1), dtype=np.float32)
    rows = np.fft.fftfreq(2 * finest, 0.5 / finest).astype(np.float32)
    frequency = np.hypot(rows[:, np.newaxis], np.arange(finest + 1, dtype=np.float32))
    shaped = (numbers[0] + 1j * numbers[1]) * np.where(
        (frequency >= 1) & (frequency <= finest), spectrum(np.maximum(frequency, 1.0)), np.float32(0.0)
    )
    padded = np.zeros((WIDE, WIDE // 2 + 1), dtype=np.complex64)
    padded[:finest, : finest + 1], padded[-finest:, : finest + 1] = shaped[:finest], shaped[finest:]
    field = np.fft.irfft2(padded, s=(WIDE, WIDE))
    return (field / field.std()).astype(np.float32)


def _tones(texture: Floats) -> Floats:
    return np.clip(texture, 0.0, 1.0).astype(np.float32)
