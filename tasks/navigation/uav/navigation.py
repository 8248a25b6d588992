"""Estimates where an aerial vehicle is from GPS, inertial sensors and a barometer."""

import math

import imc
from autonomy.navigation import (
    FAULT_HOLD,
    GPS_JUMP,
    LARGEST_RATE,
    AerialHeight,
    AttitudeCheck,
    AttitudeRange,
    FixGate,
    GateDecision,
    GnssVelocityCheck,
    ImpossibleValues,
    InertialFilter,
    JumpGate,
    NoiseMonitor,
    Reason,
    SampleMean,
    StuckDetector,
    assume_height,
    ground_velocity,
    has_plausible_position,
    horizontal_variance,
    mean_fix,
    missing_reason,
    offset_from,
)
from imc.reserved_ids import EMPTY_HEADER
from runtime import State, Task, consume, param, periodic
from support.rotations import Vector, rotate_to_body, rotate_to_ned, wrap

GRAVITY = 9.80665
NO_DEPTH = -1.0
CONTRADICTION = 30.0  # squared Mahalanobis distance of a fix that the filter cannot explain
CONTRADICTIONS = 5  # contradicting fixes in a row that agree to within AGREEMENT reset the filter
AGREEMENT = 10.0  # m
ATTITUDES = 50  # samples that agree before a jump of theirs is accepted
FIX_SIGMAS = 4.0  # fixes that scatter by more of the standard deviations that they claim are not used
RESETS, RESET_MEMORY = 3, 30.0  # so many resets in so many seconds are no jump
LARGEST_FORCE = 160.0  # m/s², the range of 16 g of the accelerometer
UNKNOWN_MOTION = 0.5  # s in which the process stood still, after which position and height start anew
BURST = 0.5  # s by which samples may come late, together, on a busy computer
PAUSE = 0.2  # s without attitude, in which the rates are unknown
ATTITUDE_VARIANCE, RATE_VARIANCE = 1e-6, 1e-5  # rad², (rad/s)²
INITIAL_VELOCITY, INITIAL_BIAS = 0.01, 0.01  # variances at rest, (m/s)², (m/s²)²
FLYING_VELOCITY = 25.0  # (m/s)², variance in the air


