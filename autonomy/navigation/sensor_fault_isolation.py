"""Compares the sensors of an underwater vehicle with each other, and finds the faulty ones."""

import math
from typing import Protocol

import imc
from autonomy.navigation.cross_checks import AttitudeCheck, DepthCheck
from autonomy.navigation.fault_detection import GateDecision, missing_reason
from autonomy.navigation.gnss_drift import FixDriftDetector
from autonomy.navigation.gnss_position_correction import PositionEstimate, fix_variance
from autonomy.navigation.horizontal_filter import PSI
from autonomy.navigation.sensor_inputs import UNKNOWN_ALTITUDE, SensorInputs
from autonomy.navigation.underwater_estimator import PATIENCE, UnderwaterEstimator
from autonomy.navigation.validation_gates import FAULT_HOLD, GPS_JUMP

DEPTHS = 20  # samples that agree before a jump of theirs is accepted
COMPARABLE_AGE = 1.0  # s, largest age of a velocity that is compared with others
SLOW = 0.3  # m/s, least speed of the motor that is compared with others
DEEP_FIXES = 10  # fixes under water at the vehicle's place before depth is doubted
SURFACED = 10.0  # s; after a longer time without fixes the position, not GPS, has moved away
SURFACE, AFLOAT = 1.0, 0.2  # m, by motor and by velocity; nothing rises above it
UNKNOWN_MOTION = 0.5  # s without samples, after which a depth is not predicted


class WarningLog(Protocol):
    """Receiver of warnings for people."""

    def warning(self, text: str) -> object: ...


