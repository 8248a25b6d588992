"""Simulates an inertial measurement unit with attitude reference."""

import math
import re
from collections.abc import Callable, Mapping

import imc
from imc.reserved_ids import UNADDRESSED
from runtime import ParameterError, State, Task, consume, param
from support.rotations import Vector, wrap
from tasks.simulated_world import INVALID_TRUTH, is_valid_truth, mount_pose, position_param
from world.sensors import (
    IMU_PARTS,
    STANDARD_GRAVITY,
    TRIAD_DRAWS,
    BodyMotion,
    ImuPart,
    InertialSample,
    InertialSampler,
    Magnetometer,
    NoiseDensity,
    NoisyTriad,
    StandardNormals,
    TriadErrors,
    TriadGrade,
    vins_parameters,
)

ARTICLE_INTERVAL = 0.025  # s
HALF_SAMPLE = 0.0005  # s, of the highest rate: by which a sample may come early
OWN_VALUES = "Own Values"
GRADE = ("Range", "Resolution", "Scale Error", "Misalignment", "Offset")
OF_PARTS = re.compile(".* Random Walk|(Gyro|Accel) (Bias Stability.*|" + "|".join(GRADE) + ")")
"""The parameters for which a part has values of its own."""


class IMU(Task):
    """Measures specific force, angular velocity and attitude, with AirSim's noise model of an MPU-6000, or as a `Part`.

    Specific force is f = dv/dt + omega x v + R^T (ds/dt - g), with v the velocity through the water, s that of
    the water: at rest it is -g, as an accelerometer measures; the Acceleration of DUNE's simulator is dv/dt alone.
    It feels the motion of its place in the vehicle, along its own axes; attitude and MagneticField are the vehicle's.
    With a `Magnetic Field Strength` it also measures the magnetic field; a MagneticField sent to its entity, the result
    of a calibration, is subtracted from then on. The magnetic heading is that of an ideal compass.
    `Fidelity = Original` publishes the true attitude, as AirSim does, and writes the VINS parameters of the articles on
    AirSim to the log book.
    """

    fidelity: str = param(
        "Physical", "", "Physical, or as in AirSim and articles on it.", choices=("Physical", "Original")
    )
    sampling_rate: float = param(
        100.0, "Hz", "Samples per second; each is the mean since the one before.", minimum=0.1, maximum=1000
    )
    generate_noise: bool = param(
        True, "", "Add noise and the errors of the device to all measurements.", editable=False
    )
    part: str = param(
        OWN_VALUES,
        "",
        "The part whose data sheet gives noise, ranges, resolutions, scale errors and misalignments.",
        choices=(OWN_VALUES, *IMU_PARTS),
        editable=False,
    )
    device_position: list[float] = position_param(
        "Place in the vehicle: forward, right, down of its origin; empty for the origin."
    )
    device_orientation: list[float] = param(
        [], "°", "Roll, pitch and yaw of its axes against the vehicle's; empty for none.", size=(0, 3)
    )
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
        editable=False,
    )
    gyro_rate_bias: float = param(0.0, "°/h", "Drift of the true heading; the magnetic one has none.")
    gravity: float = param(STANDARD_GRAVITY, "m/s²", "Local gravity.", minimum=0, maximum=100)
    gyro_range: float = param(0.0, "°/s", "Largest rate that is measured; 0 for no limit.", minimum=0)
    accel_range: float = param(0.0, "g", "Largest specific force that is measured; 0 for no limit.", minimum=0)
    gyro_resolution: float = param(0.0, "°/s", "Step between two rates in the output; 0 for none.", minimum=0)
    accel_resolution: float = param(0.0, "mg", "Step between two forces in the output; 0 for none.", minimum=0)
    gyro_scale_error: float = param(
        0.0, "%", "Standard deviation of each scale, drawn at the start.", minimum=0, editable=False
    )
    accel_scale_error: float = param(
        0.0, "%", "Standard deviation of each scale, drawn at the start.", minimum=0, editable=False
    )
    gyro_misalignment: float = param(
        0.0,
        "°",
        "Standard deviation of what each axis leans toward each other one.",
        minimum=0,
        maximum=30,
        editable=False,
    )
    accel_misalignment: float = param(
        0.0,
        "°",
        "Standard deviation of what each axis leans toward each other one.",
        minimum=0,
        maximum=30,
        editable=False,
    )
    gyro_offset: float = param(0.0, "°/s", "Standard deviation of the bias at the start.", minimum=0, editable=False)
    accel_offset: float = param(0.0, "mg", "Standard deviation of the bias at the start.", minimum=0, editable=False)

    magnetic_field_strength: float = param(0.0, "G", "Field of the Earth; 0 for no magnetometer.", minimum=0, maximum=1)
    magnetic_declination: float = param(
        0.0, "°", "Of the Earth's field, east of true north.", minimum=-180, maximum=180
    )
    magnetic_inclination: float = param(0.0, "°", "Of the Earth's field, below the horizon.", minimum=-90, maximum=90)
    magnetic_field_noise: float = param(0.5, "mG", "Standard deviation of each axis of the magnetometer.", minimum=0)
    magnetic_field_rate: float = param(
        10.0, "Hz", "Most samples of the magnetometer per second.", minimum=0.1, maximum=1000
    )
    hard_iron: list[float] = param(
        [], "G", "Field of the vehicle: forward, right, down; empty for none.", size=(0, 3), minimum=-5, maximum=5
    )
    soft_iron: list[float] = param(
        [],
        "1",
        "Rows of the matrix by which the vehicle bends the Earth's field; empty for none.",
        size=(0, 9),
        minimum=-5,
        maximum=5,
    )

    dropped: int = 0

    def configure(self) -> None:
        geometry = self.sampling_rate, self.gravity, mount_pose(self.device_position, self.device_orientation)
        self.grade: ImuPart = part_from_values(self._number) if self.part == OWN_VALUES else self._of_part()
        gyro, accel = self.grade.gyroscope.density, self.grade.accelerometer.density
        if not hasattr(self, "gyroscope"):
            self.gyroscope: NoisyTriad = NoisyTriad(gyro)
            self.accelerometer: NoisyTriad = NoisyTriad(accel)
            self.gyro_errors: TriadErrors = TriadErrors()
            self.accel_errors: TriadErrors = TriadErrors()
            self._has_device_errors = False
            self._geometry = None
        self.gyroscope.density, self.accelerometer.density = gyro, accel
        for option, values, size in (("Hard Iron", self.hard_iron, 3), ("Soft Iron", self.soft_iron, 9)):
            if len(values) not in (0, size):
                raise ParameterError(option, f"has {len(values)} numbers instead of {size}")
        self._magnetometer = Magnetometer(
            self.magnetic_field_strength,
            math.radians(self.magnetic_declination),
            math.radians(self.magnetic_inclination),
            self.hard_iron,
            self.soft_iron,
        )
        if geometry != self._geometry:
            self._geometry, self._sampler = geometry, InertialSampler(*geometry)

    def _number(self, name: str) -> float:
        return getattr(self, self.parameters()[name].attribute)

    def _of_part(self) -> ImuPart:
        for name, parameter in self.parameters().items():
            if OF_PARTS.fullmatch(name) and getattr(self, parameter.attribute) != parameter.default:
                raise ParameterError(name, f"Part = {self.part} gives it; leave out one of the two")
        return IMU_PARTS[self.part]

    def start(self) -> None:
        self._normals = StandardNormals(self.random, 15)
        self._rate_normals = StandardNormals(self.random, 3)
        self._magnetic_normals = StandardNormals(self.random.spawn(1)[0], 3)  # leaves the other noise alone
        self._magnetic_due = -math.inf
        self._calibration = (0.0, 0.0, 0.0)  # G
        self._offset = math.radians(self.heading_offset) * self.random.standard_normal() if self.heading_offset else 0.0
        self._began = self.now
        grade = self.grade
        if self.generate_noise and (grade.gyroscope.has_device_errors or grade.accelerometer.has_device_errors):
            self._has_device_errors = True
            self.gyro_errors = TriadErrors.draw(grade.gyroscope, self.random.standard_normal(TRIAD_DRAWS).tolist())
            self.accel_errors = TriadErrors.draw(grade.accelerometer, self.random.standard_normal(TRIAD_DRAWS).tolist())
            self.log.info(f"gyroscopes (rad/s): {self.gyro_errors}; accelerometers (m/s²): {self.accel_errors}")
        self.set_entity_state(State.NORMAL, "active")
        if self.fidelity == "Original":
            densities = self.gyroscope.density, self.accelerometer.density
            self.log.info(vins_parameters(*densities, ARTICLE_INTERVAL))

    @consume
    def measure(self, truth: imc.SimulatedState) -> None:
        if not is_valid_truth(truth):
            self.dropped += 1
            self.set_entity_state(State.FAULT, f"{INVALID_TRUTH} ({self.dropped} dropped)")
            return
        if self.entity.state is State.FAULT:
            self.set_entity_state(State.NORMAL, "active")
        for sample in self._sampler.sample_until_state(BodyMotion.from_state(truth)):
            self._report(*self._disturbed(sample))
            if self.magnetic_field_strength and sample.time >= self._magnetic_due:
                self._report_field(sample)

    def _disturbed(self, sample: InertialSample) -> tuple[float, Vector, Vector, Vector]:
        """A sample's time, angles, rates and force, with noise."""
        angles, rates, force = sample.angles, sample.rates, sample.force
        if not self.generate_noise:
            return sample.time, angles, rates, force
        draws, interval = next(self._normals), sample.interval
        if self._has_device_errors:
            rates, force = self.gyro_errors.apply(rates), self.accel_errors.apply(force)
        rates = self.gyroscope.add_noise(rates, interval, draws[:6])
        force = self.accelerometer.add_noise(force, interval, draws[6:12])
        if self.fidelity == "Physical":
            sigma, (phi, theta, psi), (a, b, c) = math.radians(self.euler_angles_noise), angles, draws[12:]
            angles = phi + sigma * a, theta + sigma * b, psi + sigma * c
        if self.angular_velocity_noise:
            sigma, further = math.radians(self.angular_velocity_noise), next(self._rate_normals)
            rates = rates[0] + sigma * further[0], rates[1] + sigma * further[1], rates[2] + sigma * further[2]
        return sample.time, angles, rates, force

    def _report(self, time: float, angles: Vector, rates: Vector, force: Vector) -> None:
        phi, theta, psi = angles
        wrong = self._offset if self.generate_noise else 0.0
        if self.generate_noise and self.gyro_rate_bias:
            wrong += math.radians(self.gyro_rate_bias) / 3600.0 * (self.now - self._began)
        rates, force = self.grade.gyroscope.quantize(rates), self.grade.accelerometer.quantize(force)
        header = time, *UNADDRESSED
        attitude = imc.EulerAngles(*header, time, wrap(phi), theta, wrap(psi + wrong), wrap(psi))
        self.publish(attitude, keep_time=True)
        self.publish(imc.AngularVelocity(*header, time, *rates), keep_time=True)
        self.publish(imc.Acceleration(*header, time, *force), keep_time=True)

    def _report_field(self, sample: InertialSample) -> None:
        """Publish the magnetic field at the true attitude of a sample."""
        self._magnetic_due = max(self._magnetic_due, sample.time - HALF_SAMPLE) + 1.0 / self.magnetic_field_rate
        field = self._magnetometer.measure(*sample.angles)
        if self.generate_noise and self.magnetic_field_noise:
            sigma, draws = self.magnetic_field_noise / 1000.0, next(self._magnetic_normals)
            field = tuple(part + sigma * draw for part, draw in zip(field, draws, strict=True))
        x, y, z = (part - own for part, own in zip(field, self._calibration, strict=True))
        self.publish(imc.MagneticField(timestamp=sample.time, time=sample.time, x=x, y=y, z=z), keep_time=True)

    @consume
    def calibrate(self, found: imc.MagneticField) -> None:
        """Subtract the vehicle's own field that a calibration has found in what was measured."""
        field = found.x, found.y, found.z
        if found.dst_ent != self.entity.id or found.src_ent == self.entity.id or not all(map(math.isfinite, field)):
            return
        x, y, z = (before + now for before, now in zip(self._calibration, field, strict=True))
        self._calibration = x, y, z
        self.log.info(f"subtracts {x:.4f} G ahead, {y:.4f} G to starboard, {z:.4f} G down from the magnetic field")


def part_from_options(options: Mapping[str, str]) -> ImuPart:
    """The model of an IMU with these options of a profile. Raises ValueError for an option that cannot be read."""
    values = {name: parameter.parse(options.get(name, "")) for name, parameter in IMU.parameters().items()}
    return part_from_values(values.__getitem__) if values["Part"] == OWN_VALUES else IMU_PARTS[values["Part"]]


def part_from_values(number: Callable[[str], float]) -> ImuPart:
    """The model of an IMU with these values of its parameters."""
    density = NoiseDensity.from_gyroscope_datasheet(
        number("Angular Random Walk"), number("Gyro Bias Stability"), number("Gyro Bias Stability Tau")
    )
    gyroscope = TriadGrade.from_gyroscope_datasheet(density, *(number(f"Gyro {name}") for name in GRADE))
    density = NoiseDensity.from_accelerometer_datasheet(
        number("Velocity Random Walk"), number("Accel Bias Stability"), number("Accel Bias Stability Tau")
    )
    return ImuPart(
        gyroscope, TriadGrade.from_accelerometer_datasheet(density, *(number(f"Accel {name}") for name in GRADE))
    )
