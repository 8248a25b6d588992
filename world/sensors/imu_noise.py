"""Noise of inertial sensors: white noise, and a bias that walks, as in AirSim, or wanders within bounds."""

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
MEMORY = 3.0  # of the bias of a bought part, in times of the minimum of its Allan deviation


def specific_force(r: Matrix, acceleration: Vector, gravity: float) -> Vector:
    """Specific force at an accelerometer (m/s², body): R_nb^T (a_n - g_n); level and at rest (0, 0, -gravity)."""
    north, east, down = acceleration
    return to_body(r, (north, east, down - gravity))


@dataclass(frozen=True, slots=True)
class NoiseDensity:
    """Noise of a sensor in SI units: `white` noise N per √Hz, and a bias driven by white noise `walk` K per √s.

    The bias is a random walk, or with a finite `memory` T (s) a first-order Gauss-Markov process, db/dt = -b/T + K w,
    whose standard deviation grows to K √(T/2) and no further. Its Allan variance at τ s is N²/τ + K² τ/3, or with T
    N²/τ + (K T)²/τ (1 - T/(2τ) (3 - 4 exp(-τ/T) + exp(-2τ/T))) (IEEE Std 952-1997, annex C.1).
    """

    white: float
    walk: float
    memory: float = math.inf

    @classmethod
    def from_bias_stability(cls, white: float, stability: float) -> "NoiseDensity":
        """Noise with white noise per √Hz and the in-run bias stability of a data sheet, both in SI units.

        That stability B is the minimum of the Allan deviation, here at τ = T/3. Up to 5 τ the deviation stays within
        15 %, like the flicker noise of a real device, and the bias stays within a standard deviation of 1.8 B.
        """
        if stability == 0.0:
            return cls(white, 0.0)
        ratio, memory = _ratios_of_a_minimum(1.0 / MEMORY)
        return cls(white, ratio * stability**2 / white, memory * (white / stability) ** 2)

    @property
    def bias_sigma(self) -> float:
        """The standard deviation to which that of the bias grows; infinity for a random walk."""
        return self.walk * math.sqrt(0.5 * self.memory)

    @property
    def settling_time(self) -> float:
        """The time (s) of the minimum of the Allan deviation; infinity without a walk."""
        if math.isfinite(self.memory):
            return self.memory / MEMORY
        return math.sqrt(3.0) * self.white / self.walk if self.walk > 0.0 else math.inf

    @property
    def equivalent_walk(self) -> float:
        """The walk per √s of a random walk with the same minimum, √(2 N K / √3), for filters without a memory."""
        if not math.isfinite(self.memory):
            return self.walk
        return math.sqrt(3.0) / 2.0 * self.allan_deviation(self.settling_time) ** 2 / self.white

    def allan_deviation(self, tau: float) -> float:
        """The Allan deviation over `tau` s."""
        if math.isfinite(self.memory):
            wander = self.walk**2 * self.memory * _allan_variance_of_wander(tau / self.memory)
        else:
            wander = self.walk**2 * tau / 3.0
        return math.sqrt(self.white**2 / tau + wander)

    @classmethod
    def from_gyroscope_datasheet(cls, random_walk: float, bias_stability: float, tau: float) -> "NoiseDensity":
        """Noise from degrees per √h, degrees per h, and s, as in AirSim: its walk is bias stability per √tau."""
        return cls(math.radians(random_walk) / 60.0, math.radians(bias_stability) / 3600.0 / math.sqrt(tau))

    @classmethod
    def from_accelerometer_datasheet(cls, random_walk: float, bias_stability: float, tau: float) -> "NoiseDensity":
        """Noise from mg/√Hz, µg, and s, as in AirSim: its walk is bias stability per √tau."""
        milli = 1e-3 * STANDARD_GRAVITY
        return cls(random_walk * milli, bias_stability * 1e-3 * milli / math.sqrt(tau))

    def sample_sigmas(self, interval: float) -> tuple[float, float]:
        """Standard deviations of the white noise and of the bias step for samples `interval` s apart."""
        root = math.sqrt(interval if interval > SHORTEST_INTERVAL else SHORTEST_INTERVAL)
        if math.isfinite(self.memory):  # of the exact discrete process; it is walk * root for short intervals
            return self.white / root, self.bias_sigma * math.sqrt(-math.expm1(-2.0 * root * root / self.memory))
        return self.white / root, self.walk * root

    def share_kept(self, interval: float) -> float:
        """The share of the bias that is left after `interval` s."""
        return math.exp(-max(interval, SHORTEST_INTERVAL) / self.memory)


def _allan_variance_of_wander(x: float) -> float:
    """The Allan variance of a Gauss-Markov process over x = τ/T, divided by K² T."""
    return (1.0 - (3.0 - 4.0 * math.exp(-x) + math.exp(-2.0 * x)) / (2.0 * x)) / x


def _ratios_of_a_minimum(x: float) -> tuple[float, float]:
    """K N/B² and T B²/N² of a noise whose Allan deviation has its minimum B at x = τ/T."""
    variance = _allan_variance_of_wander(x)
    one, two = math.exp(-x), math.exp(-2.0 * x)
    slope = (3.0 - 4.0 * one + two - x * (1.0 + 2.0 * one - two)) / x**3
    memory = 1.0 / x + variance / (x * x * slope)  # B² = N²/(T x) + K² T variance, where (N / (K T))² = x² slope
    return 1.0 / (x * math.sqrt(slope) * memory), memory


class NoisyTriad:
    """Three axes of the same kind: `add_noise` adds white noise and the bias before its step."""

    __slots__ = ("_bias", "density")

    def __init__(self, density: NoiseDensity):
        self.density: NoiseDensity = density
        self._bias = (0.0, 0.0, 0.0)

    def add_noise(self, value: Vector, interval: float, draws: Sequence[float]) -> Vector:
        """`value` with noise from six standard normal `draws`: three for white noise, three for the bias."""
        density, (x, y, z), (p, q, r), (a, b, c, d, e, f) = self.density, self._bias, value, draws
        white, step = density.sample_sigmas(interval)
        if density.memory == math.inf:
            self._bias = x + step * d, y + step * e, z + step * f
        else:
            kept = density.share_kept(interval)
            self._bias = kept * x + step * d, kept * y + step * e, kept * z + step * f
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