class Navigation(Task):
    """Publishes EstimatedState and NavigationUncertainty of an aerial vehicle.

    Attitude is that of the attitude reference. Positions and velocities are those of Kalman filters, driven by
    accelerations and corrected horizontally by fixes and vertically by the barometer. It starts while the vehicle
    stands still: the reference is the mean of the last fixes until then, and stays when the task restarts, which may be
    in the air. A fix of unknown height corrects the position. `alt` is above the reference; `depth` is -1.
    """

    execution_frequency: float = param(20.0, "Hz", "Rate of EstimatedState.", minimum=1, maximum=100)
    ahrs: str = param("AHRS", "", "Entity of attitude, rates and acceleration.", name="Entity Label - AHRS")
    barometer: str = param("Barometer", "", "Entity of pressure.", name="Entity Label - Barometer")
    initial_fixes: int = param(10, "1", "Number of fixes whose mean is the reference.", minimum=1, maximum=1000)
    largest_hacc: float = param(10.0, "m", "Worst accepted accuracy of a fix.", name="GPS Maximum HACC", minimum=0)
    pressure_noise: float = param(0.15, "m", "Standard deviation of barometric heights.", minimum=1e-3)
    pressure_drift: float = param(
        0.3, "m", "Standard deviation of the uncorrected slow error of barometric heights.", minimum=0
    )
    acceleration_noise: float = param(0.06, "m/s²/√Hz", "Noise of accelerations.", minimum=1e-6)
    bias_walk: float = param(0.002, "m/s³/√Hz", "Random walk of the bias of accelerations.", minimum=0)
    gps_timeout: float = param(5.0, "s", "Time without a fix before an error.", name="GPS timeout", minimum=0.1)
    euler_timeout: float = param(
        1.0, "s", "Time without attitude after which estimates stop.", name="Euler timeout", minimum=0.05
    )
    pressure_timeout: float = param(
        2.0, "s", "Time without pressure before an error.", name="Pressure timeout", minimum=0.1
    )

    def start(self) -> None:
        self._angles: Vector | None = None
        self._rates: Vector = (0.0, 0.0, 0.0)
        self._acceleration = SampleMean()
        noise = self.acceleration_noise, self.bias_walk
        self._height = AerialHeight(self.pressure_noise, self.pressure_timeout, noise)
        self._fix: imc.GpsFix | None = None
        self._fixed = self._oriented = -math.inf
        self._first: list[imc.GpsFix] = []
        self._reference: imc.GpsFix | None = None
        self._site: tuple[imc.GpsFix, float] | None = getattr(self, "_site", None)
        self._fix_gate = FixGate(math.inf, 1, self.largest_hacc, math.inf)
        self._jumps = JumpGate(CONTRADICTIONS, AGREEMENT)
        self._attitude_noise, self._fix_noise = StuckDetector(), StuckDetector()
        self._scatter = NoiseMonitor(FIX_SIGMAS), NoiseMonitor(FIX_SIGMAS)
        self._check, self._range, self._impossible = AttitudeCheck(ATTITUDES), AttitudeRange(), ImpossibleValues()
        self._doppler = GnssVelocityCheck()
        self._held_fault, self._held_until, self._lost_until = "", -math.inf, -math.inf
        self._resets: list[float] = []
        self._accepted_at = self._turned_at = self._sampled = -math.inf
        self._turned = self._stepped = self.now
        self._moved_on = False
        self.set_entity_state(State.BOOT, "waiting for GPS fix")

    @consume
    def on_euler_angles(self, angles: imc.EulerAngles) -> None:
        phi, theta, psi = angles.phi, angles.theta, angles.psi
        if not self.is_from(angles, self.ahrs):
            return
        possible = self._range.accepts(self.now, phi, theta, psi)
        if not self._impossible.accepts("attitude", possible) or self._attitude_noise.update(phi + theta + psi):
            return
        elapsed = self._time_since_last(angles)
        if self.recent_stall:
            self._check.resume()
        rates = self._rates if elapsed < PAUSE else None
        verdict = self._check.evaluate(elapsed, (phi, theta, psi), rates)
        if verdict is not GateDecision.REJECTED:
            self._angles, self._oriented = (phi, theta, wrap(psi)), self.now

    def _time_since_last(self, angles: imc.EulerAngles) -> float:
        """Time since the last attitude (s): by the sensor's clock, unless it contradicts this one."""
        received, sampled = self.now - self._turned, angles.timestamp - self._sampled
        self._turned, self._sampled = self.now, angles.timestamp
        return sampled if sampled >= 0.0 and abs(sampled - received) < BURST else received

    @consume
    def on_angular_velocity(self, rates: imc.AngularVelocity) -> None:
        p, q, r = rates.x, rates.y, rates.z
        if self.is_from(rates, self.ahrs) and self._impossible.accepts_within("turn rates", LARGEST_RATE, p, q, r):
            self._rates, self._turned_at = (p, q, r), self.now

    @consume
    def on_acceleration(self, force: imc.Acceleration) -> None:
        """Average accelerations, from specific forces."""
        if not self.is_from(force, self.ahrs):
            return
        forces = force.x, force.y, force.z
        if self._impossible.accepts_within("acceleration", LARGEST_FORCE, *forces) and self._angles is not None:
            north, east, down = rotate_to_ned(*self._angles, forces)
            self._acceleration.add(self.now, north, east, down + GRAVITY)

    @consume
    def on_pressure(self, sample: imc.Pressure) -> None:
        if self.is_from(sample, self.barometer):
            self._impossible.accepts("pressure", self._height.barometer.receive(self.now_without_stalls, sample.value))

    @consume
    def screen_gps_fix(self, fix: imc.GpsFix) -> None:
        if fix.type == imc.GpsFix.Type.MANUAL_INPUT:
            return
        placed = assume_height(fix, 0.0)  # position and height are used apart
        reason = self._fix_gate.reject_reason(placed)
        lost = reason is Reason.LOST_VAL_BIT or not has_plausible_position(placed)
        if lost or self._fix_noise.update(fix.lat + fix.lon):
            reason = Reason.INVALID
        elif not fix.hacc <= self.largest_hacc:
            reason = Reason.ABOVE_MAX_HACC
        if reason is not None:
            self.publish(imc.GpsFixRejection(utc_time=fix.utc_time, reason=reason))
        else:
            self._fix, self._fixed = fix, self.now

    @periodic("execution_frequency")
    def estimate(self) -> None:
        dt, self._stepped = self.now - self._stepped, self.now
        fix, self._fix = self._fix, None
        if self._reference is None:
            self._prepare(fix)
            fix = None
        oriented = self.age(self._oriented) <= self.euler_timeout
        if self._reference is not None and self._angles is not None and oriented:
            self._move(self._reference, dt, fix)
            self._check.set_hysteresis(bool(self._check.fault))
            if not self._check.tilt_fault and self.now >= self._lost_until:
                self._publish(self._reference, self._angles)
        self._update_entity_state()

    def _prepare(self, fix: imc.GpsFix | None) -> None:
        if fix is not None and (self._site or math.isfinite(fix.height)):  # the reference needs a height
            self._first.append(fix)
            del self._first[: -self.initial_fixes]
        height = self._height.barometer.mean
        if len(self._first) < self._needed or self._angles is None or not height.update():
            return
        if self._site is None:
            self._site = mean_fix(self._first), height.value[0]
            variance = horizontal_variance(self._first[-1]) / len(self._first)
            self._begin(*self._site, 0.0, variance, INITIAL_VELOCITY)
        else:
            reference, ground = self._site
            last = self._first[-1]
            down = ground - height.value[0]
            self._begin(reference, ground, down, horizontal_variance(last), FLYING_VELOCITY)
            self._over_ground.position[:] = offset_from(reference, last)

    @property
    def _needed(self) -> int:
        """The number of fixes that a start takes."""
        return 1 if self._site else self.initial_fixes

    def _begin(self, reference: imc.GpsFix, ground: float, down: float, variance: float, speed: float) -> None:
        """Start the filters `down` m below the reference, with variances of positions (m²) and velocities (m²/s²)."""
        self._reference = reference
        self._accepted_at = self.now
        noise, walk = self.acceleration_noise, self.bias_walk
        self._over_ground = InertialFilter(2, noise, walk, (variance, speed, INITIAL_BIAS))
        self._height.start(ground, down, self.now_without_stalls, (speed, INITIAL_BIAS))
        self._acceleration.update()

    def _move(self, reference: imc.GpsFix, dt: float, fix: imc.GpsFix | None) -> None:
        if self.recent_stall > UNKNOWN_MOTION:
            self._moved_on = True
            self._height.resume(FLYING_VELOCITY)
        if not self._acceleration.update() or dt > UNKNOWN_MOTION:
            self._acceleration.value = 0.0, 0.0, 0.0
        north, east, down = self._acceleration.value
        self._over_ground.predict(dt, (north, east))
        if fault := self._height.advance(self.now_without_stalls, dt, down):
            self._hold_fault(fault)
            self._note_reset()
        if fix is not None:
            self._correct(reference, fix)
        if fault := self._height.fault(self.now_without_stalls):
            self._suspend(fault, FAULT_HOLD)

    def _hold_fault(self, fault: str) -> None:
        if fault != self._held_fault or self.now > self._held_until:
            self.log.warning(fault)
        self._held_fault, self._held_until = fault, self.now + FAULT_HOLD

    def _suspend(self, fault: str, seconds: float) -> None:
        """Publish no estimate for some time: it could lead the vehicle anywhere, and without one it descends level."""
        self._hold_fault(fault)
        self._lost_until = self._held_until = self.now + seconds

    def _note_reset(self) -> None:
        """One reset follows from a jump; several mean that attitude, accelerations or fixes lie on and on."""
        self._resets = [time for time in self._resets if self.now - time < RESET_MEMORY] + [self.now]
        if len(self._resets) >= RESETS:
            self._suspend("GPS disagrees with attitude and accelerations: the position is not trusted", RESET_MEMORY)

    def _correct(self, reference: imc.GpsFix, fix: imc.GpsFix) -> None:
        north, east = offset_from(reference, fix)
        variance, horizontal, age = horizontal_variance(fix), self._over_ground, self.now - self._fixed
        sigma = math.sqrt(variance)
        # A list, not a generator: both axes have to be updated.
        if any([axis.update(at / sigma) for axis, at in zip(self._scatter, (north, east), strict=True)]):
            return
        vn, ve = horizontal.velocity
        if self.recent_stall:
            self._doppler.resume()
        self._doppler.update(self._fixed, north, east, sigma, ground_velocity(fix))
        if self._doppler.faulty:
            self._hold_fault("GPS position moves against its own velocity")
            north, east = self._doppler.reckoned
        north, east = north + age * vn, east + age * ve
        self._height.correct_by_gps(self.now_without_stalls, fix.height - reference.height, variance)
        if self._moved_on:
            self._moved_on = False
            horizontal.reset((north, east), variance, FLYING_VELOCITY)
        off = north - horizontal.position[0], east - horizontal.position[1]
        verdict = self._jumps.evaluate(horizontal.mahalanobis_squared((north, east), variance) > CONTRADICTION, *off)
        if verdict is GateDecision.REJECTED:
            return
        if verdict is GateDecision.ACCEPTED:
            horizontal.correct((north, east), variance)
        else:
            horizontal.reset((north, east), variance)
            self.log.warning("fixes contradict the position, which is reset to theirs")
            self._note_reset()
            if math.hypot(*off) > GPS_JUMP and self.age(self._accepted_at) <= self.gps_timeout:
                self._hold_fault(f"GPS has jumped by {math.hypot(*off):.0f} m")
        self._accepted_at = self.now

    def _publish(self, reference: imc.GpsFix, angles: Vector) -> None:
        phi, theta, psi = angles
        (north, east), (vn, ve) = self._over_ground.position, self._over_ground.velocity
        down, vd = self._height.filter.position[0], self._height.filter.velocity[0]
        pose, velocity = (north, east, down, wrap(phi), theta, psi), (vn, ve, vd)
        through, place = rotate_to_body(phi, theta, psi, velocity), (reference.lat, reference.lon, reference.height)
        depth, alt = NO_DEPTH, max(0.0, -down)
        self.publish(imc.EstimatedState(*EMPTY_HEADER, *place, *pose, *through, *velocity, *self._rates, depth, alt))
        position, speed, _ = self._over_ground.variances
        vertical, climb, _ = self._height.filter.variances
        self.publish(
            imc.NavigationUncertainty(
                x=position,
                y=position,
                z=vertical + self.pressure_drift**2,
                phi=ATTITUDE_VARIANCE,
                theta=ATTITUDE_VARIANCE,
                psi=ATTITUDE_VARIANCE,
                p=RATE_VARIANCE,
                q=RATE_VARIANCE,
                r=RATE_VARIANCE,
                u=speed,
                v=speed,
                w=climb,
            )
        )

    def _update_entity_state(self) -> None:
        """Set the state of the entity."""
        now = self.now
        if report := self._impossible.report(now):
            self.log.warning(report)
        if self._reference is None:
            lacks = "height" if self.age(self._fixed) <= self.gps_timeout and not self._first else "fix"
            missing = f"GPS {lacks}" if len(self._first) < self._needed else "attitude and pressure"
            self.set_entity_state(State.BOOT, f"waiting for {missing}")
        elif self.age(self._oriented) > self.euler_timeout:
            stuck, impossible = self._attitude_noise.stuck, self._range.rejects(now)
            why = missing_reason(stuck=stuck, jumps=self._check.rejects, impossible=impossible)
            self.set_entity_state(State.ERROR, f"attitude {why}")
        elif self.now_without_stalls - self._height.pressed > self.pressure_timeout:
            why = self._height.barometer.missing_reason(jumps=self._height.rejects_pressure)
            self.set_entity_state(State.ERROR, f"pressure {why}")
        elif self.age(self._fixed) > self.gps_timeout:
            self.set_entity_state(State.ERROR, "GPS fixes are missing")
        elif self.age(self._accepted_at) > self.gps_timeout:
            self.set_entity_state(State.ERROR, "GPS fixes jump")
        elif self._turned_at > -math.inf and self.age(self._turned_at) > self.euler_timeout:
            self.set_entity_state(State.ERROR, "turn rates are missing")
        elif self._acceleration.last > -math.inf and self.age(self._acceleration.last) > self.euler_timeout:
            self.set_entity_state(State.ERROR, "accelerations are missing")
        elif self._check.fault or now < self._held_until:
            self.set_entity_state(State.ERROR, self._check.fault or self._held_fault)
        else:
            self.set_entity_state(State.NORMAL, "active")
