"""Measurements of inertial sensors fixed to a moving body: means over their sampling intervals."""

import math
from typing import Any, NamedTuple

from support.pose import Pose
from support.rotations import (
    Matrix,
    Vector,
    cross,
    integrate_body_rates,
    rotate_to_body,
    rotate_to_ned,
    to_body,
    wrap,
)

TIMING = 1e-3  # of a period: a state that is early by less belongs to the sample, since timestamps have 0.24 µs
LONGEST_GAP = 1.0  # s between states; a longer one is not sampled, and sampling starts again at its end
CENTER: Vector = (0.0, 0.0, 0.0)
CENTERED = Pose()


class BodyMotion(NamedTuple):
    """The motion of a body at a time (s): angles in rad, rates in rad/s, velocity in m/s.

    `velocity` is in the body frame, relative to water or air; `stream` is the velocity of these, north, east and down.
    """

    time: float
    angles: Vector
    rates: Vector
    velocity: Vector
    stream: Vector

    @classmethod
    def from_state(cls, state: Any) -> "BodyMotion":
        """Motion of a SimulatedState of IMC."""
        return cls(
            state.timestamp,
            (state.phi, state.theta, state.psi),
            (state.p, state.q, state.r),
            (state.u, state.v, state.w),
            (state.svx, state.svy, state.svz),
        )

    def predict_displacement_and_angles(self, seconds: float) -> tuple[Vector, Vector]:
        """The way north, east and down (m) in some moments, and the angles (rad) after them."""
        return _scaled(self.ground_velocity, seconds), integrate_body_rates(self.angles, self.rates, seconds)

    @property
    def ground_velocity(self) -> Vector:
        """North, east and down (m/s)."""
        return self.ground_velocity_at(CENTER)

    def ground_velocity_at(self, place: Vector) -> Vector:
        """Velocity (m/s; north, east, down) of a place of the body (m, x forward, y right, z down from its origin)."""
        (u, v, w), (x, y, z) = self.velocity, self.stream
        if place != CENTER:
            a, b, c = cross(self.rates, place)
            u, v, w = u + a, v + b, w + c
        phi, theta, psi = self.angles
        north, east, down = rotate_to_ned(phi, theta, psi, (u, v, w))
        return north + x, east + y, down + z


class InertialSample(NamedTuple):
    """Means over the `interval` (s) that ends at `time`: rates in rad/s, force in m/s², both along the sensor's axes.

    `angles` are those of the body at `time`.
    """

    time: float
    interval: float
    angles: Vector
    rates: Vector
    force: Vector


