"""Estimates where a boat is and how it moves."""

import math

import imc
from autonomy.navigation import (
    AGREEMENT,
    CONTRADICTION,
    CONTRADICTIONS,
    DEEPEST,
    EAST,
    FAULT_HOLD,
    GPS_JUMP,
    LARGEST_PITCH,
    LARGEST_RATE,
    LARGEST_ROLL,
    NORTH,
    STREAM_EAST,
    STREAM_NORTH,
    ASVFilter,
    AttitudeCheck,
    AttitudeRange,
    FixDriftDetector,
    FixGate,
    GateDecision,
    ImpossibleValues,
    JumpGate,
    Reason,
    SampleMean,
    StuckDetector,
    assume_height,
    fix_variance,
    has_plausible_position,
    missing_reason,
    reported_velocity,
)
from runtime import State, Task, consume, param, periodic
from support.planar_geometry import north_and_east
from support.rotations import wrap
from support.wgs84 import offset

UNKNOWN_ALTITUDE = -1.0
SPEED_JUMP = 20.0  # m/s, that no boat gains between two fixes
OFTEN = 60.0  # s, between two resets of the position that are one too many
UNKNOWN_MOTION = 0.5  # s in which the process stood still, after which the position starts anew
PATIENCE = 1.0  # s of attitudes that agree before a jump of theirs is accepted