class SensorChecks:
    """Feeds attitude and depth to the filters of an estimator, and rejects sensors that jump, are stuck, or contradict.

    `began` is the time (s since 1970) from which a sensor may be missed; `attitude_time` is that of the last attitude.
    """

    def __init__(self, inputs: SensorInputs, estimator: UnderwaterEstimator, log: WarningLog, began: float):
        self._inputs = inputs
        self._estimator = estimator
        self._log = log
        self._began = self._turned = began
        self._attitude = AttitudeCheck(max(1, round(PATIENCE * inputs.settings.execution_frequency)))
        self._depth = DepthCheck(DEPTHS, inputs.settings.dvl_misalignment)
        self.attitude_time: float = -math.inf
        self._depth_time = -math.inf
        self._fix_time = -math.inf
        self._deep_fix_time = -math.inf
        self._deep_fixes, self._fix_drift = 0, FixDriftDetector()
        self._held_fault, self._held_until = "", -math.inf

    @property
    def depth_error_bound(self) -> float:
        """Greatest error of a faulty depth (m), 0 if it is sound."""
        return self._depth.disagreement if self._depth.fault else 0.0

    def resume(self, stall: float) -> None:
        """Compare nothing across a time of `stall` s in which the process stood still and the vehicle moved on.

        `now` in all methods is a time without stalls, so that they make nothing old.
        """
        self._attitude.resume()
        self._fix_drift.resume()
        if stall > UNKNOWN_MOTION:
            self._fix_time = -math.inf
            self._depth.resume()
            self._estimator.vertical.resume()

    def update_attitude(self, now: float) -> bool:
        """Take the mean attitude, unless it jumps; whether there is a new one."""
        euler, rates, position = self._inputs.euler, self._inputs.rates, self._estimator.position
        before = euler.value
        if not euler.update():
            return False
        fresh = now - rates.last <= self._inputs.settings.euler_timeout
        elapsed, self._turned = now - self._turned, now
        decision = self._attitude.evaluate(elapsed, euler.value, rates.interval_mean if fresh else None)
        if decision is GateDecision.REJECTED:
            euler.value = before
            return False
        self.attitude_time = euler.last
        if decision is GateDecision.RESET:
            self._log.warning("the attitude has jumped and stays there")
            if position is not None:
                position.filter.p[PSI][PSI] += self._attitude.jump**2
        return True

    def update_depth(self, now: float, dt: float) -> None:
        """Take the mean depth, unless it jumps."""
        inputs, vertical = self._inputs, self._estimator.vertical
        seen = now - inputs.heave_time <= COMPARABLE_AGE and inputs.heave_time == inputs.velocity_time
        speed = self._motor_speed(now)
        driven = speed is not None and speed > SLOW
        self._record_vertical_speeds(speed if driven else None)
        self._depth.advance(dt, seen=seen, driven=driven, speed=abs(inputs.velocity[0]) if seen else 0.0)
        if not inputs.depth.update():
            return
        (depth, measured, _), noise = inputs.depth.value, self._inputs.settings.depth_variance
        innovation = depth - vertical.depth if vertical.has_depth else 0.0
        variance = noise + (vertical.variances[0] if vertical.has_depth else 0.0)
        decision = self._depth.evaluate(measured, depth, innovation, variance)
        if decision is GateDecision.REJECTED:
            return
        self._depth_time = now
        if decision is GateDecision.RESET:
            self._log.warning(f"the depth has jumped by {innovation:.1f} m and stays there")
            vertical.reset(depth, noise)
        vertical.measure_depth(depth, noise)

    def _record_vertical_speeds(self, by_motor: float | None) -> None:
        """Take the vertical speeds by velocity log and motor (m/s), unless the attitude that they need jumps."""
        inputs, depth = self._inputs, self._estimator.vertical.depth
        speeds, inputs.sinking = inputs.sinking, []
        if self._attitude.rejects:
            return
        for time, sinking in speeds:
            self._depth.receive_velocity(time, max(0.0, sinking) if depth < AFLOAT else sinking)
        time, theta = inputs.pitch
        if by_motor is None:
            self._depth.receive_motor(time, None)
        elif time > -math.inf:
            sinking = -math.sin(theta) * by_motor
            self._depth.receive_motor(time, max(0.0, sinking) if depth < SURFACE else sinking)

    def _motor_speed(self, now: float) -> float | None:
        """Surge by the speed of the motor (m/s); None if that is unknown."""
        if now - self._inputs.rpm_time > self._inputs.settings.dvl_timeout:
            return None
        return self._inputs.rpm * self._estimator.speed_per_rpm

    def update_velocity_fault(self, now: float) -> None:
        """Reject the velocity log while it contradicts depth and motor."""
        inputs, before = self._inputs, self._inputs.velocity_fault
        inputs.velocity_fault = "its velocity contradicts depth and motor" if self._depth.velocity_faulty else ""
        if now - inputs.contradiction_time < COMPARABLE_AGE:
            inputs.velocity_fault = "its velocity contradicts the motor"
        if inputs.velocity_fault and not before:
            self._log.warning(f"{self._inputs.settings.dvl or 'the velocity log'} is rejected: {inputs.velocity_fault}")

    def is_submerged(self) -> bool:
        """Whether the antenna is under water, where it has no reception."""
        vertical = self._estimator.vertical
        return vertical.has_depth and not vertical.depth <= self._inputs.settings.gps_deepest

    def evaluate_fix(self, now: float, fix: imc.GpsFix, submerged: bool) -> bool:
        """Whether to use a fix; those under water at the vehicle's place mean that the depth lies."""
        if not submerged:
            self._deep_fixes = 0
            self._depth.reset_drift()
            if self._fix_drift.update(now, fix):
                self._held_fault, self._held_until = "GPS drifts away from its own speed", now + FAULT_HOLD
            return True
        position = self._estimator.position
        agrees = position is None or position.agrees(fix, fix_variance(fix, self._inputs.settings.gps_variances))
        self._deep_fixes, self._deep_fix_time = (self._deep_fixes + 1 if agrees else 0), now
        if self._deep_fixes >= DEEP_FIXES:
            self._held_fault, self._held_until = "fixes under water: depth or GPS is wrong", now + FAULT_HOLD
        return position is None and self._deep_fixes >= DEEP_FIXES

    def check_position_reset(self, now: float, position: PositionEstimate, decision: GateDecision) -> None:
        """Report that fixes have reset the position; a receiver that jumps ends a plan."""
        if decision is GateDecision.RESET:
            self._fix_drift.reset()
            self._log.warning("fixes contradict the position, which is reset to theirs")
            if now - self._fix_time <= SURFACED and position.jump > GPS_JUMP:
                self._held_fault = f"GPS has jumped by {position.jump:.0f} m"
                self._held_until = now + FAULT_HOLD
        if decision is not GateDecision.REJECTED:
            self._fix_time = now

    def fault(self, now: float) -> str:
        """Reason why the vehicle must come up; empty if it need not."""
        inputs, settings, began = self._inputs, self._inputs.settings, self._began
        if now - max(self.attitude_time, began) > settings.euler_timeout:
            stuck, impossible = inputs.attitude_noise.stuck, inputs.attitude_range.rejects(now)
            return f"attitude {missing_reason(stuck=stuck, jumps=self._attitude.rejects, impossible=impossible)}"
        if -math.inf < inputs.rates.last < self.attitude_time - settings.euler_timeout:
            return "turn rates are missing"
        if now - max(self._depth_time, began) > settings.depth_timeout:
            return f"depth {missing_reason(stuck=False, jumps=self._depth.rejects)}"
        if 0.0 < settings.dvl_silence < now - inputs.dvl_time:
            return f"{settings.dvl or 'the velocity log'} is silent"
        self._attitude.set_hysteresis(bool(self._attitude.fault))
        fault = self._attitude.fault or self._depth.fault
        if fault:
            self._held_fault, self._held_until = fault, now + FAULT_HOLD
        return self._held_fault if now < self._held_until else ""

    def status(self, now: float) -> str:
        """Sensors that navigation uses, for people: names the optional sensors that are silent or rejected."""
        inputs, position = self._inputs, self._estimator.position
        silent = ["DVL"] if inputs.lacks_velocity(now) else []
        silent += ["altitude"] if inputs.altitude == UNKNOWN_ALTITUDE else []
        text = f"active without {' and '.join(silent)}" if silent else "active"
        if inputs.velocity_fault:
            text += f"; DVL: {inputs.velocity_fault}"
        if position is not None and position.has_rejected_fix:
            text += "; GPS: contradicts the position"
        if now - self._deep_fix_time < FAULT_HOLD:
            text += "; GPS: has fixes under water"
        return text
