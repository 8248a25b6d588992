"""Sensors of an underwater vehicle, compared with each other."""

import math

import imc
from runtime import param
from tasks.navigation.auv.checks import AttitudeCheck, DepthCheck
from tasks.navigation.auv.consistency import JumpGate, Verdict, plight
from tasks.navigation.auv.depth_filter import DepthFilter
from tasks.navigation.auv.gates import GPS_JUMP, SHOWN
from tasks.navigation.auv.horizontal_filter import PSI, K
from tasks.navigation.auv.inputs import UNKNOWN_ALTITUDE, Sensors
from tasks.navigation.auv.position import Position, fix_variance

VERTICAL_ACCELERATION = 0.1  # m/s², over a second
PATIENCE = 1.0  # s of attitudes that agree before a jump of theirs is believed
DEPTHS = 20  # samples that agree before a jump of theirs is believed
HEARD = 1.0  # s, largest age of a velocity that is compared with others
SLOW = 0.3  # m/s, least speed of the motor that is compared with others
DEEP_FIXES = 10  # fixes under water at the vehicle's place before depth is doubted
SURFACED = 10.0  # s; after a longer time without fixes the position, not GPS, has moved away
SURFACE = 1.0  # m; nothing rises above it
RATE_JUMP = 1.0  # rad/s