class GPSNavigation(Task):
    """Publishes EstimatedState of a boat from GPS and an attitude reference, and the current that follows from both.

    Latitude, longitude and height are those of a reference, x and y the offsets from it; they start with the first fix.
    Before it they are those of a manual fix; without one, nothing is published. Depth and z are 0. Without fixes the
    position follows from the last velocities and the heading, and the entity is in ERROR after `GPS timeout`.
    NavigationUncertainty has variances. An empty entity label accepts any entity.
    """

    execution_frequency: float = param(20.0, "Hz", "Rate of EstimatedState.", minimum=1, maximum=100)
    gps: str = param("GPS", "", "Entity of fixes.", name="Entity Label - GPS")
    imu: str = param("AHRS", "", "Entity of roll, pitch and rates.", name="Entity Label - IMU")
    yaw: str = param("AHRS", "", "Entity of the heading.", name="Entity Label - Yaw")
    altimeter: str = param("Altimeter", "", "Entity of the distance to the bottom.", name="Entity Label - Altitude")
    altitude_timeout: float = param(
        5.0, "s", "Time without distance before altitude is unknown.", name="Altitude timeout", minimum=0
    )
    euler_timeout: float = param(3.0, "s", "Time without attitude before an error.", name="Euler timeout", minimum=0)
    gps_timeout: float = param(10.0, "s", "Time without a fix before an error.", name="GPS timeout", minimum=0)
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
    gps_hacc: float = param(20.0, "m", "Worst accepted accuracy of a fix.", name="GPS Maximum HACC", minimum=0)
    gps_hdop: float = param(
        4.0, "1", "Worst accepted HDOP, if accuracy is unknown.", name="GPS Maximum HDOP", minimum=0
    )
    speed_variance: float = param(
        0.01, "(m/s)²", "Variance of speed and course of a fix.", name="GPS Speed Noise Covariance", minimum=1e-6
    )
    attitude_variances: list[float] = param(
        [1e-4, 1e-6],
        "1",
        "Variances of the attitude reference: angles (rad²) and rates ((rad/s)²).",
        name="Measure Noise Covariance",
        size=2,
    )
    process: list[float] = param(
        [1e-3, 0.05, 1e-4],
        "1",
        "Variances added per second to position, velocity through the water and current, in SI units.",
        name="Process Noise Covariance",
        size=3,
    )
    sway_decay: float = param(2.0, "s", "Time constant of sway.", minimum=0.1)
    farthest: float = param(
        1000.0, "m", "Distance at which the reference is moved.", name="Maximum Distance to Reference", minimum=1
    )

    def configure(self) -> None:
        self._gate = FixGate(self.gps_factor, self.gps_samples, self.gps_hacc, self.gps_hdop)

    def start(self) -> None:
        self._attitude, self._heading, self._rates = SampleMean(), SampleMean(), SampleMean()
        self._turns = 0.0
        self._fix: imc.GpsFix | None = None
        self._height = 0.0  # of the last fix, for those without
        self._manual: imc.GpsFix | None = None
        self._reference: imc.GpsFix | None = None
        self._filter = ASVFilter(1.0, 1.0, 0.25, self.process, self.sway_decay)
        self._jumps = JumpGate(CONTRADICTIONS, AGREEMENT)
        self._attitude_noise, self._fix_drift = StuckDetector(), FixDriftDetector()
        self._check = AttitudeCheck(max(1, round(PATIENCE * self.execution_frequency)))
        self._imu_range, self._yaw_range = (AttitudeRange(LARGEST_ROLL, LARGEST_PITCH) for _ in range(2))
        self._impossible = ImpossibleValues()
        self._held_fault, self._held_until = "", -math.inf
        self._accepted_at = self._oriented = self._reset = -math.inf
        self._turned = self.now
        self._altitude, self._sounded = UNKNOWN_ALTITUDE, -math.inf
        self._stepped = self._began = self.now
        self._moved_on = False
        self._fixed = -math.inf
        self.set_entity_state(State.BOOT, "waiting for GPS fix")

    @consume
    def on_euler_angles(self, angles: imc.EulerAngles) -> None:
        phi, theta, psi = angles.phi, angles.theta, angles.psi
        has_attitude = not (math.isnan(phi) and math.isnan(theta))  # a compass of its own has none
        has_heading = not math.isnan(psi)
        is_imu, is_yaw = self.is_from(angles, self.imu), self.is_from(angles, self.yaw)
        if not is_imu and not is_yaw:
            return
        tilt = (phi, theta) if has_attitude else (0.0, 0.0)
        limits = self._yaw_range if is_yaw else self._imu_range
        if not self._impossible.accepts("attitude", limits.accepts(self.now, *tilt, psi if has_heading else 0.0)):
            return
        is_yaw = is_yaw and has_heading
        if is_yaw and self._attitude_noise.update(phi + theta + psi if has_attitude else psi):
            return
        if has_attitude and is_imu:
            self._attitude.add(self.now, phi, theta)
        if is_yaw:
            self._turns += wrap(psi - self._turns)
            self._heading.add(self.now, self._turns)

    @consume
    def on_angular_velocity(self, rates: imc.AngularVelocity) -> None:
        p, q, r = rates.x, rates.y, rates.z
        if self.is_from(rates, self.imu) and self._impossible.accepts_within("turn rates", LARGEST_RATE, p, q, r):
            self._rates.add(self.now, p, q, r)

    @consume
    def on_distance(self, distance: imc.Distance) -> None:
        valid = distance.validity == imc.Distance.Validity.VALID and self.is_from(distance, self.altimeter)
        if valid and self._impossible.accepts("distance", 0.0 <= distance.value <= DEEPEST):
            self._altitude, self._sounded = distance.value, self.now

    @consume
    def screen_gps_fix(self, fix: imc.GpsFix) -> None:
        fix = assume_height(fix, self._height)
        if fix.type == imc.GpsFix.Type.MANUAL_INPUT:
            self._manual = fix if has_plausible_position(fix) else self._manual
        elif self.is_from(fix, self.gps):
            reason = self._gate.reject_reason(fix)
            if reason is None and not has_plausible_position(fix):
                reason = Reason.INVALID
            if reason is None:
                self._fix, self._fixed, self._height = fix, self.now, fix.height
            else:
                self.publish(imc.GpsFixRejection(utc_time=fix.utc_time, reason=reason))

    @periodic(1.0)
    def publish_current(self) -> None:
        """Publish the current once a second."""
        if report := self._impossible.report(self.now):
            self.log.warning(report)
        if self._reference is not None:
            x = self._filter.x
            self.publish(imc.EstimatedStreamVelocity(x=x[STREAM_NORTH], y=x[STREAM_EAST]))

    @periodic("execution_frequency")
    def estimate(self) -> None:
        dt, self._stepped = self.now - self._stepped, self.now
        self._moved_on |= self.recent_stall > UNKNOWN_MOTION
        self._update_attitude()
        fix, self._fix = self._fix, None
        if self.age(self._sounded) > self.altitude_timeout:
            self._altitude = UNKNOWN_ALTITUDE
        psi = self._heading.value[0]
        if self._reference is not None:
            self._filter.predict(dt, psi)
        if fix is not None and self._heading.last > -math.inf:
            self._correct(fix, psi)
        self._publish_state(psi)
        self._update_entity_state()

    def _update_attitude(self) -> None:
        """Take the mean attitude and rates, unless the attitude jumps."""
        attitude, heading = self._attitude.value, self._heading.value
        self._rates.update()
        if not (self._attitude.update() | self._heading.update()):
            return
        fresh = self.age(self._rates.last) <= self.euler_timeout
        elapsed, self._turned = self.now - self._turned, self.now
        if self.recent_stall:
            self._check.resume()
        angles = self._attitude.value[0], self._attitude.value[1], self._heading.value[0]
        verdict = self._check.evaluate(elapsed, angles, self._rates.interval_mean if fresh else None)
        if verdict is GateDecision.REJECTED:
            self._attitude.value, self._heading.value = attitude, heading
            return
        self._oriented = min(self._attitude.last, self._heading.last)
        if verdict is GateDecision.RESET:
            self.log.warning("the attitude has jumped and stays there")

    def _correct(self, fix: imc.GpsFix, psi: float) -> None:
        variance, state = fix_variance(fix, []), self._filter
        if self._reference is None:
            self._reference = fix
            state.reset_position(0.0, 0.0, variance)
        reference = self._reference
        north, east = offset(reference.lat, reference.lon, fix.lat, fix.lon)
        if self._moved_on:
            self._moved_on = False
            state.reset_position(north, east, variance)
        off = north - state.x[NORTH], east - state.x[EAST]
        verdict = self._jumps.evaluate(state.mahalanobis_squared(north, east, variance) > CONTRADICTION, *off)
        if verdict is GateDecision.REJECTED:
            return
        if verdict is GateDecision.ACCEPTED:
            if self.recent_stall:
                self._fix_drift.resume()
            if self._fix_drift.update(self.now, fix):
                self._held_fault, self._held_until = "GPS drifts away from its own speed", self.now + FAULT_HOLD
            state.measure_position(north, east, variance)
        else:
            self._fix_drift.reset()
            state.reset_position(north, east, variance)
            self.log.warning("fixes contradict the position, which is reset to theirs")
            if math.hypot(*off) > GPS_JUMP and self.age(self._accepted_at) <= self.gps_timeout:
                self._held_fault, self._held_until = (
                    f"GPS has jumped by {math.hypot(*off):.0f} m",
                    self.now + FAULT_HOLD,
                )
            elif self.now - self._reset <= OFTEN:
                self._held_fault, self._held_until = "fixes contradict heading and speed", self.now + FAULT_HOLD
            self._reset = self.now
        self._accepted_at = self.now
        if (reported := reported_velocity(fix)) is not None:
            along, across = reported
            u, v = state.ground_velocity(psi)
            if math.dist((along, across), north_and_east(u, v, psi)) <= SPEED_JUMP:
                state.measure_velocity(along, across, psi, self.speed_variance)
        # A plane fits the ellipsoid only nearby: take the fix as the new origin.
        if math.hypot(north, east) > self.farthest:
            self._reference = fix
            state.x[NORTH] -= north
            state.x[EAST] -= east

    def _publish_state(self, psi: float) -> None:
        phi, theta, _ = self._attitude.value
        p, q, r = self._rates.value
        place, state = self._reference or self._manual, self._filter
        if place is None:
            return
        u, v = state.ground_velocity(psi) if self._reference is not None else (0.0, 0.0)
        vx, vy = north_and_east(u, v, psi)
        self.publish(
            imc.EstimatedState(
                lat=place.lat,
                lon=place.lon,
                height=place.height,
                x=state.x[NORTH],
                y=state.x[EAST],
                phi=phi,
                theta=theta,
                psi=wrap(psi),
                u=u,
                v=v,
                vx=vx,
                vy=vy,
                p=p,
                q=q,
                r=r,
                alt=self._altitude,
            )
        )
        if self._reference is None:
            return
        along, across = state.ground_variance(psi)
        angle, rate = self.attitude_variances
        self.publish(
            imc.NavigationUncertainty(
                x=state.p[NORTH][NORTH],
                y=state.p[EAST][EAST],
                phi=angle,
                theta=angle,
                psi=angle,
                p=rate,
                q=rate,
                r=rate,
                u=along,
                v=across,
            )
        )
        self.publish(imc.NavigationData(cog=math.atan2(vy, vx), cyaw=wrap(psi)))

    def _update_entity_state(self) -> None:
        """Set the state of the entity."""
        fault = self._fault()
        if fault:
            self.set_entity_state(State.ERROR, fault)
        elif self._reference is None:
            self.set_entity_state(State.BOOT, "waiting for GPS fix")
        elif self.age(self._fixed) > self.gps_timeout:
            self.set_entity_state(State.ERROR, "GPS is missing")
        else:
            contradicted = "; GPS: contradicts the position" if self._jumps.rejected else ""
            self.set_entity_state(State.NORMAL, f"active{contradicted}")

    def _fault(self) -> str:
        """Reason why the boat must stop; empty if it need not."""
        if self.age(max(self._oriented, self._began)) > self.euler_timeout:
            impossible = self._imu_range.rejects(self.now) or self._yaw_range.rejects(self.now)
            stuck, jumps = self._attitude_noise.stuck, self._check.rejects
            return f"attitude {missing_reason(stuck=stuck, jumps=jumps, impossible=impossible)}"
        if self._rates.last > -math.inf and self.age(self._rates.last) > self.euler_timeout:
            return "turn rates are missing"
        self._check.set_hysteresis(bool(self._check.fault))
        if self._check.fault:
            self._held_fault, self._held_until = self._check.fault, self.now + FAULT_HOLD
        return self._held_fault if self.now < self._held_until else ""
