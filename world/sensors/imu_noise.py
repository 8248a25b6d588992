"""Noise of inertial sensors after AirSim: white noise and a random walk of the bias."""

import math
from collections.abc import Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING

from support.rotations import Matrix, Vector, to_body

if TYPE_CHECKING:
    from numpy.random import Generator

STANDARD_GRAVITY = 9.80665
SHORTEST_INTERVAL = 1e-3  # s, AirSim's lower limit
VINS_GRAVITY = 9.81007
BLOCK = 256


def specific_force(r: Matrix, acceleration: Vector, gravity: float) -> Vector:
    """What an accelerometer measures (m/s², body): R_nb^T (a_n - g_n); level and at rest (0, 0, -gravity)."""
    north, east, down = acceleration
    return to_body(r, (north, east, down - gravity))


@dataclass(frozen=True, slots=True)
class NoiseDensity:
    """Noise of a sensor in SI units: `white` noise N per √Hz, random `walk` K of the bias per √s.

    Its Allan deviation at τ s is √(N²/τ + K² τ/3) (IEEE Std 952-1997, annex C).
    """

    white: float
    walk: float

    @classmethod
    def from_bias_stability(cls, white: float, stability: float) -> "NoiseDensity":
        """From white noise per √Hz and the in-run bias stability of a data sheet, both in SI units.

        That stability B is the minimum of the Allan deviation, √(2 N K / √3), which is at τ = √3 N / K.
        """
        return cls(white, math.sqrt(3.0) * stability**2 / (2.0 * white))

    @property
    def bias_stability(self) -> float:
        """The minimum of the Allan deviation: what data sheets call in-run bias stability."""
        return math.sqrt(2.0 * self.white * self.walk / math.sqrt(3.0))

    @property
    def settling_time(self) -> float:
        """The time (s) over which that minimum is reached; infinity without a random walk."""
        return math.sqrt(3.0) * self.white / self.walk if self.walk > 0.0 else math.inf

    @classmethod
    def from_gyroscope_datasheet(cls, random_walk: float, bias_stability: float, tau: float) -> "NoiseDensity":
        """From degrees per √h, degrees per h, and s, as AirSim does: its walk is bias stability per √tau."""
        return cls(math.radians(random_walk) / 60.0, math.radians(bias_stability) / 3600.0 / math.sqrt(tau))

    @classmethod
    def from_accelerometer_datasheet(cls, random_walk: float, bias_stability: float, tau: float) -> "NoiseDensity":
        """From mg/√Hz, µg, and s, as AirSim does: its walk is bias stability per √tau."""
        milli = 1e-3 * STANDARD_GRAVITY
        return cls(random_walk * milli, bias_stability * 1e-3 * milli / math.sqrt(tau))

    def sample_sigmas(self, interval: float) -> tuple[float, float]:
        """Standard deviations of the white noise and of the bias step for samples `interval` s apart."""
        root = math.sqrt(interval if interval > SHORTEST_INTERVAL else SHORTEST_INTERVAL)
        return self.white / root, self.walk * root


class NoisyTriad:
    """Three axes of the same kind: `add_noise` adds white noise and the bias before its step."""

    __slots__ = ("_bias", "density")

    def __init__(self, density: NoiseDensity):
        self.density = density
        self._bias = (0.0, 0.0, 0.0)

    def add_noise(self, value: Vector, interval: float, draws: Sequence[float]) -> Vector:
        """`value` with noise from six standard normal `draws`: three for white noise, three for the bias."""
        white, step = self.density.sample_sigmas(interval)
        (x, y, z), (p, q, r), (a, b, c, d, e, f) = self._bias, value, draws
        self._bias = x + step * d, y + step * e, z + step * f
        return p + white * a + x, q + white * b + y, r + white * c + z


class StandardNormals:
    """Endless rows of `count` standard normal numbers, drawn a block at a time."""

    def __init__(self, random: "Generator", count: int):
        self._random = random
        self._count = count
        self._block: list[list[float]] = []
        self._used = 0

    def __iter__(self) -> "StandardNormals":
        return self

    def __next__(self) -> list[float]:
        if self._used == len(self._block):
            self._block, self._used = self._random.standard_normal((BLOCK, self._count)).tolist(), 0
        self._used += 1
        return self._block[self._used - 1]


def vins_parameters(gyroscope: NoiseDensity, accelerometer: NoiseDensity, interval: float) -> str:
    """The noise block of a VINS configuration for samples `interval` s apart, as printed in articles on AirSim.

    The numbers are per sample although VINS expects densities, and the gravity is VINS's, not AirSim's.
    """
    acc_n, acc_w = accelerometer.sample_sigmas(interval)
    gyr_n, gyr_w = gyroscope.sample_sigmas(interval)
    return f"acc_n: {acc_n:.4e}\ngyr_n: {gyr_n:.4e}\nacc_w: {acc_w:.4e}\ngyr_w: {gyr_w:.4e}\ng_norm: {VINS_GRAVITY:.5f}"
