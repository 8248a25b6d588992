"""Checks of attitude and depth against rates, velocities and the motor: they find a sensor that lies."""

import math

from autonomy.navigation.fault_detection import CumulativeSum, Disagreement, GateDecision, JumpGate
from autonomy.navigation.speed_integral import SpeedIntegral
from support.rotations import Vector, wrap

MEMORY = 30.0  # s
LARGEST_LAG = 2.0  # m
LARGEST_LAG_OF_MOTOR = 4.0  # m; heave does not depend on the motor
POWERED = 5.0  # s of a running motor before it is a witness
BLIND = 5.0  # s without velocities, after which the motor alone is compared with the depth
RELIEF = 0.5  # the share of a limit at which a fault is over
ACCUSED = 0.3  # the share of a disagreement that a third witness may have with the honest one of two
DEPTH_JUMP = 1.0  # m
SIGMAS = 5.5
DRIFT = 2.0  # m beyond what misalignment and scale explain
SCALE = 0.03  # of the way down and up: density of the water, scale of the sensor
WANDERING = 0.002  # m/s, of a sound depth sensor
ABOVE_SURFACE = -1.0  # m; a sound sensor shows no such depth
ABOVE_LONGEST = 5.0  # s of it
STUCK = 15.0  # s with exactly the same depth; a sensor has noise
STUCK_WAY = 0.4  # m downward meanwhile, by the velocities
NOT_FOLLOWING = "depth does not follow the vertical speed"
ANGLE_JUMP = math.radians(10.0)
FASTEST = 2.0  # rad/s, of a turn that the rates do not show
LONGEST = 1.0  # s, of such a turn
LEAN_LAG, HEADING_LAG = math.radians(15.0), math.radians(20.0)
TURN_MEMORY = 20.0  # s
STEEP = 0.3  # cosine of a pitch at which roll and heading are poorly defined


class AttitudeCheck:
    """Compares roll, pitch and heading (rad) with the turn rates (rad/s)."""

    def __init__(self, count: int):
        self._gate = JumpGate(count, math.radians(5.0))
        self._angles: Vector | None = None
        self._roll, self._pitch, self._heading = (Disagreement(TURN_MEMORY) for _ in range(3))
        self.jump: float = 0.0
        self._patience = 1.0

    @property
    def rejects(self) -> bool:
        """Whether the latest attitude was rejected."""
        return self._gate.rejected > 0

    def resume(self) -> None:
        """Take the next attitude as it is: it is unknown how the vehicle has turned since the last one."""
        self._angles = None

    def evaluate(self, elapsed: float, angles: Vector, rates: Vector | None) -> GateDecision:
        """Judge an attitude `elapsed` s after the previous one; `rates` is None if they are unknown."""
        phi, theta, psi = angles
        if self._angles is None:
            self._angles = angles
            return GateDecision.ACCEPTED
        a, b, c = self._angles
        roll, pitch, heading = phi - a, theta - b, psi - c
        level = math.cos(theta)
        steep = level < STEEP
        if rates is not None and not steep:
            (p, q, r), sr, cr = rates, math.sin(phi), math.cos(phi)
            turning = (sr * q + cr * r) / level
            roll -= elapsed * (p + math.sin(theta) * turning)
            pitch -= elapsed * (cr * q - sr * r)
            heading -= elapsed * turning
        roll, heading = wrap(roll), wrap(heading)
        limit = ANGLE_JUMP + FASTEST * min(LONGEST, elapsed)
        largest = abs(pitch) if steep else max(abs(roll), abs(pitch), abs(heading))
        verdict = self._gate.evaluate(not largest <= limit, roll, pitch, heading)
        if verdict is GateDecision.REJECTED:
            self._angles = phi - roll, theta - pitch, psi - heading  # continues with the rates
            return verdict
        self._angles, self.jump = angles, heading
        if rates is not None and not steep:
            self._roll.add(elapsed, roll)
            self._pitch.add(elapsed, pitch)
            self._heading.add(elapsed, heading)
        return verdict

    @property
    def fault(self) -> str:
        """Fault, for people; empty without one."""
        if abs(self._heading.value) > HEADING_LAG * self._patience:
            return "heading does not follow the turn rate"
        return self.tilt_fault

    @property
    def tilt_fault(self) -> str:
        """Fault of roll or pitch; empty without one."""
        if abs(self._pitch.value) > LEAN_LAG * self._patience:
            return "pitch does not follow the turn rate"
        return "roll does not follow the turn rate" if abs(self._roll.value) > LEAN_LAG * self._patience else ""

    def set_hysteresis(self, faulty: bool) -> None:
        """Hold a fault until the disagreement is half as large as the one that began it."""
        self._patience = RELIEF if faulty else 1.0