class InertialSampler:
    """Makes samples, `rate` a second, of a motion that is given as states, at that rate or any other.

    `mount` is where the sensor is in the body. Between two states, the acceleration over ground is constant, and angles
    and rates change evenly. So the mean force of an interval without rotation, times its length, is exactly the change
    of velocity less gravity's.
    """

    def __init__(self, rate: float, gravity: float, mount: Pose = CENTERED):
        self.rate = rate
        self.gravity = gravity
        self._place = mount.position
        self._axes: Matrix | None = mount.rotation if mount[3:] != CENTERED[3:] else None
        self._last: BodyMotion | None = None
        self._moving: Vector = (0.0, 0.0, 0.0)  # velocity of the place over ground at the last state
        self._first = self._sampled = 0.0
        self._count = 0
        self._turned: Vector = (0.0, 0.0, 0.0)  # integral of the rates since the last sample
        self._pushed: Vector = (0.0, 0.0, 0.0)  # integral of the force

    def sample_until_state(self, state: BodyMotion) -> list[InertialSample]:
        """The samples that are due up to `state`."""
        last, self._last = self._last, state
        before, self._moving = self._moving, state.ground_velocity_at(self._place)
        if last is not None and state.time == last.time:
            return []
        step = _Step(last, state, before, self._moving) if last is not None and last.time < state.time else None
        if last is None or step is None or state.time - last.time > LONGEST_GAP + TIMING:
            return self._begin(state.time, step)
        samples: list[InertialSample] = []
        begin, now = last.time, state.time
        for number in range(self._count + 1, math.floor((now - self._first) * self.rate + TIMING) + 1):
            end = self._first + number / self.rate
            end = now if now - end < TIMING / self.rate else max(begin, end)
            if end > begin:
                self._integrate(step, begin, end)
            samples.append(self._sample(step, end))
            begin, self._count = end, number
        if now > begin:
            self._integrate(step, begin, now)
        return samples

    def _begin(self, now: float, step: "_Step | None") -> list[InertialSample]:
        """Begin to sample; after a gap the first sample is that of the period before the state that ends the gap."""
        self._first, self._count = now, 0
        self._sampled = now if step is None else max(step.began, now - 1.0 / self.rate)
        self._turned = self._pushed = (0.0, 0.0, 0.0)
        if step is None:
            return []
        self._integrate(step, self._sampled, now)
        return [self._sample(step, now)]

    def _integrate(self, step: "_Step", begin: float, end: float) -> None:
        length, ((phi, theta, psi), (p, q, r)) = end - begin, step.at(0.5 * (begin + end))
        north, east, down = step.acceleration
        x, y, z = rotate_to_body(phi, theta, psi, (north, east, down - self.gravity))
        (a, b, c), (d, e, f) = self._turned, self._pushed
        self._turned = a + length * p, b + length * q, c + length * r
        self._pushed = d + length * x, e + length * y, f + length * z

    def _sample(self, step: "_Step", time: float) -> InertialSample:
        interval = time - self._sampled
        (p, q, r), (x, y, z) = self._turned, self._pushed
        self._sampled = time
        self._turned = self._pushed = (0.0, 0.0, 0.0)
        rates, force = (p / interval, q / interval, r / interval), (x / interval, y / interval, z / interval)
        if self._axes is not None:
            rates, force = to_body(self._axes, rates), to_body(self._axes, force)
        return InertialSample(time, interval, step.angles_at(time), rates, force)


class _Step:
    """The motion between two states; `acceleration` is that of a place of the body, over ground.

    `before` and `after` are the velocities (m/s) of the place at both.
    """

    __slots__ = ("_length", "_motion", "acceleration", "began")

    def __init__(self, begin: BodyMotion, end: BodyMotion, before: Vector, after: Vector):
        self.began, (phi, theta, psi), (p, q, r) = begin.time, begin.angles, begin.rates
        self._length = length = end.time - begin.time
        (a, b, c), (x, y, z), per_second = before, after, 1.0 / length
        self.acceleration = per_second * (x - a), per_second * (y - b), per_second * (z - c)
        (a, b, c), (x, y, z) = end.angles, end.rates
        a, b, c = a - phi, b - theta, c - psi
        if not (-1.0 < a < 1.0 and -1.0 < b < 1.0 and -1.0 < c < 1.0):  # nearly all are: calls cost more than that
            a, b, c = wrap(a), wrap(b), wrap(c)
        self._motion = phi, a, theta, b, psi, c, p, x - p, q, y - q, r, z - r

    def at(self, time: float) -> tuple[Vector, Vector]:
        """Angles and rates at a time."""
        share = (time - self.began) / self._length
        phi, a, theta, b, psi, c, p, x, q, y, r, z = self._motion
        return (phi + share * a, theta + share * b, psi + share * c), (p + share * x, q + share * y, r + share * z)

    def angles_at(self, time: float) -> Vector:
        """Angles at a time."""
        share = (time - self.began) / self._length
        phi, a, theta, b, psi, c, *_ = self._motion
        return phi + share * a, theta + share * b, psi + share * c


def _scaled(a: Vector, factor: float) -> Vector:
    return factor * a[0], factor * a[1], factor * a[2]
