"""Estimates where an underwater vehicle is and how it moves."""

import math

import imc
from runtime import State, param, periodic
from tasks.navigation.auv.depth_filter import DepthFilter
from tasks.navigation.auv.horizontal_filter import EAST, NORTH, PSI, PSI_BIAS, R_BIAS, HorizontalFilter, K, R, U, V
from tasks.navigation.auv.inputs import UNKNOWN_ALTITUDE, Sensors
from tasks.navigation.auv.position import Position, fix_variance
from world.attitude import Vector, rotation, to_body, to_ned, wrap

VERTICAL_ACCELERATION = 0.1  # m/s², over a second
MODEL_VARIANCE = 2.0  # (m/s)² of the speed computed from rpm, for samples as correlated as those 50 ms apart
STREAM_GAIN = 0.1
FRESH = 0.5  # s, largest age of a measured heave
STEEPEST = 0.1  # least cosine of pitch or roll to divide by, near the singularity of Euler angles


class Navigation(Sensors):
    """Publishes EstimatedState from GPS, DVL, depth sensor, attitude reference, altimeter and tachometer.

    Latitude, longitude and height are those of a reference at the surface, x, y, z the offsets from it; they start
    with the first fix. Before it they are those of a manual fix; without one, nothing is published. Under water the
    position follows from the velocity over ground; without it, from that through the water; without both, from the
    speed of the motor. NavigationUncertainty has variances.
    """

    execution_frequency: float = param(20.0, "Hz", "Rate of EstimatedState.", minimum=1, maximum=100)
    depth_variance: float = param(0.0025, "m²", "Variance of depth.", name="Depth Noise Covariance", minimum=1e-9)
    gps_variances: list[float] = param(
        [],
        "m²",
        "Variances of fixes with an accuracy above 10, 8 and 4 m, and better; if empty, those that the fixes claim.",
        name="GPS Noise Covariance",
        size=(0, 4),
    )
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
    speed_per_rpm: float = param(1.015e-3, "m/s/rpm", "Speed per rpm.", name="Revolutions to speed factor")
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
        self._began = self._stepped = self.now
        self._vertical = DepthFilter(VERTICAL_ACCELERATION)
        self._position: Position | None = None
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
        dt, self._stepped = self.now - self._stepped, self.now
        self._vertical.predict(dt)
        if self.depth.take():
            self._vertical.measure_depth(self.depth.value[0], self.depth_variance)
        new_attitude, new_rates = self.euler.take(), self.rates.take()
        fix, self.received = self.received, None
        if self.now - self.sounded > self.altitude_timeout:
            self.altitude = UNKNOWN_ALTITUDE
        if self._position is None and fix is not None and self.euler.last > -math.inf:
            self._begin(fix)
        elif self._position is not None:
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
        measured = self.now - self.ground.last < FRESH
        state.predict(dt, phi, theta, self.ground.value[2] if measured else self._heave)
        if new_attitude:
            innovation = wrap(psi - state.x[PSI] - state.x[PSI_BIAS])
            state.update(innovation, heading, (PSI, 1.0), (PSI_BIAS, 1.0))
        if new_rates:
            _, q, r = self.rates.value
            rate = (math.sin(phi) * q + math.cos(phi) * r) / max(STEEPEST, math.cos(theta))
            state.update(rate - state.x[R] - state.x[R_BIAS], turning, (R, 1.0), (R_BIAS, 1.0))
        self._take_velocity(state, along, across)
        low, high = self.speed_per_rpm - self.speed_variation, self.speed_per_rpm + self.speed_variation
        state.x[K] = max(low, min(high, state.x[K]))

    def _take_velocity(self, state: HorizontalFilter, along: float, across: float) -> None:
        """Apply the velocity over ground; without it, that of water and stream; without both, of motor and stream."""
        new_ground, new_water = self.ground.take(), self.water.take()
        if new_ground and new_water:
            self._learn_stream()
        velocity: Vector | None = self.ground.value if new_ground else None
        stream = to_body(rotation(*self.euler.value), self._stream) if self._stream is not None else (0.0, 0.0, 0.0)
        if velocity is None and new_water and self.now - self.ground.last > self.dvl_timeout:
            (u, v, w), (du, dv, dw) = self.water.value, stream
            velocity = u + du, v + dv, w + dw
        if velocity is not None:
            u, v, w = velocity
            state.update(u - state.x[U], along, (U, 1.0))
            state.update(v - state.x[V], across, (V, 1.0))
            phi, theta, _ = self.euler.value
            cp = math.cos(theta)
            sinking = -math.sin(theta) * u + cp * (math.sin(phi) * v + math.cos(phi) * w)
            self._vertical.measure_rate(sinking, along)
        deaf = self.now - max(self.ground.last, self.water.last) > self.dvl_timeout
        if self.now - self.revolved <= self.dvl_timeout and (self.rpm or deaf):
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
        if not position.correct(fix, fix_variance(fix, self.gps_variances), (north, east), deaf):
            self.log.warning("fixes contradict the position, which is reset to theirs")

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
        phi, theta, psi = self.euler.value
        p, q, r = self.rates.value
        depth, vz = max(0.0, self._vertical.depth), self._vertical.rate
        position = self._position
        if position is None:
            fix = self.place
            if fix is None:
                return
            self.publish(
                imc.EstimatedState(
                    lat=fix.lat,
                    lon=fix.lon,
                    height=fix.height,
                    z=depth,
                    phi=wrap(phi),
                    theta=theta,
                    psi=wrap(psi),
                    vz=vz,
                    p=p,
                    q=q,
                    r=r,
                    depth=depth,
                    alt=self.altitude,
                )
            )
            return
        x = position.filter.x
        u, v, w = x[U], x[V], self._heave
        psi = wrap(x[PSI])
        vx, vy, _ = to_ned(rotation(phi, theta, psi), (u, v, w))
        self.publish(
            imc.EstimatedState(
                lat=position.lat,
                lon=position.lon,
                height=position.height,
                x=x[NORTH],
                y=x[EAST],
                z=depth,
                phi=wrap(phi),
                theta=theta,
                psi=psi,
                u=u,
                v=v,
                w=w,
                vx=vx,
                vy=vy,
                vz=vz,
                p=p,
                q=q,
                r=r - x[R_BIAS],
                depth=depth,
                alt=self.altitude,
            )
        )
        variance = position.filter.variance
        attitude, rate = self.measurement[2], self.measurement[3]
        depth_variance, sinking_variance = self._vertical.variances
        self.publish(
            imc.NavigationUncertainty(
                x=variance(NORTH),
                y=variance(EAST),
                z=depth_variance,
                phi=attitude,
                theta=attitude,
                psi=variance(PSI),
                p=rate,
                q=rate,
                r=variance(R),
                u=variance(U),
                v=variance(V),
                w=sinking_variance,
                bias_psi=variance(PSI_BIAS),
                bias_r=variance(R_BIAS),
            )
        )
        self.publish(
            imc.NavigationData(bias_psi=x[PSI_BIAS], bias_r=x[R_BIAS], cog=math.atan2(vy, vx), cyaw=psi, custom_x=x[K])
        )

    def _judge(self) -> None:
        """Set the state of the entity."""
        now, position = self.now, self._position
        if now - max(self.euler.last, self._began) > self.euler_timeout:
            self.set_entity_state(State.ERROR, "attitude is missing")
        elif now - max(self.depth.last, self._began) > self.depth_timeout:
            self.set_entity_state(State.ERROR, "depth is missing")
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

    def _aids(self) -> str:
        """The description of the entity: names the optional sensors that are silent."""
        silent = ["DVL"] if self.now - max(self.ground.last, self.water.last) > self.dvl_timeout else []
        silent += ["altitude"] if self.altitude == UNKNOWN_ALTITUDE else []
        return f"active without {' and '.join(silent)}" if silent else "active"