class DepthCheck:
    """Compares depth (m) with the vertical speed by velocity log and attitude, and by motor and attitude (m/s).

    All are compared at the times at which they were measured. `fault` is the text for people on a wrong depth,
    `velocity_faulty` whether depth and motor contradict the velocity. `misalignment` (rad) is the largest one between
    velocity log and attitude reference: it explains a slow drift.
    """

    def __init__(self, count: int, misalignment: float):
        self._gate = JumpGate(count, DEPTH_JUMP)
        self._misalignment = misalignment
        self._velocity, self._motor, self._drift = Disagreement(MEMORY), Disagreement(MEMORY), CumulativeSum()
        self._by_velocity, self._by_motor = SpeedIntegral(), SpeedIntegral()
        self._depth = math.nan
        self._elapsed = self._powered = self._blind = self._allowance = 0.0
        self._same, self._way, self._above = 0.0, 0.0, 0.0
        self.velocity_faulty: bool = False
        self.fault: str = ""

    def receive_velocity(self, time: float, sinking: float) -> None:
        """Take a speed downward (m/s) that velocity log and attitude showed at a time (s)."""
        self._by_velocity.add(time, sinking)

    def receive_motor(self, time: float, sinking: float | None) -> None:
        """Take the speed downward (m/s) that the motor gives at the attitude of a time (s); None if it is unknown."""
        if sinking is None:
            self._by_motor.forget()
        else:
            self._by_motor.add(time, sinking)

    def advance(self, dt: float, *, seen: bool, driven: bool, speed: float = 0.0) -> None:
        """Advance by `dt` s, at a speed (m/s); whether velocity log and motor show how the vehicle moves."""
        self._elapsed += dt
        self._powered = self._powered + dt if driven else 0.0
        self._blind = 0.0 if seen else self._blind + dt
        sinking = abs(self._by_velocity.speed) if seen else 0.0
        self._allowance += dt * (WANDERING + self._misalignment * speed + SCALE * sinking)

    def reset_drift(self) -> None:
        """Forget a drift: the vehicle is at the surface, and so is its depth."""
        self._drift.reset()

    def resume(self) -> None:
        """Take the next depth as it is: it is unknown how the vehicle has sunk since the last one."""
        self._depth = math.nan
        self._by_velocity.skip()
        self._by_motor.skip()
        self._elapsed = self._allowance = 0.0

    def evaluate(self, time: float, depth: float, innovation: float, variance: float) -> GateDecision:
        """Judge a depth measured at a time (s) by its innovation (m) and the variance of that."""
        surprising = not abs(innovation) <= DEPTH_JUMP + SIGMAS * math.sqrt(variance)
        verdict = self._gate.evaluate(surprising, innovation)
        if verdict is not GateDecision.REJECTED:
            change, self._depth = depth - self._depth, depth
            sunk, driven = self._by_velocity.take(time), self._by_motor.take(time)
            self._watch_same(change, sunk, driven)
            for lag, way in (self._velocity, sunk), (self._motor, driven):
                difference = change - way
                lag.add(self._elapsed, 0.0 if math.isnan(difference) else difference)
            if verdict is GateDecision.ACCEPTED and not math.isnan(change - sunk):
                self._drift.add(change - sunk, self._allowance)
            self._above = self._above + self._elapsed if depth < ABOVE_SURFACE else 0.0
            self._elapsed = self._allowance = 0.0
            self._compare()
        return verdict

    def _watch_same(self, change: float, *ways: float) -> None:
        """Sum up how far the vehicle sinks while the depth is exactly the same."""
        if change != 0.0:
            self._same = self._way = 0.0
            return
        self._same += self._elapsed
        self._way += next((way for way in ways if not math.isnan(way)), 0.0)

    @property
    def rejects(self) -> bool:
        """Whether the latest depth was rejected."""
        return self._gate.rejected > 0

    @property
    def disagreement(self) -> float:
        """Disagreement of depth and vertical speed (m)."""
        return max(abs(self._velocity.value), abs(self._motor.value), self.drift)

    @property
    def drift(self) -> float:
        """Drift of the depth from the vertical speed, beyond the allowed one (m)."""
        return self._drift.value

    def _compare(self) -> None:
        """Find out whether the depth or the velocity lies, and hold that until the disagreement is half as large."""
        velocity, motor = abs(self._velocity.value), abs(self._motor.value)
        if self.velocity_faulty:
            self.velocity_faulty = velocity > RELIEF * LARGEST_LAG
            self._drift.reset()
            return
        patience = RELIEF if self.fault == NOT_FOLLOWING else 1.0
        witness = not self.fault and motor < ACCUSED * velocity and self._powered > POWERED
        self.velocity_faulty = velocity > LARGEST_LAG and witness
        blind = self._blind > BLIND and motor > LARGEST_LAG_OF_MOTOR * patience
        wrong = blind or (velocity > LARGEST_LAG * patience and not self.velocity_faulty)
        stuck = self._same > STUCK and self._way > STUCK_WAY
        if wrong:
            self.fault = NOT_FOLLOWING
        elif stuck:
            self.fault = "depth is stuck"
        elif self._above > ABOVE_LONGEST:
            self.fault = "depth is above the surface"
        else:
            self.fault = "depth drifts away from the vertical speed" if self.drift > DRIFT else ""
