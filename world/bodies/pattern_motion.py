"""A vehicle that moves smoothly along a pattern, without forces."""

import math

from support.rotations import Vector, rotation, to_body, wrap
from world.bodies.path_patterns import MinimumJerkRamp, Pattern

GRAVITY = 9.80665
MAXIMUM_STEP = 0.02  # s
HEADING_GAIN = 0.5  # 1/s
YAW_BANDWIDTH = 3.0  # rad/s, of the critically damped yaw rate
SURGE_ACCELERATION = 0.3  # m/s²
PITCH_RATE = math.radians(10.0)
HOVER_RATE, HOVER_ACCELERATION = 0.3, 0.1  # m/s, m/s²: straight up and down by thrusters


class PatternMotion:
    """Position, attitude and velocities of a vehicle; all attributes belong to the same instant.

    `north`, `east`, `depth` are m from the start; `u`, `v`, `w` are m/s through the water in the body frame, and `vn`,
    `ve`, `vd` m/s over ground. Under way the vehicle moves where its bow points: pitch follows from the rate of
    descent, bank from the yaw rate as in a coordinated turn. Without a pattern it keeps its place against the current
    (m/s).

    `speed`, `depth_target` and `max_depth` (m/s, m), `turn_rate` and `maximum_pitch` (rad/s, rad) may change at any
    time: speed and depth change one after the other, each with minimum jerk. It never aims below `max_depth`.
    """

    def __init__(self, pattern: Pattern | None, heading: float, current: tuple[float, float], dive_time: float = 0.0):
        self.pattern = pattern
        self.current = current
        self.dive_time = dive_time
        self.speed: float = 0.0
        self.depth_target: float = 0.0
        self.max_depth: float = math.inf
        self.turn_rate: float = math.radians(15.0)
        self.maximum_pitch: float = math.radians(15.0)
        self.elapsed: float = 0.0
        self.north: float = 0.0
        self.east: float = 0.0
        self.depth: float = 0.0
        self.phi: float = 0.0
        self.theta: float = 0.0
        self.psi: float = wrap(heading)
        self.u: float = 0.0
        self.v: float = 0.0
        self.w: float = 0.0
        self.vn: float = 0.0
        self.ve: float = 0.0
        self.vd: float = 0.0
        self.p: float = 0.0
        self.q: float = 0.0
        self.r: float = 0.0
        self._surge = MinimumJerkRamp(0.0)
        self._dive = MinimumJerkRamp(0.0)
        self._yaw_rate: float = 0.0
        self._yaw_acceleration: float = 0.0
        self._derive()

    def advance(self, seconds: float) -> None:
        """Advance in equal steps of at most 20 ms."""
        steps = math.ceil(seconds / MAXIMUM_STEP - 1e-9)
        for _ in range(steps):
            self._step(seconds / steps)

    def ground_velocity(self) -> Vector:
        """Velocity over ground in the body frame (m/s)."""
        if self.current == (0.0, 0.0):
            return self.u, self.v, self.w
        return to_body(rotation(self.phi, self.theta, self.psi), (self.vn, self.ve, self.vd))

    def _step(self, dt: float) -> None:
        self._choose_ramp()
        self.elapsed += dt
        self._surge.advance(dt)
        self._dive.advance(dt)
        if self.pattern is not None:
            self._turn(self.pattern, dt)
        vn, ve = self.vn, self.ve
        self._derive()
        self.north += 0.5 * dt * (vn + self.vn)
        self.east += 0.5 * dt * (ve + self.ve)
        self.depth = self._dive.value

    def _choose_ramp(self) -> None:
        surge, dive = self._surge, self._dive
        if surge.moving or dive.moving:
            return
        if self.pattern is not None and surge.value != self.speed:
            surge.set_target(self.speed, math.inf, SURGE_ACCELERATION)
            return
        target = self.depth_target
        if self.pattern is not None and self.pattern.depth is not None:
            target = self.pattern.depth
        target = min(target, self.max_depth)
        if dive.value == target or self.elapsed < self.dive_time:
            return
        if self.pattern is None:
            dive.set_target(target, HOVER_RATE, HOVER_ACCELERATION)
        else:
            dive.set_target(target, surge.value * math.sin(self.maximum_pitch), surge.value * PITCH_RATE)

    def _turn(self, pattern: Pattern, dt: float) -> None:
        course, curvature = pattern.guidance_course_and_curvature(self.north, self.east)
        surge, (cn, ce) = self._surge.value, self.current
        horizontal = math.sqrt(max(surge * surge - self._dive.rate**2, 0.0))
        wanted = horizontal * curvature
        if (cn or ce) and horizontal > 0.0:
            cc, sc = math.cos(course), math.sin(course)
            crab = math.asin(max(-0.9, min(0.9, (ce * cc - cn * sc) / horizontal)))
            ahead = horizontal * math.cos(crab)
            wanted = curvature * (ahead + cn * cc + ce * sc) ** 2 / ahead  # d(course - crab)/dt
            course -= crab
        wanted += HEADING_GAIN * wrap(course - self.psi)
        limit = self.turn_rate * min(1.0, surge / self.speed)
        wanted = max(-limit, min(limit, wanted))
        rate, acceleration = self._yaw_rate, self._yaw_acceleration
        jerk = YAW_BANDWIDTH * (YAW_BANDWIDTH * (wanted - rate) - 2.0 * acceleration)
        self._yaw_acceleration = acceleration + jerk * dt
        self._yaw_rate = rate + 0.5 * dt * (acceleration + self._yaw_acceleration)
        self.psi = wrap(self.psi + 0.5 * dt * (rate + self._yaw_rate))

    def _derive(self) -> None:
        """Compute pitch, bank, body rates and velocities from the ramps, the heading and its rates."""
        surge, descent, psi_rate = self._surge.value, self._dive.rate, self._yaw_rate
        cy, sy = math.cos(self.psi), math.sin(self.psi)
        cn, ce = self.current
        self.vd = descent
        if self.pattern is None:
            self.u, self.v, self.w = -cn * cy - ce * sy, cn * sy - ce * cy, descent
            return
        bank = surge * psi_rate / GRAVITY
        bank_rate = (self._surge.rate * psi_rate + surge * self._yaw_acceleration) / (GRAVITY * (1.0 + bank * bank))
        sin_pitch = -descent / surge if descent else 0.0
        cos_pitch = math.sqrt(1.0 - sin_pitch * sin_pitch)
        pitch_rate = -self._dive.acceleration / (surge * cos_pitch) if descent else 0.0
        cos_bank = 1.0 / math.sqrt(1.0 + bank * bank)
        sin_bank = bank * cos_bank
        self.phi = math.atan(bank)
        self.theta = math.asin(sin_pitch)
        self.p = bank_rate - psi_rate * sin_pitch
        self.q = pitch_rate * cos_bank + psi_rate * cos_pitch * sin_bank
        self.r = psi_rate * cos_pitch * cos_bank - pitch_rate * sin_bank
        self.u = surge
        self.vn = surge * cos_pitch * cy + cn
        self.ve = surge * cos_pitch * sy + ce
