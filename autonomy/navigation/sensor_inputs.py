"""Measurements of an underwater vehicle's sensors between two steps of navigation."""

import math

import imc
from autonomy.navigation.attitude_range import LARGEST_PITCH, LARGEST_ROLL, AttitudeRange
from autonomy.navigation.fault_detection import GateDecision, JumpGate, StuckDetector
from autonomy.navigation.impossible_values import ImpossibleValues
from autonomy.navigation.sample_mean import SampleMean
from autonomy.navigation.underwater_settings import UnderwaterSettings
from autonomy.navigation.validation_gates import (
    DEEPEST,
    HIGHEST,
    LARGEST_RATE,
    DvlReason,
    FixGate,
    Reason,
    VelocityGate,
    assume_height,
    has_plausible_position,
)
from support.rotations import Vector, wrap

VEL_X_AND_Y = int(imc.GroundVelocity.Validity.VEL_X | imc.GroundVelocity.Validity.VEL_Y)
VEL_Z = int(imc.GroundVelocity.Validity.VEL_Z)
UNKNOWN_ALTITUDE = -1.0
LIE = 2.0  # m/s between velocity log and motor that no current explains
STOPPED = 0.5  # m/s backward at most of a vehicle that is held fast
ALTITUDE_JUMP, ALTITUDE_SHARE = 2.0, 0.2  # m, and of the altitude: a larger change needs
ALTITUDE_JUMPS = 5  # samples that agree


