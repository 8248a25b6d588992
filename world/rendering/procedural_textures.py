"""Seamless procedural textures of sand, water and clouds, and pyramids of coarser and coarser copies."""

import math
from collections.abc import Callable
from functools import lru_cache
from typing import Any
from zlib import crc32

import numpy as np
from numpy.random import PCG64, Generator, SeedSequence
from numpy.typing import NDArray

Floats = NDArray[np.floating[Any]]

SIZE = 1024
WIDE = 2048  # size of the textures that repeat last
TONES = 64  # texture values are 0 to TONES - 1
BENDS = 256  # texels by which a texture can shift another one
CHUNK = 32  # rows, or columns, that are treated together: they fit into the L2 cache
STEEPEST = 9  # cycles per side of the longest waves of sand: those that shifts of its texture make unrecognizable


# A quarter of a second each: all cameras of a world, and the runs of a campaign, look at the same.
@lru_cache(maxsize=2)
def underwater_textures(seed: int) -> tuple[NDArray[np.uint8], NDArray[np.uint8], NDArray[np.uint16]]:
    """Pyramids of sand, of the waves above it, and of patches of ground with shifts of the sand; read-only."""
    random = _of(seed, "Seabed")
    fine, swell = tone_pyramid(sand_texture(random)), tone_pyramid(wave_texture(random))
    return (
        _kept(fine),
        _kept(swell),
        _kept(tone_and_shift_pyramid(ground_patches(random), texture_shifts(random, 20.0))),
    )


@lru_cache(maxsize=2)
def wave_and_cloud_textures(seed: int) -> tuple[NDArray[np.uint8], NDArray[np.uint8]]:
    """Pyramids of waves and of clouds; read-only."""
    random = _of(seed, "Sea Surface")
    return _kept(tone_pyramid(wave_texture(random))), _kept(tone_pyramid(cloud_texture(random)))


def _of(seed: int, scene: str) -> Generator:
    return Generator(PCG64(SeedSequence([seed, crc32(scene.encode())])))


def _kept(shared: NDArray[Any]) -> NDArray[Any]:
    shared.setflags(write=False)
    return shared


def tone_pyramid(texture: Floats) -> NDArray[np.uint8]:
    """(n, 2n) tones: `texture` (n, n), 0 to 1, on the left, to its right copies of half the size each."""
    return _pyramid(texture, TONES, TONES, np.uint8)


def tone_and_shift_pyramid(texture: Floats, bends: Floats) -> NDArray[np.uint16]:
    """A pyramid of tones and, times TONES, of shifts (n, n) of another texture in its texels, 0 to BENDS."""
    shifts = _pyramid(bends, 1, BENDS, np.uint16)
    shifts *= TONES
    shifts += _pyramid(texture, TONES, TONES, np.uint16)
    return shifts


def _pyramid(texture: Floats, scale: int, steps: int, kind: type[Any]) -> NDArray[Any]:
    """`scale` times the texture, in whole numbers from 0 to before `steps`."""
    size = texture.shape[0]
    levels = np.zeros((size, 2 * size), dtype=kind)
    column, level = 0, texture
    while True:
        width = level.shape[0]
        for rows in _chunks(width):
            tones = level[rows] * scale
            levels[rows, column : column + width] = np.clip(tones, 0, steps - 1, out=tones)
        if width == 1:
            return levels
        column += width
        level = _halved(level)


