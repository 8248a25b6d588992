"""Accelerometers and gyroscopes of a quadrotor."""

import math
from typing import Any

import numpy as np

from support.pose import Pose
from support.rotations import Vector, rotation, to_body
from world.notebook.quadrotor import Column, QuadrotorState, triple
from world.notebook.sensor import Sensor
from world.sensors import (
    IMU_PARTS,
    STANDARD_GRAVITY,
    TRIAD_DRAWS,
    BodyMotion,
    InertialSample,
    InertialSampler,
    NoiseDensity,
    NoisyTriad,
    StandardNormals,
    TriadErrors,
    TriadGrade,
    specific_force,
)

STILL: Vector = (0.0, 0.0, 0.0)
BEARD = "beard"
DENSITIES = {
    "airsim": (
        NoiseDensity.from_gyroscope_datasheet(0.3, 4.6, 500.0),
        NoiseDensity.from_accelerometer_datasheet(0.24, 36.0, 800.0),
    ),
    BEARD: (NoiseDensity(math.radians(0.13), 0.0), NoiseDensity(0.0025 * STANDARD_GRAVITY, 0.0)),
    "ideal": (NoiseDensity(0.0, 0.0), NoiseDensity(0.0, 0.0)),
}


class Inertial(Sensor):
    """Common part of accelerometer and gyroscope: means over the time since the last reading, and noise.

    `part` is "airsim" (the noise of AirSim's IMU), "beard" (that of Beard and McLain, Small Unmanned Aircraft, 2012,
    appendix H, which is per reading), "ideal", or one of world.sensors.PARTS, with all errors of a device. The sensor
    sits at `t` (m, body), its axes turned by `angles` (rad; roll, pitch, yaw). The first reading is that of even
    motion. Raises ValueError.
    """

    def __init__(self, name: str, part: str, t: Any, angles: Any, gravity: float, seed: int):
        super().__init__(name, seed=seed)
        if part not in (*DENSITIES, *IMU_PARTS):
            raise ValueError(f"part {part!r} is not one of {', '.join((*DENSITIES, *IMU_PARTS))}")
        self.part: str = part
        self.gravity: float = gravity
        self._mount = Pose(*triple(t, "t"), *triple(angles, "angles"))
        self._last: BodyMotion | None = None

    def _begin(self, grade: TriadGrade) -> None:
        self._grade, self._triad, self._device = grade, NoisyTriad(grade.density), TriadErrors()
        if grade.has_device_errors:
            self._device = TriadErrors.draw(grade, self.random.standard_normal(TRIAD_DRAWS).tolist())
        self._normals = StandardNormals(self.random, 6)

    def _sample(self, quad: QuadrotorState, n: int, Ts: float) -> InertialSample:
        """Motion since the last reading. Raises ValueError for a step without length."""
        if not 0.0 < Ts < math.inf:
            raise ValueError(f"steps of {Ts:g} s have no length")
        rates, angles = triple(getattr(quad, "omega", STILL), "omega"), triple(quad.Phi, "Phi")
        motion = BodyMotion(n * Ts, angles, rates, triple(quad.v, "v"), STILL)
        last, self._last = self._last, motion
        if last is not None and motion.time > last.time:
            sampler = InertialSampler(1.0 / (motion.time - last.time), self.gravity, self._mount)
            if samples := [*sampler.sample_until_state(last), *sampler.sample_until_state(motion)]:
                return samples[0]
        axes, force = self._mount.rotation, specific_force(rotation(*angles), STILL, self.gravity)
        return InertialSample(motion.time, Ts, angles, to_body(axes, rates), to_body(axes, force))

    def _disturbed(self, value: Vector, interval: float) -> Column:
        if self.part == BEARD:
            per_density, _ = NoiseDensity(1.0, 0.0).sample_sigmas(interval)
            self._triad.density = NoiseDensity(self._grade.density.white / per_density, 0.0)
        noisy = self._triad.add_noise(self._device.apply(value), interval, next(self._normals))
        return np.array([self._grade.quantize(noisy)]).T


class Accelerometer(Inertial):
    """Measures the specific force dv/dt + omega x v - R^T g (m/s², (3, 1)): level and at rest (0, 0, -gravity)."""

    def __init__(
        self,
        part: str = "airsim",
        *,
        name: str = "Accelerometer",
        t: Any = STILL,
        angles: Any = STILL,
        gravity: float = STANDARD_GRAVITY,
        seed: int = 0,
    ):
        super().__init__(name, part, t, angles, gravity, seed)
        self._begin(IMU_PARTS[part].accelerometer if part in IMU_PARTS else TriadGrade(DENSITIES[part][1]))

    def read(self, quad: QuadrotorState, n: int, Ts: float) -> Column:
        sample = self._sample(quad, n, Ts)
        return self._disturbed(sample.force, sample.interval)


class RateGyro(Inertial):
    """Measures the rates p, q, r (rad/s, (3, 1))."""

    def __init__(
        self,
        part: str = "airsim",
        *,
        name: str = "Rate Gyro",
        angles: Any = STILL,
        seed: int = 0,
    ):
        super().__init__(name, part, STILL, angles, STANDARD_GRAVITY, seed)
        self._begin(IMU_PARTS[part].gyroscope if part in IMU_PARTS else TriadGrade(DENSITIES[part][0]))

    def read(self, quad: QuadrotorState, n: int, Ts: float) -> Column:
        sample = self._sample(quad, n, Ts)
        return self._disturbed(sample.rates, sample.interval)