class SensorInputs:
    """Rejects invalid measurements and averages the rest: `euler`, `rates`, `depth`, velocities over `ground`, `water`.

    Times are in s since 1970, -inf if there was no such measurement; angles in rad, velocities in m/s. `fix` is the
    last fix that was accepted, `place` the manual one. `impossible` counts what no sound sensor gives. `sinking` has
    the times and vertical speeds over ground since the last step, `pitch` the time of the newest depth and the pitch.
    """

    def __init__(self, settings: UnderwaterSettings):
        self.apply_settings(settings)
        self.restart(math.inf)

    def apply_settings(self, settings: UnderwaterSettings) -> None:
        """Use other settings; the gates start anew."""
        self.settings = settings
        jumps, largest = settings.dvl_jumps, settings.dvl_largest
        self._ground_gate, self._water_gate = (
            VelocityGate((jumps[0], jumps[1]), (largest[0], largest[1]), settings.dvl_jump_window) for _ in range(2)
        )
        self._fix_gate = FixGate(settings.gps_factor, settings.gps_samples, settings.gps_hacc, settings.gps_hdop)

    def restart(self, dvl_time: float) -> None:
        """Forget all measurements; the silence of the velocity log counts from `dvl_time` (s), inf without one."""
        self.euler: SampleMean = SampleMean()
        self.rates: SampleMean = SampleMean()
        self.depth: SampleMean = SampleMean()
        self.ground: SampleMean = SampleMean()
        self.water: SampleMean = SampleMean()
        self.fix: imc.GpsFix | None = None
        self._height = 0.0  # of the last fix, for those without
        self.place: imc.GpsFix | None = None
        self.dvl_time: float = dvl_time
        self.rpm: int = 0
        self.altitude: float = UNKNOWN_ALTITUDE
        self.rpm_time: float = -math.inf
        self.altitude_time: float = -math.inf
        self.pitch: tuple[float, float] = (-math.inf, 0.0)
        self.sinking: list[tuple[float, float]] = []
        self._newest_attitude = 0.0, 0.0  # roll, pitch
        self.velocity: Vector = (0.0, 0.0, 0.0)
        self.velocity_time: float = -math.inf
        self.heave_time: float = -math.inf
        self.contradiction_time: float = -math.inf
        self.velocity_fault = ""  # why velocities are not used, for people
        self.impossible: ImpossibleValues = ImpossibleValues()
        self.attitude_range: AttitudeRange = AttitudeRange(LARGEST_ROLL, LARGEST_PITCH)
        self.attitude_noise: StuckDetector = StuckDetector()
        self.altitude_noise: StuckDetector = StuckDetector()
        self.ground_noise: StuckDetector = StuckDetector()
        self.water_noise: StuckDetector = StuckDetector()
        self._altitude_gate = JumpGate(ALTITUDE_JUMPS, ALTITUDE_JUMP)
        self._turns = 0.0

    def receive_attitude(self, now: float, phi: float, theta: float, psi: float) -> None:
        possible = self.attitude_range.accepts(now, phi, theta, psi)
        if self.impossible.accepts("attitude", possible) and not self.attitude_noise.update(phi + theta + psi):
            self._turns += wrap(psi - self._turns)
            self.euler.add(now, phi, theta, self._turns)
            self._newest_attitude = phi, theta

    def receive_rates(self, now: float, p: float, q: float, r: float) -> None:
        if self.impossible.accepts_within("turn rates", LARGEST_RATE, p, q, r):
            self.rates.add(now, p, q, r)

    def receive_depth(self, now: float, depth: float, measured: float | None = None) -> None:
        """A depth (m); a computer that is late receives it `now` (s), long after it was `measured` (s since 1970)."""
        measured = now if measured is None else measured
        if self.impossible.accepts("depth", HIGHEST <= depth <= DEEPEST):
            self.depth.add(now, depth, measured)
            self.pitch = measured, self._newest_attitude[1]

    def receive_distance(self, now: float, measured: float) -> None:
        """A distance to the bottom (m)."""
        if not self.impossible.accepts("distance", 0.0 <= measured <= DEEPEST):
            return
        if self.altitude_noise.update(measured) and measured:
            return
        phi, theta, _ = self.euler.value
        if self.settings.altitude_compensation:
            measured *= math.cos(phi) * math.cos(theta)
        before = self.altitude if self.altitude >= 0.0 else measured
        change = measured - before
        decision = self._altitude_gate.evaluate(abs(change) > ALTITUDE_JUMP + ALTITUDE_SHARE * before, change)
        if decision is GateDecision.REJECTED:
            return
        reset = decision is GateDecision.RESET
        self.altitude = measured if reset else before + self.settings.altitude_gain * change
        self.altitude_time = now

    def expire_altitude(self, now: float) -> None:
        """Forget an altitude that is too old."""
        if now - self.altitude_time > self.settings.altitude_timeout:
            self.altitude = UNKNOWN_ALTITUDE

    def receive_rpm(self, now: float, rpm: int) -> None:
        if self.impossible.accepts_within("rpm", self.settings.dvl_largest[0], rpm * self.settings.speed_per_rpm):
            self.rpm, self.rpm_time = rpm, now

    def receive_velocity(
        self, now: float, velocity: imc.GroundVelocity | imc.WaterVelocity, measured: float | None = None
    ) -> imc.DvlRejection | None:
        """A velocity of the velocity log; returns why it is rejected, None if it is not."""
        numbers = velocity.x, velocity.y, velocity.z
        self.dvl_time = now
        if velocity.validity & VEL_X_AND_Y != VEL_X_AND_Y:
            return None
        if not self.impossible.accepts("velocity", all(map(math.isfinite, numbers))):
            return None
        heave = velocity.validity & VEL_Z and abs(velocity.z) <= self.settings.dvl_largest[1]
        over_ground = isinstance(velocity, imc.GroundVelocity)
        gate, mean = (self._ground_gate, self.ground) if over_ground else (self._water_gate, self.water)
        reason = gate.reject_reason(now, velocity.x, velocity.y)
        if reason is None and over_ground and self._contradicts_motor(now, velocity.x):
            self.contradiction_time, reason = now, (DvlReason.INNOV_THRESHOLD_X, velocity.x)
        if reason is not None:
            kind = imc.DvlRejection.Type.GV if over_ground else imc.DvlRejection.Type.WV
            elapsed = min(now - mean.last, self.settings.dvl_timeout)
            return imc.DvlRejection(type=kind, reason=reason[0], value=reason[1], timestep=elapsed)
        y = velocity.y - self.settings.dvl_arm * self.rates.value[2]
        if (self.ground_noise if over_ground else self.water_noise).update(velocity.x + velocity.y):
            return None
        if over_ground:
            self.velocity, self.velocity_time = (velocity.x, y, velocity.z), now
            if heave:
                self.heave_time = now
                phi, theta = self._newest_attitude
                across = math.sin(phi) * y + math.cos(phi) * velocity.z
                sinking = -math.sin(theta) * velocity.x + math.cos(theta) * across
                self.sinking.append((now if measured is None else measured, sinking))
        if not self.velocity_fault:
            mean.add(now, velocity.x, y, velocity.z if heave else self.ground.value[2])
        return None

    def receive_dvl_activation(self, now: float, active: bool) -> None:
        """Do not wait for a velocity log that was switched off, until it measures again."""
        self.dvl_time = now if active else math.inf

    def receive_fix(self, fix: imc.GpsFix) -> imc.GpsFixRejection | None:
        """A fix; returns why it is rejected, None if it is not."""
        fix = assume_height(fix, self._height)
        if fix.type == imc.GpsFix.Type.MANUAL_INPUT:
            self.place = fix if has_plausible_position(fix) else self.place
            return None
        reason = self._fix_gate.reject_reason(fix)
        if reason is None and not has_plausible_position(fix):
            reason = Reason.INVALID
        if reason is not None:
            return imc.GpsFixRejection(utc_time=fix.utc_time, reason=reason)
        self.fix, self._height = fix, fix.height
        return None

    def lacks_velocity(self, now: float) -> bool:
        """Whether velocities are missing, both over ground and through the water."""
        return now - max(self.ground.last, self.water.last) > self.settings.dvl_timeout

    def _contradicts_motor(self, now: float, surge: float) -> bool:
        """Whether a surge (m/s) is backward or ahead of the motor by more than a current; a stop is possible."""
        motor = self.settings.speed_per_rpm * self.rpm
        ahead = surge if motor >= 0.0 else -surge
        off = abs(surge - motor) > LIE and not -STOPPED <= ahead <= abs(motor)
        return off and now - self.rpm_time < self.settings.dvl_timeout
