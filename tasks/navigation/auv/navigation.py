"""Estimates where an underwater vehicle is and how it moves."""

import math
from dataclasses import fields, replace

import imc
from autonomy.navigation import (
    EAST,
    NORTH,
    SensorChecks,
    SensorInputs,
    UnderwaterEstimator,
    UnderwaterSettings,
    estimated_state,
    initial_state,
    navigation_data,
    navigation_uncertainty,
)
from runtime import State, Task, consume, param, periodic

OLDEST = 1.0  # s, of a measurement when it arrives on a computer that is late
SETTINGS = tuple(field.name for field in fields(UnderwaterSettings))


class Navigation(Task):
    """Publishes EstimatedState from GPS, DVL, depth sensor, attitude reference, altimeter and tachometer.

    Latitude, longitude and height are those of a reference at the surface, x, y, z the offsets from it; they start
    with the first fix. Before it they are those of a manual fix; without one, nothing is published. Under water the
    position follows from the velocity over ground; without it, from that through the water; without both, from the
    speed of the motor. NavigationUncertainty has variances.
    """

    measurement: list[float] = param(
        [1e-3, 1e-4, 1e-3, 1e-3],
        "1",
        "Variances of surge, sway ((m/s)²), heading (rad²) and its rate ((rad/s)²).",
        name="Measure Noise Covariance",
        size=(4, 5),
    )
    process: list[float] = param(
        [1e-3, 1e-3, 1e-1, 1e-2, 1e-7, 5e-11],
        "1",
        "Variances added per 0.05 s to position, heading, rate, speeds, and biases of rate and heading, in SI units.",
        name="Process Noise Covariance",
        size=6,
    )
    initial: list[float] = param(
        [1000.0, 1.0, 1.0, 1e-4, 1.6e-8],
        "1",
        "Initial variances of position, heading and rate, speeds, biases, and speed per rpm, in SI units.",
        name="State Covariance Initial State",
        size=5,
    )
    speed_variation: float = param(
        6e-4, "m/s/rpm", "Largest deviation of the speed per rpm.", name="Revolutions to speed variation", minimum=0
    )
    speed_drift: float = param(
        1e-12,
        "(m/s/rpm)²",
        "Variance of the speed per rpm added per 0.05 s.",
        name="Revolutions to speed process noise",
        minimum=0,
    )
    farthest: float = param(
        1000.0, "m", "Distance at which the reference is moved.", name="Maximum Distance to Reference", minimum=1
    )
    largest_variance: float = param(
        500.0, "m²", "Largest variance of position.", name="Maximum Horizontal Position Variance", minimum=0
    )
    aborts: bool = param(
        False, "", "Abort if the variance of position exceeds its limit.", name="Abort if Uncertainty Exceeded"
    )
    execution_frequency: float = param(20.0, "Hz", "Rate of EstimatedState.", minimum=1, maximum=100)
    initial_depth: float = param(
        0.0,
        "m",
        "Depth until the first one is measured, of a vehicle that starts under water.",
        minimum=0,
        maximum=11000,
        editable=False,
    )
    depth_variance: float = param(0.0025, "m²", "Variance of depth.", name="Depth Noise Covariance", minimum=1e-9)
    gps_variances: list[float] = param(
        [],
        "m²",
        "Variances of fixes with an accuracy above 10, 8 and 4 m, and better; if empty, those that the fixes claim.",
        name="GPS Noise Covariance",
        size=(0, 4),
    )
    compass: str = param("AHRS", "", "Entity of attitude and rates.", name="Entity Label - Compass")
    dvl: str = param("DVL", "", "Entity of velocities.", name="Entity Label - DVL")
    depth_sensor: str = param("Depth Sensor", "", "Entity of depth.", name="Entity Label - Depth")
    altimeter: str = param(
        "Altimeter", "", "Entity of the distance to the bottom.", name="Entity Label - Altitude - Simulation"
    )
    true_altimeter: str = param(
        "", "", "Altimeter to use instead, if the vehicle has it.", name="Entity Label - Altitude - Hardware"
    )
    altitude_gain: float = param(0.2, "1", "Weight of a new distance.", name="Altitude EMA gain", minimum=0, maximum=1)
    altitude_compensation: bool = param(
        True, "", "Correct distances for roll and pitch.", name="Altitude Attitude Compensation"
    )
    altitude_timeout: float = param(
        5.0, "s", "Time without distance before altitude is unknown.", name="Altitude timeout", minimum=0
    )
    depth_timeout: float = param(5.0, "s", "Time without depth before an error.", name="Depth timeout", minimum=0)
    euler_timeout: float = param(10.0, "s", "Time without attitude before an error.", name="Euler timeout", minimum=0)
    dvl_timeout: float = param(3.0, "s", "Time after which velocities count as missing.", name="DVL timeout", minimum=0)
    dvl_silence: float = param(
        60.0, "s", "Time without any message of the DVL before an error; 0 for never.", name="DVL silence", minimum=0
    )
    dvl_jumps: list[float] = param(
        [1.5, 0.6], "m/s", "Largest change of surge and sway.", name="DVL relative thresholds", size=2
    )
    dvl_jump_window: float = param(
        0.5, "s", "Longest time between compared velocities.", name="DVL relative threshold time window", minimum=0
    )
    dvl_largest: list[float] = param(
        [5.0, 1.5], "m/s", "Largest surge and sway.", name="DVL absolute thresholds", size=2
    )
    speed_per_rpm: float = param(1.015e-3, "m/s/rpm", "Speed per rpm.", name="Revolutions to speed factor")
    dvl_misalignment: float = param(
        0.5,
        "°",
        "Largest pitch between DVL and attitude reference; a slower drift of the depth is not noticed.",
        name="DVL Maximum Misalignment",
        minimum=0,
        maximum=10,
        editable=False,
    )
    dvl_arm: float = param(0.0, "m", "Distance of the DVL ahead of the CG.", name="Distance Between DVL and CG")
    gps_arm: float = param(0.0, "m", "Height of the antenna above the CG.", name="Distance Between GPS and CG")
    gps_factor: float = param(
        1.8,
        "1",
        "Rejects a fix whose accuracy exceeds the mean by this factor.",
        name="GPS Maximum Dynamic HACC factor",
        minimum=1,
    )
    gps_samples: int = param(
        7, "1", "Fixes whose accuracy is averaged.", name="GPS Moving Average Samples", minimum=1, maximum=1000
    )
    gps_deepest: float = param(
        1.0,
        "m",
        "Depth below which the antenna has no reception: a fix is rejected.",
        name="GPS Maximum Depth",
        minimum=0,
    )
    gps_hacc: float = param(20.0, "m", "Worst accepted accuracy of a fix.", name="GPS Maximum HACC", minimum=0)
    gps_hdop: float = param(
        4.0, "1", "Worst accepted HDOP, if accuracy is unknown.", name="GPS Maximum HDOP", minimum=0
    )

    def configure(self) -> None:
        settings = UnderwaterSettings(**{name: getattr(self, name) for name in SETTINGS})
        settings = replace(settings, dvl_misalignment=math.radians(self.dvl_misalignment))
        if hasattr(self, "_inputs"):
            self._inputs.apply_settings(settings)
        else:
            self._inputs = SensorInputs(settings)

    def start(self) -> None:
        fitted = bool(self.dvl) and self.vehicle.entities.find(self.dvl) is not None
        # A vehicle without a DVL does not wait for one.
        self._inputs.restart(self.now_without_stalls if fitted else math.inf)
        self._estimator = UnderwaterEstimator(self._inputs)
        self._checks = SensorChecks(self._inputs, self._estimator, self.log, self.now_without_stalls)
        true = self.true_altimeter
        self._sounder = true if true and self.vehicle.entities.find(true) is not None else self.altimeter
        self._stepped = self.now
        self._converged = False
        self.set_entity_state(State.BOOT, "waiting for GPS fix")

    @consume
    def on_euler_angles(self, angles: imc.EulerAngles) -> None:
        if self.is_from(angles, self.compass):
            self._inputs.receive_attitude(self.now_without_stalls, angles.phi, angles.theta, angles.psi)

    @consume
    def on_angular_velocity(self, rates: imc.AngularVelocity) -> None:
        if self.is_from(rates, self.compass):
            self._inputs.receive_rates(self.now_without_stalls, rates.x, rates.y, rates.z)

    @consume
    def on_depth(self, depth: imc.Depth) -> None:
        if self.is_from(depth, self.depth_sensor):
            self._inputs.receive_depth(self.now_without_stalls, depth.value, self._time_of_measurement(depth))

    @consume
    def on_distance(self, distance: imc.Distance) -> None:
        if distance.validity == imc.Distance.Validity.VALID and self.is_from(distance, self._sounder):
            self._inputs.receive_distance(self.now_without_stalls, distance.value)

    @consume
    def on_rpm(self, rpm: imc.Rpm) -> None:
        self._inputs.receive_rpm(self.now_without_stalls, rpm.value)

    @consume
    def on_velocity(self, velocity: imc.GroundVelocity | imc.WaterVelocity) -> None:
        if self.is_from(velocity, self.dvl):
            measured = self._time_of_measurement(velocity)
            rejection = self._inputs.receive_velocity(self.now_without_stalls, velocity, measured)
            if rejection is not None:
                self.publish(rejection)

    def _time_of_measurement(self, message: imc.Message) -> float:
        """Time at which a sensor measured (s since 1970): by its own clock, unless that contradicts this one."""
        return message.timestamp if 0.0 <= self.age(message.timestamp) <= OLDEST else self.now

    @consume
    def on_activation_state(self, activation: imc.EntityActivationState) -> None:
        if self.dvl and self.is_from(activation, self.dvl):
            active = activation.state == imc.EntityActivationState.State.ACTIVE
            self._inputs.receive_dvl_activation(self.now_without_stalls, active)

    @consume
    def screen_gps_fix(self, fix: imc.GpsFix) -> None:
        rejection = self._inputs.receive_fix(fix)
        if rejection is not None:
            self.publish(rejection)

    @periodic(1.0)
    def publish_alignment_and_stream(self) -> None:
        """Publish once a second what changes slowly."""
        if report := self._inputs.impossible.report(self.now):
            self.log.warning(report)
        self.publish(imc.AlignmentState(state=imc.AlignmentState.State.NOT_SUPPORTED))
        if self._estimator.stream is not None:
            north, east, down = self._estimator.stream
            self.publish(imc.EstimatedStreamVelocity(x=north, y=east, z=down))

    def skip_comparison(self) -> None:
        """Compare no measurement with those before: a simulation has set the vehicle to another depth."""
        self._checks.resume(math.inf)

    @periodic("execution_frequency")
    def estimate(self) -> None:
        now, inputs, estimator, checks = self.now_without_stalls, self._inputs, self._estimator, self._checks
        dt, self._stepped = self.now - self._stepped, self.now
        if self.recent_stall:
            checks.resume(self.recent_stall)
        estimator.vertical.predict(dt)
        new_rates, new_attitude = inputs.rates.update(), checks.update_attitude(now)
        checks.update_depth(now, dt)
        fix, inputs.fix = inputs.fix, None
        if fix is not None:
            submerged = checks.is_submerged()
            if submerged:
                self.publish(imc.GpsFixRejection(utc_time=fix.utc_time, reason=imc.GpsFixRejection.Reason.INVALID))
            fix = fix if checks.evaluate_fix(now, fix, submerged) else None
        inputs.expire_altitude(now)
        if estimator.position is None and fix is not None:
            inputs.place = fix
            if checks.attitude_time > -math.inf:
                estimator.begin(fix)
        elif estimator.position is not None:
            checks.update_velocity_fault(now)
            estimator.advance(estimator.position, now, dt, new_attitude, new_rates)
            if fix is not None:
                decision = estimator.correct(estimator.position, now, fix)
                checks.check_position_reset(now, estimator.position, decision)
        self._publish_state()
        self._update_entity_state()

    def _publish_state(self) -> None:
        inputs, estimator = self._inputs, self._estimator
        vertical, position, angles, rates = (
            estimator.vertical,
            estimator.position,
            inputs.euler.value,
            inputs.rates.value,
        )
        if position is None:
            if inputs.place is not None:
                self.publish(initial_state(inputs.place, vertical, angles, rates, inputs.altitude))
            return
        state = estimated_state(position, vertical, angles, rates, estimator.heave, inputs.altitude)
        self.publish(state)
        self.publish(navigation_uncertainty(position, vertical, self._checks.depth_error_bound, self.measurement))
        self.publish(navigation_data(position, state))

    def _update_entity_state(self) -> None:
        position, now = self._estimator.position, self.now_without_stalls
        fault = self._checks.fault(now)
        if fault:
            self.set_entity_state(State.ERROR, fault)
        elif position is None:
            self.set_entity_state(State.BOOT, "waiting for GPS fix")
        else:
            uncertain = (
                max(position.filter.state_variance(NORTH), position.filter.state_variance(EAST)) > self.largest_variance
            )
            if uncertain and self._converged and self.aborts:
                self.log.error("the position is too uncertain")
                self.publish(imc.Abort(dst=self.system))
            self._converged = not uncertain or (self._converged and not self.aborts)
            ready = State.NORMAL if self._converged else State.BOOT
            text = self._checks.status(now) if self._converged else "waiting for solution to converge"
            self.set_entity_state(ready, text)
