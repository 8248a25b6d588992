"""Estimates position, velocity and depth of an underwater vehicle from its sensors."""

import math

import imc
from autonomy.navigation.depth_filter import DepthFilter
from autonomy.navigation.fault_detection import GateDecision, JumpGate
from autonomy.navigation.gnss_position_correction import PositionEstimate, fix_variance
from autonomy.navigation.horizontal_filter import PSI, PSI_BIAS, R_BIAS, HorizontalFilter, K, R, U, V
from autonomy.navigation.sensor_inputs import SensorInputs
from support.rotations import Vector, rotate_to_body, rotate_to_ned, wrap

VERTICAL_ACCELERATION = 0.1  # m/s², over a second
PATIENCE = 1.0  # s of measurements that agree before a jump of theirs is accepted
RATE_JUMP = 1.0  # rad/s
MODEL_VARIANCE = 2.0  # (m/s)² of the speed computed from rpm, for samples as correlated as those 50 ms apart
STREAM_GAIN = 0.1
FRESH = 0.5  # s, largest age of a measured heave
STEEPEST = 0.1  # least cosine of pitch or roll to divide by, near the singularity of Euler angles


class UnderwaterEstimator:
    """Drives the filters with the means of `inputs`: `vertical` of depth, `position` from the first fix on.

    Under water the position follows from the velocity over ground; without it, from that through the water; without
    both, from the speed of the motor. `stream` is the velocity of the water (m/s north, east, down), None if unknown.
    """

    def __init__(self, inputs: SensorInputs):
        self._inputs = inputs
        settings = inputs.settings
        self.vertical: DepthFilter = DepthFilter(VERTICAL_ACCELERATION, settings.initial_depth)
        self.position: PositionEstimate | None = None
        self.stream: Vector | None = None
        self._rate_gate = JumpGate(max(1, round(PATIENCE * settings.execution_frequency)), RATE_JUMP)
        self._driven = 0

    @property
    def speed_per_rpm(self) -> float:
        """Surge per speed of the motor (m/s/rpm)."""
        return self.position.filter.x[K] if self.position is not None else self._inputs.settings.speed_per_rpm

    @property
    def heave(self) -> float:
        """Velocity along the body's z axis (m/s) that, with surge and sway, gives the sinking rate."""
        phi, theta, _ = self._inputs.euler.value
        x = self.position.filter.x if self.position is not None else None
        u, v = (x[U], x[V]) if x is not None else (0.0, 0.0)
        cp, cr = max(STEEPEST, math.cos(theta)), math.cos(phi)
        cr = math.copysign(max(STEEPEST, abs(cr)), cr)
        return (self.vertical.rate + math.sin(theta) * u - cp * math.sin(phi) * v) / (cp * cr)

    def begin(self, fix: imc.GpsFix) -> None:
        """Start at a fix."""
        settings = self._inputs.settings
        position, angles, speeds, biases, per_rpm = settings.initial
        place, heading, rate, speed, rate_bias, heading_bias = settings.process
        state = HorizontalFilter(
            (position, position, angles, angles, speeds, speeds, biases, biases, per_rpm),
            (place, place, heading, rate, speed, speed, rate_bias, heading_bias, settings.speed_drift),
            settings.speed_per_rpm,
        )
        variance, psi = fix_variance(fix, settings.gps_variances), self._inputs.euler.value[2]
        self.position = PositionEstimate(fix, self.vertical.depth, psi, variance, settings.farthest, state)

    def advance(self, position: PositionEstimate, now: float, dt: float, new_attitude: bool, new_rates: bool) -> None:
        """Advance by `dt` s to the time `now`, with the attitude, rates and velocities that are new."""
        inputs, settings, state = self._inputs, self._inputs.settings, position.filter
        phi, theta, psi = inputs.euler.value
        along, across, heading, turning = settings.measurement[:4]
        measured = now - inputs.heave_time < FRESH and not inputs.velocity_fault
        state.predict(dt, phi, theta, inputs.ground.value[2] if measured else self.heave)
        if new_attitude:
            innovation = wrap(psi - state.x[PSI] - state.x[PSI_BIAS])
            state.update(innovation, heading, (PSI, 1.0), (PSI_BIAS, 1.0))
        if new_rates:
            _, q, r = inputs.rates.value
            rate = (math.sin(phi) * q + math.cos(phi) * r) / max(STEEPEST, math.cos(theta))
            surprise = rate - state.x[R] - state.x[R_BIAS]
            if self._rate_gate.evaluate(not abs(surprise) <= RATE_JUMP, surprise) is not GateDecision.REJECTED:
                state.update(surprise, turning, (R, 1.0), (R_BIAS, 1.0))
        self._update_velocity(state, now, along, across)
        low, high = settings.speed_per_rpm - settings.speed_variation, settings.speed_per_rpm + settings.speed_variation
        state.x[K] = max(low, min(high, state.x[K]))

    def correct(self, position: PositionEstimate, now: float, fix: imc.GpsFix) -> GateDecision:
        """Apply a fix; its speed counts where velocities are missing."""
        north, east, _ = rotate_to_ned(*self._inputs.euler.value, (0.0, 0.0, -self._inputs.settings.gps_arm))
        fastest = self._inputs.settings.dvl_largest[0] if self._inputs.lacks_velocity(now) else -1.0
        return position.correct(fix, fix_variance(fix, self._inputs.settings.gps_variances), (north, east), fastest)

    def _update_velocity(self, state: HorizontalFilter, now: float, along: float, across: float) -> None:
        """Apply the velocity over ground; without it, that of water and stream; without both, of motor and stream."""
        inputs, timeout = self._inputs, self._inputs.settings.dvl_timeout
        new_ground, new_water = inputs.ground.update(), inputs.water.update()
        if new_ground and new_water:
            self._update_stream()
        velocity: Vector | None = inputs.ground.value if new_ground else None
        stream = rotate_to_body(*inputs.euler.value, self.stream) if self.stream is not None else (0.0, 0.0, 0.0)
        if velocity is None and new_water and now - inputs.ground.last > timeout:
            (u, v, w), (du, dv, dw) = inputs.water.value, stream
            velocity = u + du, v + dv, w + dw
        if velocity is not None:
            u, v, w = velocity
            state.update(u - state.x[U], along, (U, 1.0))
            state.update(v - state.x[V], across, (V, 1.0))
            phi, theta, _ = inputs.euler.value
            cp = math.cos(theta)
            sinking = -math.sin(theta) * u + cp * (math.sin(phi) * v + math.cos(phi) * w)
            if not new_ground or now - inputs.heave_time < FRESH:
                self.vertical.measure_rate(sinking, along)
        by_motor = inputs.lacks_velocity(now)
        if now - inputs.rpm_time <= timeout and (inputs.rpm or by_motor):
            if by_motor:
                state.apply_rpm_change(float(inputs.rpm - self._driven))
            u = state.x[K] * inputs.rpm + stream[0]
            state.update(u - state.x[U], MODEL_VARIANCE, (U, 1.0), (K, -float(inputs.rpm)))
        self._driven = inputs.rpm
        if by_motor:
            state.update(stream[1] - state.x[V], MODEL_VARIANCE, (V, 1.0))

    def _update_stream(self) -> None:
        (u, v, w), (a, b, c) = self._inputs.ground.value, self._inputs.water.value
        north, east, down = rotate_to_ned(*self._inputs.euler.value, (u - a, v - b, w - c))
        before = self.stream or (north, east, down)
        self.stream = (
            before[0] + STREAM_GAIN * (north - before[0]),
            before[1] + STREAM_GAIN * (east - before[1]),
            before[2] + STREAM_GAIN * (down - before[2]),
        )