def _halved(level: Floats) -> Floats:
    half = np.empty((level.shape[0] // 2, level.shape[1] // 2), level.dtype)
    for start in range(0, len(half), CHUNK):
        out, fine = half[start : start + CHUNK], level[2 * start : 2 * (start + CHUNK)]
        np.add(fine[::2, ::2], fine[1::2, ::2], out=out)
        out += fine[::2, 1::2]
        out += fine[1::2, 1::2]
        out *= 0.25
    return half


def sand_texture(random: Generator) -> Floats:
    """Ripples that wind and fork, over rough ground, lit from one side."""
    f, _ = noise_frequencies()
    winding = spectral_gaussian_noise(random, f**-1.9)
    ground = spectral_gaussian_noise(random, f**-1.6 * (f > STEEPEST))
    grain = spectral_gaussian_noise(random, np.minimum(f, 200.0) ** -0.4 * (f > STEEPEST))
    across = np.arange(SIZE, dtype=np.float32) * np.float32(math.tau / SIZE)
    found = winding
    for rows in _chunks(SIZE):
        phase = 34 * across + 11 * across[rows, np.newaxis] + 5.5 * winding[rows]
        rough = np.clip(1.0 + 0.25 * ground[rows], 0.2, 1.6)
        ripple = np.abs(np.sin(phase / 2 + 0.3 * np.sin(phase))) * rough
        lit = ripple - np.roll(ripple, 2, axis=1)
        found[rows] = 0.5 + 0.16 * (ripple - 0.6) + 0.55 * lit + 0.05 * ground[rows] + 0.07 * grain[rows]
    return _tones(found)


def ground_patches(random: Generator) -> Floats:
    """(WIDE, WIDE) light and dark ground, meters across."""
    field = large_spectral_noise(random, 256, lambda f: f**-1.5)
    field *= 0.16
    field += 0.5
    return _tones(field)


def texture_shifts(random: Generator, spread: float) -> Floats:
    """(WIDE, WIDE) smooth shifts about BENDS / 2, with a standard deviation of `spread` texels."""
    field = large_spectral_noise(random, 32, lambda f: (f > 14).astype(np.float32))
    field *= spread
    field += BENDS / 2
    return field


def wave_texture(random: Generator) -> Floats:
    """Slopes of a wind sea that comes from the left."""
    f, bearing = noise_frequencies()
    slope = spectral_gaussian_noise(random, f**-0.85 * (0.2 + np.cos(bearing) ** 2) * (f > 3))
    return _tones(0.5 + 0.17 * slope)


def cloud_texture(random: Generator) -> Floats:
    """Fair-weather cumulus: 0 in the gaps."""
    f, _ = noise_frequencies()
    return _tones(0.55 * spectral_gaussian_noise(random, f**-1.8 * (f > 3)) - 0.1)


def noise_frequencies() -> tuple[Floats, Floats]:
    """Cycles per side, at least 1, and bearing (rad, 0 to π / 2) of the sines that make up noise, (n + 1, n + 1)."""
    fy, fx = np.meshgrid(np.arange(SIZE // 2 + 1.0), np.arange(SIZE // 2 + 1.0), indexing="ij")
    return np.maximum(np.hypot(fx, fy), 1.0).astype(np.float32), np.arctan2(fy, fx).astype(np.float32)


def spectral_gaussian_noise(random: Generator, amplitude: Floats) -> Floats:
    """(SIZE, SIZE) seamless Gaussian noise of mean 0 and variance 1; `amplitude` is that of `noise_frequencies`.

    It is the same for those that go up and down.
    """
    white, half = random.standard_normal((SIZE, SIZE), dtype=np.float32), SIZE // 2
    weight = np.concatenate((amplitude, amplitude[half - 1 : 0 : -1]))
    weight[0, 0] = 0.0
    waves = np.empty((SIZE, half + 1), dtype=np.complex64)
    # Forward, NumPy (2.4) transforms single precision in double precision, too, but is slow to convert the numbers.
    for rows in _chunks(SIZE):
        waves[rows] = np.fft.rfft(white[rows].astype(np.float64))
    for columns in _chunks(half + 1):
        shaped = np.fft.fft(waves[:, columns].astype(np.complex128), axis=0).astype(np.complex64)
        shaped *= weight[:, columns]
        waves[:, columns] = np.fft.ifft(shaped, axis=0)
    return _normal(np.fft.irfft(waves, n=SIZE))


def large_spectral_noise(random: Generator, finest: int, spectrum: Callable[[Floats], Floats]) -> Floats:
    """(WIDE, WIDE) seamless Gaussian noise of mean 0 and variance 1 with at most `finest` cycles per side."""
    numbers = random.standard_normal((2, 2 * finest, finest + 1), dtype=np.float32)
    rows = np.fft.fftfreq(2 * finest, 0.5 / finest).astype(np.float32)
    frequency = np.hypot(rows[:, np.newaxis], np.arange(finest + 1, dtype=np.float32))
    shaped = (numbers[0] + 1j * numbers[1]) * np.where(
        (frequency >= 1) & (frequency <= finest), spectrum(np.maximum(frequency, 1.0)), np.float32(0.0)
    )
    padded = np.zeros((WIDE, finest + 1), dtype=np.complex64)
    padded[:finest], padded[-finest:] = shaped[:finest], shaped[finest:]
    # Higher frequencies along the rows are zero: those columns need no transform.
    return _normal(np.fft.irfft(np.fft.ifft(padded, axis=0), n=WIDE, axis=1))


def _chunks(count: int) -> list[slice]:
    return [slice(start, min(start + CHUNK, count)) for start in range(0, count, CHUNK)]


def _normal(field: Floats) -> Floats:
    field /= field.std()
    return field


def _tones(texture: Floats) -> Floats:
    return np.clip(texture, 0.0, 1.0, out=texture)
