"""Estimates where an underwater vehicle is and how it moves."""

import math

import imc
from runtime import State, param, periodic
from support.rotations import Vector, rotation, to_body, to_ned, wrap
from tasks.navigation.auv.checked import RATE_JUMP, CheckedSensors
from tasks.navigation.auv.consistency import Verdict
from tasks.navigation.auv.horizontal_filter import EAST, NORTH, PSI, PSI_BIAS, R_BIAS, HorizontalFilter, K, R, U, V
from tasks.navigation.auv.inputs import UNKNOWN_ALTITUDE
from tasks.navigation.auv.outputs import estimated_state, first_state, navigation_data, uncertainty
from tasks.navigation.auv.position import Position, fix_variance

MODEL_VARIANCE = 2.0  # (m/s)² of the speed computed from rpm, for samples as correlated as those 50 ms apart
STREAM_GAIN = 0.1
FRESH = 0.5  # s, largest age of a measured heave
STEEPEST = 0.1  # least cosine of pitch or roll to divide by, near the singularity of Euler angles


class Navigation(CheckedSensors):
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

    def start(self) -> None:
        super().start()
        self._stepped = self.now
        self._converged = False
        self._driven = 0
        self._stream: Vector | None = None
        self.set_entity_state(State.BOOT, "waiting for GPS fix")

    @periodic(1.0)
    def tell(self) -> None:
        """Publish once a second what changes slowly."""
        self.publish(imc.AlignmentState(state=imc.AlignmentState.State.NOT_SUPPORTED))
        if self._stream is not None:
            north, east, down = self._stream
            self.publish(imc.EstimatedStreamVelocity(x=north, y=east, z=down))

    @periodic("execution_frequency")
    def estimate(self) -> None:
        now = self.now
        dt, self._stepped = now - self._stepped, now
        self._vertical.predict(dt)
        new_rates, new_attitude = self.rates.take(), self._take_attitude()
        self._take_depth(dt)
        fix, self.received = self.received, None
        if fix is not None and self._is_submerged(fix):
            fix = None
        if now - self.sounded > self.altitude_timeout:
            self.altitude = UNKNOWN_ALTITUDE
        if self._position is None and fix is not None:
            self.place = fix
            if self._oriented > -math.inf:
                self._begin(fix)
        elif self._position is not None:
            self._doubt_velocity()
            self._move(self._position, dt, new_attitude, new_rates)
            if fix is not None:
                self._correct(self._position, fix)
        self._publish_state()
        self._judge()

    def _begin(self, fix: imc.GpsFix) -> None:
        position, angles, speeds, biases, per_rpm = self.initial
        place, heading, rate, speed, rate_bias, heading_bias = self.process
        state = HorizontalFilter(
            (position, position, angles, angles, speeds, speeds, biases, biases, per_rpm),
            (place, place, heading, rate, speed, speed, rate_bias, heading_bias, self.speed_drift),
            self.speed_per_rpm,
        )
        variance = fix_variance(fix, self.gps_variances)
        self._position = Position(fix, self._vertical.depth, self.euler.value[2], variance, self.farthest, state)

    def _move(self, position: Position, dt: float, new_attitude: bool, new_rates: bool) -> None:
        phi, theta, psi = self.euler.value
        state = position.filter
        along, across, heading, turning = self.measurement[:4]
        measured = self.now - self.heave_at < FRESH and not self.velocity_doubt
        state.predict(dt, phi, theta, self.ground.value[2] if measured else self._heave)
        if new_attitude:
            innovation = wrap(psi - state.x[PSI] - state.x[PSI_BIAS])
            state.update(innovation, heading, (PSI, 1.0), (PSI_BIAS, 1.0))
        if new_rates:
            _, q, r = self.rates.value
            rate = (math.sin(phi) * q + math.cos(phi) * r) / max(STEEPEST, math.cos(theta))
            surprise = rate - state.x[R] - state.x[R_BIAS]
            if self._rate_gate.judge(not abs(surprise) <= RATE_JUMP, surprise) is not Verdict.REJECTED:
                state.update(surprise, turning, (R, 1.0), (R_BIAS, 1.0))
        self._take_velocity(state, along, across)
        low, high = self.speed_per_rpm - self.speed_variation, self.speed_per_rpm + self.speed_variation
        state.x[K] = max(low, min(high, state.x[K]))

    def _take_velocity(self, state: HorizontalFilter, along: float, across: float) -> None:
        """Apply the velocity over ground; without it, that of water and stream; without both, of motor and stream."""
        now, new_ground, new_water = self.now, self.ground.take(), self.water.take()
        if new_ground and new_water:
            self._learn_stream()
        velocity: Vector | None = self.ground.value if new_ground else None
        stream = to_body(rotation(*self.euler.value), self._stream) if self._stream is not None else (0.0, 0.0, 0.0)
        if velocity is None and new_water and now - self.ground.last > self.dvl_timeout:
            (u, v, w), (du, dv, dw) = self.water.value, stream
            velocity = u + du, v + dv, w + dw
        if velocity is not None:
            u, v, w = velocity
            state.update(u - state.x[U], along, (U, 1.0))
            state.update(v - state.x[V], across, (V, 1.0))
            phi, theta, _ = self.euler.value
            cp = math.cos(theta)
            sinking = -math.sin(theta) * u + cp * (math.sin(phi) * v + math.cos(phi) * w)
            if not new_ground or now - self.heave_at < FRESH:
                self._vertical.measure_rate(sinking, along)
        deaf = now - max(self.ground.last, self.water.last) > self.dvl_timeout
        if now - self.revolved <= self.dvl_timeout and (self.rpm or deaf):
            if deaf:
                state.drive(float(self.rpm - self._driven))
            u = state.x[K] * self.rpm + stream[0]
            state.update(u - state.x[U], MODEL_VARIANCE, (U, 1.0), (K, -float(self.rpm)))
        self._driven = self.rpm
        if deaf:
            state.update(stream[1] - state.x[V], MODEL_VARIANCE, (V, 1.0))

    def _correct(self, position: Position, fix: imc.GpsFix) -> None:
        north, east, _ = to_ned(rotation(*self.euler.value), (0.0, 0.0, -self.gps_arm))
        deaf = self.now - max(self.ground.last, self.water.last) > self.dvl_timeout
        fastest = self.dvl_largest[0] if deaf else -1.0
        verdict = position.correct(fix, fix_variance(fix, self.gps_variances), (north, east), fastest)
        self._note_fix(position, verdict)

    def _learn_stream(self) -> None:
        (u, v, w), (a, b, c) = self.ground.value, self.water.value
        north, east, down = to_ned(rotation(*self.euler.value), (u - a, v - b, w - c))
        before = self._stream or (north, east, down)
        self._stream = (
            before[0] + STREAM_GAIN * (north - before[0]),
            before[1] + STREAM_GAIN * (east - before[1]),
            before[2] + STREAM_GAIN * (down - before[2]),
        )

    @property
    def _heave(self) -> float:
        """Velocity along the body's z axis (m/s) that, with surge and sway, gives the sinking rate."""
        phi, theta, _ = self.euler.value
        x = self._position.filter.x if self._position is not None else None
        u, v = (x[U], x[V]) if x is not None else (0.0, 0.0)
        cp, cr = max(STEEPEST, math.cos(theta)), math.cos(phi)
        cr = math.copysign(max(STEEPEST, abs(cr)), cr)
        return (self._vertical.rate + math.sin(theta) * u - cp * math.sin(phi) * v) / (cp * cr)

    def _publish_state(self) -> None:
        vertical, angles, rates, position = self._vertical, self.euler.value, self.rates.value, self._position
        if position is None:
            if self.place is not None:
                self.publish(first_state(self.place, vertical, angles, rates, self.altitude))
            return
        state = estimated_state(position, vertical, angles, rates, self._heave, self.altitude)
        self.publish(state)
        check = self._depth_check
        self.publish(uncertainty(position, vertical, check.lag if check.fault else 0.0, self.measurement))
        self.publish(navigation_data(position, state))

    def _judge(self) -> None:
        """Set the state of the entity."""
        position = self._position
        fault = self._fault()
        if fault:
            self.set_entity_state(State.ERROR, fault)
        elif position is None:
            self.set_entity_state(State.BOOT, "waiting for GPS fix")
        else:
            uncertain = max(position.filter.variance(NORTH), position.filter.variance(EAST)) > self.largest_variance
            if uncertain and self._converged and self.aborts:
                self.log.error("the position is too uncertain")
                self.publish(imc.Abort(dst=self.system))
            self._converged = not uncertain or (self._converged and not self.aborts)
            ready = State.NORMAL if self._converged else State.BOOT
            self.set_entity_state(ready, self._aids() if self._converged else "waiting for solution to converge")