class CheckedSensors(Sensors):
    """Filters depth, and rejects sensors that jump, are stuck, or contradict the others."""

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

    def start(self) -> None:
        super().start()
        self._began = self.now
        self._vertical = DepthFilter(VERTICAL_ACCELERATION, self.initial_depth)
        self._position: Position | None = None
        patience = max(1, round(PATIENCE * self.execution_frequency))
        self._attitude, self._rate_gate = AttitudeCheck(patience), JumpGate(patience, RATE_JUMP)
        self._depth_check = DepthCheck(DEPTHS)
        self._turned = self.now
        self._oriented = self._plumbed = self._fixed = self._deep_fix_at = -math.inf
        self._deep_fixes = 0
        self._held_fault, self._held_until = "", -math.inf

    def _take_attitude(self) -> bool:
        """Take the mean attitude, unless it jumps; whether there is a new one."""
        before = self.euler.value
        if not self.euler.take():
            return False
        now = self.now
        fresh = now - self.rates.last <= self.euler_timeout
        elapsed, self._turned = now - self._turned, now
        verdict = self._attitude.judge(elapsed, self.euler.value, self.rates.between if fresh else None)
        if verdict is Verdict.REJECTED:
            self.euler.value = before
            return False
        self._oriented = self.euler.last
        if verdict is Verdict.BELIEVED:
            self.log.warning("the attitude has jumped and stays there")
            if self._position is not None:
                self._position.filter.p[PSI][PSI] += self._attitude.jump**2
        return True

    def _take_depth(self, dt: float) -> None:
        """Take the mean depth, unless it jumps."""
        phi, theta, _ = self.euler.value
        by_velocity = by_motor = None
        if self.now - self.heave_at <= HEARD and self.heave_at == self.velocity_at:
            u, v, w = self.velocity
            by_velocity = -math.sin(theta) * u + math.cos(theta) * (math.sin(phi) * v + math.cos(phi) * w)
        speed = self._speed_of_motor
        if speed is not None and speed > SLOW:
            by_motor = -math.sin(theta) * speed
            if by_motor < 0.0 and self._vertical.depth < SURFACE:
                by_motor = 0.0
        self._depth_check.sink(dt, by_velocity, by_motor)
        if not self.depth.take():
            return
        depth, vertical = self.depth.value[0], self._vertical
        innovation = depth - vertical.depth if vertical.known else 0.0
        variance = self.depth_variance + (vertical.variances[0] if vertical.known else 0.0)
        verdict = self._depth_check.judge(depth, innovation, variance)
        if verdict is Verdict.REJECTED:
            return
        self._plumbed = self.now
        if verdict is Verdict.BELIEVED:
            self.log.warning(f"the depth has jumped by {innovation:.1f} m and stays there")
            vertical.settle(depth, self.depth_variance)
        vertical.measure_depth(depth, self.depth_variance)

    @property
    def _speed_of_motor(self) -> float | None:
        """Surge by the speed of the motor (m/s); None if that is unknown."""
        if self.now - self.revolved > self.dvl_timeout:
            return None
        return self.rpm * (self._position.filter.x[K] if self._position is not None else self.speed_per_rpm)

    def _doubt_velocity(self) -> None:
        """Reject the velocity log while it contradicts depth and motor."""
        before = self.velocity_doubt
        self.velocity_doubt = "its velocity contradicts depth and motor" if self._depth_check.velocity_lies else ""
        if self.now - self.contradicted < HEARD:
            self.velocity_doubt = "its velocity contradicts the motor"
        if self.velocity_doubt and not before:
            self.log.warning(f"{self.dvl or 'the velocity log'} is rejected: {self.velocity_doubt}")

    def _is_submerged(self, fix: imc.GpsFix) -> bool:
        """Reject a fix that claims reception under water; those at the vehicle's place mean that the depth lies."""
        if not self._vertical.known or self._vertical.depth <= self.gps_deepest:
            self._deep_fixes = 0
            return False
        position = self._position
        self.publish(imc.GpsFixRejection(utc_time=fix.utc_time, reason=imc.GpsFixRejection.Reason.INVALID))
        agrees = position is None or position.agrees(fix, fix_variance(fix, self.gps_variances))
        self._deep_fixes, self._deep_fix_at = (self._deep_fixes + 1 if agrees else 0), self.now
        if self._deep_fixes >= DEEP_FIXES:
            self._held_fault, self._held_until = "fixes under water: depth or GPS is wrong", self.now + SHOWN
        return position is not None or self._deep_fixes < DEEP_FIXES

    def _note_fix(self, position: Position, verdict: Verdict) -> None:
        """Say that fixes have reset the position; a receiver that jumps ends a plan."""
        if verdict is Verdict.BELIEVED:
            self.log.warning("fixes contradict the position, which is reset to theirs")
            if self.now - self._fixed <= SURFACED and position.jump > GPS_JUMP:
                self._held_fault = f"GPS has jumped by {position.jump:.0f} m"
                self._held_until = self.now + SHOWN
        if verdict is not Verdict.REJECTED:
            self._fixed = self.now

    def _fault(self) -> str:
        """Why the vehicle must come up; empty if it need not."""
        now, began = self.now, self._began
        if now - max(self._oriented, began) > self.euler_timeout:
            return f"attitude {plight(stuck=self.attitude_noise.stuck, jumps=self._attitude.rejects)}"
        if -math.inf < self.rates.last < self._oriented - self.euler_timeout:
            return "turn rates are missing"
        if now - max(self._plumbed, began) > self.depth_timeout:
            return f"depth {plight(stuck=False, jumps=self._depth_check.rejects)}"
        if 0.0 < self.dvl_silence < now - self.spoken:
            return f"{self.dvl or 'the velocity log'} is silent"
        self._attitude.remember(bool(self._attitude.fault))
        fault = self._attitude.fault or self._depth_check.fault
        if fault:
            self._held_fault, self._held_until = fault, now + SHOWN
        return self._held_fault if now < self._held_until else ""

    def _aids(self) -> str:
        """The description of the entity: names the optional sensors that are silent or rejected."""
        silent = ["DVL"] if self.now - max(self.ground.last, self.water.last) > self.dvl_timeout else []
        silent += ["altitude"] if self.altitude == UNKNOWN_ALTITUDE else []
        text = f"active without {' and '.join(silent)}" if silent else "active"
        if self.velocity_doubt:
            text += f"; DVL: {self.velocity_doubt}"
        if self._position is not None and self._position.contradicted:
            text += "; GPS: contradicts the position"
        if self.now - self._deep_fix_at < SHOWN:
            text += "; GPS: has fixes under water"
        return text
