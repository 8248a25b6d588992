"""Simulates an inertial measurement unit with attitude reference."""

import math

import imc
from runtime import State, Task, consume, param
from world.attitude import Vector, wrap
from world.sensors import (
    STANDARD_GRAVITY,
    BodyMotion,
    InertialSample,
    InertialSampler,
    NoiseDensity,
    NoisyTriad,
    StandardNormals,
    vins_parameters,
)

ARTICLE_INTERVAL = 0.025  # s


class IMU(Task):
    """Measures specific force, angular velocity and attitude, with AirSim's noise model of an MPU-6000.

    Specific force is f = dv/dt + omega x v + R^T (ds/dt - g), with v the velocity through the water, s that of
    the water: at rest it is -g, as an accelerometer measures; the Acceleration of DUNE's simulator is dv/dt alone.
    `Fidelity = Original` publishes the true attitude, as AirSim does, and writes the VINS parameters of the articles on
    AirSim to the log book.
    """

    fidelity: str = param(
        "Physical", "", "Physical, or as in AirSim and articles on it.", choices=("Physical", "Original")
    )
    sampling_rate: float = param(
        100.0, "Hz", "Samples per second; each is the mean since the one before.", minimum=0.1, maximum=1000
    )
    generate_noise: bool = param(True, "", "Add noise to all measurements.")
    angular_random_walk: float = param(0.3, "°/√h", "White noise of the gyroscopes.", minimum=0)
    gyro_bias_stability: float = param(4.6, "°/h", "Walk of the gyroscopes' bias within its time constant.", minimum=0)
    gyro_bias_stability_tau: float = param(500.0, "s", "Time constant of the gyroscopes' bias.", minimum=1e-3)
    velocity_random_walk: float = param(0.24, "mg/√Hz", "White noise of the accelerometers.", minimum=0)
    accel_bias_stability: float = param(36.0, "µg", "Walk of the accelerometers' bias in its time constant.", minimum=0)
    accel_bias_stability_tau: float = param(800.0, "s", "Time constant of the accelerometers' bias.", minimum=1e-3)
    euler_angles_noise: float = param(
        0.05, "°", "Standard deviation of attitude.", minimum=0, aliases=("Standard Deviation - Euler Angles",)
    )
    angular_velocity_noise: float = param(
        0.0, "°/s", "Further white noise of each rate.", name="Standard Deviation - Angular Velocity", minimum=0
    )
    heading_offset: float = param(
        0.0,
        "°",
        "Standard deviation of a constant error of the true heading; the magnetic one has none.",
        name="Standard Deviation - Heading Offset",
        minimum=0,
    )
    gyro_rate_bias: float = param(0.0, "°/h", "Drift of the true heading; the magnetic one has none.")
    gravity: float = param(STANDARD_GRAVITY, "m/s²", "Local gravity.", minimum=0, maximum=100)
    gyro_range: float = param(0.0, "°/s", "Largest rate that is measured; 0 for no limit.", minimum=0)
    accel_range: float = param(0.0, "g", "Largest specific force that is measured; 0 for no limit.", minimum=0)

    dropped = 0

    def configure(self) -> None:
        gyro = NoiseDensity.gyroscope(self.angular_random_walk, self.gyro_bias_stability, self.gyro_bias_stability_tau)
        accel = NoiseDensity.accelerometer(
            self.velocity_random_walk, self.accel_bias_stability, self.accel_bias_stability_tau
        )
        if not hasattr(self, "gyroscope"):
            self.gyroscope, self.accelerometer = NoisyTriad(gyro), NoisyTriad(accel)
        self.gyroscope.density, self.accelerometer.density = gyro, accel
        self._sampler = InertialSampler(self.sampling_rate, self.gravity)

    def start(self) -> None:
        self._normals = StandardNormals(self.random, 15)
        self._rate_normals = StandardNormals(self.random, 3)
        self._offset = math.radians(self.heading_offset) * self.random.standard_normal() if self.heading_offset else 0.0
        self._began = self.now
        self.set_entity_state(State.NORMAL, "active")
        if self.fidelity == "Original":
            densities = self.gyroscope.density, self.accelerometer.density
            self.log.info(vins_parameters(*densities, ARTICLE_INTERVAL))

    @consume
    def measure(self, truth: imc.SimulatedState) -> None:
        motion = BodyMotion.of(truth)
        if not motion.is_finite:
            self.dropped += 1
            self.set_entity_state(State.FAULT, f"SimulatedState is not finite ({self.dropped} dropped)")
            return
        if self.entity.state is State.FAULT:
            self.set_entity_state(State.NORMAL, "active")
        for sample in self._sampler.feed(motion):
            self._report(*self._disturbed(sample))

    def _disturbed(self, sample: InertialSample) -> tuple[float, Vector, Vector, Vector]:
        """A sample's time, angles, rates and force, with noise."""
        angles, rates, force = sample.angles, sample.rates, sample.force
        if not self.generate_noise:
            return sample.time, angles, rates, force
        draws = next(self._normals)
        rates = self.gyroscope.corrupt(rates, sample.interval, draws)
        force = self.accelerometer.corrupt(force, sample.interval, draws[6:])
        if self.fidelity == "Physical":
            sigma = math.radians(self.euler_angles_noise)
            angles = angles[0] + sigma * draws[12], angles[1] + sigma * draws[13], angles[2] + sigma * draws[14]
        if self.angular_velocity_noise:
            sigma, further = math.radians(self.angular_velocity_noise), next(self._rate_normals)
            rates = rates[0] + sigma * further[0], rates[1] + sigma * further[1], rates[2] + sigma * further[2]
        return sample.time, angles, rates, force

    def _report(self, time: float, angles: Vector, rates: Vector, force: Vector) -> None:
        phi, theta, psi = angles
        drift = math.radians(self.gyro_rate_bias) / 3600.0 * (self.now - self._began)
        p, q, r = _clip(rates, math.radians(self.gyro_range))
        x, y, z = _clip(force, self.accel_range * STANDARD_GRAVITY)
        for message in (
            imc.EulerAngles(
                timestamp=time,
                time=time,
                phi=wrap(phi),
                theta=theta,
                psi=wrap(psi + self._offset + drift),
                psi_magnetic=wrap(psi),
            ),
            imc.AngularVelocity(timestamp=time, time=time, x=p, y=q, z=r),
            imc.Acceleration(timestamp=time, time=time, x=x, y=y, z=z),
        ):
            self.publish(message, keep_time=True)


def _clip(value: Vector, limit: float) -> Vector:
    if limit == 0.0:
        return value
    x, y, z = value
    return max(-limit, min(limit, x)), max(-limit, min(limit, y)), max(-limit, min(limit, z))
