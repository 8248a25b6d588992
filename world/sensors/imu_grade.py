"""Errors of three real gyroscopes or accelerometers, and the data sheets of some parts."""

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from types import MappingProxyType

from support.rotations import Vector
from world.sensors.imu_noise import STANDARD_GRAVITY, NoiseDensity

TRIAD_DRAWS = 12  # standard normals that make a device of a grade


@dataclass(frozen=True, slots=True)
class TriadGrade:
    """Errors of all devices of a kind, in SI units (rad/s or m/s²).

    `scale` (1), `misalignment` (rad) and `offset` are standard deviations between devices. Nothing beyond `limit` is
    measured, and all values are multiples of `resolution`; 0 for none.
    """

    density: NoiseDensity
    limit: float = 0.0
    resolution: float = 0.0
    scale: float = 0.0
    misalignment: float = 0.0
    offset: float = 0.0

    @classmethod
    def from_gyroscope_datasheet(
        cls, density: NoiseDensity, limit: float, resolution: float, scale: float, misalignment: float, offset: float
    ) -> "TriadGrade":
        """Grade with limits and errors in °/s, °/s, %, ° and °/s."""
        rate, angle = math.radians(1.0), math.radians(misalignment)
        return cls(density, limit * rate, resolution * rate, scale / 100.0, angle, offset * rate)

    @classmethod
    def from_accelerometer_datasheet(
        cls, density: NoiseDensity, limit: float, resolution: float, scale: float, misalignment: float, offset: float
    ) -> "TriadGrade":
        """Grade with limits and errors in g, mg, %, ° and mg."""
        milli, angle = 1e-3 * STANDARD_GRAVITY, math.radians(misalignment)
        return cls(density, limit * STANDARD_GRAVITY, resolution * milli, scale / 100.0, angle, offset * milli)

    @property
    def has_device_errors(self) -> bool:
        """Whether devices differ in more than their noise."""
        return max(self.scale, self.misalignment, self.offset) > 0.0

    def quantize(self, value: Vector) -> Vector:
        """A value as the output has it: within the range, and in whole steps."""
        if self.limit <= 0.0 and self.resolution <= 0.0:
            return value
        x, y, z = value
        return self._digit(x), self._digit(y), self._digit(z)

    def _digit(self, value: float) -> float:
        if self.limit > 0.0:
            value = max(-self.limit, min(self.limit, value))
        return round(value / self.resolution) * self.resolution if self.resolution > 0.0 else value


@dataclass(frozen=True, slots=True)
class TriadErrors:
    """The constant errors of one device: its output without noise is `matrix` times the true value, plus `offset`."""

    matrix: tuple[Vector, Vector, Vector] = ((1.0, 0.0, 0.0), (0.0, 1.0, 0.0), (0.0, 0.0, 1.0))
    offset: Vector = (0.0, 0.0, 0.0)

    @classmethod
    def draw(cls, grade: TriadGrade, draws: Sequence[float]) -> "TriadErrors":
        """One of a grade, from TRIAD_DRAWS standard normals: three for scale, six for misalignment, three for offset.

        Each axis leans toward each other one by an angle of its own, to first order.
        """
        s, m, o = grade.scale, grade.misalignment, grade.offset
        return cls(
            (
                (1.0 + s * draws[0], m * draws[3], m * draws[4]),
                (m * draws[5], 1.0 + s * draws[1], m * draws[6]),
                (m * draws[7], m * draws[8], 1.0 + s * draws[2]),
            ),
            (o * draws[9], o * draws[10], o * draws[11]),
        )

    def apply(self, true: Vector) -> Vector:
        x, y, z = true
        (a, b, c), (d, e, f), (g, h, i) = self.matrix
        u, v, w = self.offset
        return a * x + b * y + c * z + u, d * x + e * y + f * z + v, g * x + h * y + i * z + w

    def __str__(self) -> str:
        scale = ", ".join(f"{100.0 * (row[axis] - 1.0):+.3g}" for axis, row in enumerate(self.matrix))
        lean = [value for axis, row in enumerate(self.matrix) for other, value in enumerate(row) if other != axis]
        offset = ", ".join(f"{value:+.3g}" for value in self.offset)
        largest = math.degrees(max(map(abs, lean)))
        text = f"scale {scale} %, axes off by up to {largest:.2g}°"
        return f"{text}, offset {offset}" if any(self.offset) else text


@dataclass(frozen=True, slots=True)
class ImuPart:
    """An inertial measurement unit that can be bought: its data sheet's typical values; what it gives as limits is 3 σ.

    The in-run bias stability of a data sheet is the minimum of the Allan deviation; the bias wanders as that needs with
    the white noise of the sheet, within bounds (`NoiseDensity.from_bias_stability`). Where a sheet lacks the figure
    (MPU-6000, accelerometers of the BMI088), it is AirSim's. Offsets count as calibrated before use.
    """

    gyroscope: TriadGrade
    accelerometer: TriadGrade


def _gyroscope(random_walk: float, stability: float) -> NoiseDensity:
    """Noise density from °/√h and °/h."""
    return NoiseDensity.from_bias_stability(math.radians(random_walk) / 60.0, math.radians(stability) / 3600.0)


def _accelerometer(density: float, stability: float) -> NoiseDensity:
    """Noise density from mg/√Hz and µg."""
    milli = 1e-3 * STANDARD_GRAVITY
    return NoiseDensity.from_bias_stability(density * milli, stability * 1e-3 * milli)


IMU_PARTS: Mapping[str, ImuPart] = MappingProxyType(
    {
        # InvenSense PS-MPU-6000A rev. 3.4, at ±2000 °/s and ±16 g; 0.005 °/s/√Hz are 0.3 °/√h
        "MPU-6000": ImuPart(
            TriadGrade.from_gyroscope_datasheet(_gyroscope(0.3, 4.6), 2000.0, 1 / 16.4, 1.0, 0.38, 0.0),
            TriadGrade.from_accelerometer_datasheet(_accelerometer(0.4, 36.0), 16.0, 1000 / 2048, 1.0, 0.38, 0.0),
        ),
        # Analog Devices ADIS16448 rev. D, at ±1000 °/s and ±18 g; 0.11 m/s/√h are 0.187 mg/√Hz (its noise density at
        # 25 Hz, 0.23 mg/√Hz, is higher, and that of the rate, 0.0135 °/s/√Hz, too)
        "ADIS16448": ImuPart(
            TriadGrade.from_gyroscope_datasheet(_gyroscope(0.66, 14.5), 1000.0, 0.04, 0.33, 0.05, 0.0),
            TriadGrade.from_accelerometer_datasheet(_accelerometer(0.187, 250.0), 18.0, 0.833, 0.33, 0.2, 0.0),
        ),
        # Bosch BST-BMI088-DS001 rev. 1.4, at ±2000 °/s and ±24 g; 0.014 °/s/√Hz are 0.84 °/√h; 2 °/h is the "less than"
        # of Bosch's description of the product, since the tables of the sheet have no stability
        "BMI088": ImuPart(
            TriadGrade.from_gyroscope_datasheet(_gyroscope(0.84, 2.0), 2000.0, 1 / 16.384, 0.33, 0.19, 0.0),
            TriadGrade.from_accelerometer_datasheet(_accelerometer(0.175, 36.0), 24.0, 1000 / 1365, 0.13, 0.1, 0.0),
        ),
    }
)
