"""Turns the desired velocity and heading of a multirotor into roll, pitch, heading rate and thrust."""

from dataclasses import dataclass
from typing import NamedTuple

import imc
from autonomy.control.blind_descent import DESCENT
from autonomy.control.multirotor_tilt_and_thrust import GRAVITY, tilt_and_thrust
from autonomy.control.pid import PID, PIDGains
from support.number_parsing import clamp_magnitude
from support.rotations import Vector, wrap
from support.vectors import add, limit_horizontal_and_vertical, norm

LEVEL, FOLLOWS, LEARNING = 0.5, 0.25, 2.5  # m/s, m/s, s: when (vz, its error) and how fast the weight is learned
LIGHTEST, HEAVIEST = 0.5 * GRAVITY, 1.8 * GRAVITY  # m/s², what can be the weight
MASS_CHANGE, CHANGE_TIME, CHANGE_LEARNING = 0.15, 0.2, 0.1  # share of the force that a lost load changes; s; s
SAME_WEIGHT = 0.2 * GRAVITY  # m/s², how far integral and accelerometer may differ
BLIND_THRUST, BLIND_GAIN = 0.98, 4.0  # share of the weight, 1/s: a blind descent
HARDEST_BRAKE = 0.9 * GRAVITY  # of one that falls
FENCE_THRUST = 0.8  # share of the weight, above the limit of altitude: less than a vehicle that lost a load needs
SPEED_GAINS = PIDGains(4.0, 2.0, 0.0, integral_limit=6.0, limit=0.7 * GRAVITY)  # of one whose speed is measured
REACTION = 0.3  # s before a vehicle brakes


@dataclass(frozen=True)
class MultirotorGains:
    """Gains and limits of MultirotorController."""

    horizontal: PIDGains  # m/s² per m/s
    vertical: PIDGains  # m/s² per m/s
    position: float  # m/s per m
    heading: float  # rad/s per rad
    heading_rate: float  # rad/s, largest
    tilt: float  # rad, largest
    acceleration: float  # m/s², fastest change of the velocity reference
    speed: float  # m/s over ground, highest
    climb: float  # m/s, fastest
    descent: float  # m/s, fastest
    landing_rate: float  # m/s of descent near the ground
    landing_altitude: float  # m, below which the landing rate applies
    thrust: float  # m/s², the specific thrust at full rotor speed


class MultirotorCommand(NamedTuple):
    """Roll and pitch (rad), heading rate (rad/s) and specific thrust (m/s²)."""

    roll: float
    pitch: float
    heading_rate: float
    thrust: float


class MultirotorController:
    """PIDs of velocity north, east and down, whose reference changes no faster than the vehicle can accelerate.

    `velocity` (m/s) is the desired velocity of the last step within the limits. `weight` (m/s²) is the specific thrust
    that carries the vehicle, estimated in level flight; `descend_blind` needs it. `falling` (m/s) is the descent there.
    """

    def __init__(self, gains: MultirotorGains):
        self.set_gains(gains)
        self.reset()

    def set_gains(self, gains: MultirotorGains) -> None:
        """Use other gains; the integrals start over."""
        self.gains = gains
        self._north, self._east = PID.from_gains(gains.horizontal), PID.from_gains(gains.horizontal)
        self._down = PID.from_gains(gains.vertical)

    def reset(self) -> None:
        """Start from rest."""
        for law in (self._north, self._east, self._down):
            law.reset()
        self.velocity: Vector = (0.0, 0.0, 0.0)
        self.falling: float = 0.0
        self._brake = 0.0
        self._ramped: Vector = (0.0, 0.0, 0.0)
        self.weight: float = GRAVITY
        self._by_integral = GRAVITY
        self._by_force = GRAVITY
        self._confirmed, self._changed = False, 0.0
        self._thrust = GRAVITY
        self._blind = PID.from_gains(SPEED_GAINS)

    def stopping_point(self, state: imc.EstimatedState) -> Vector:
        """Point where the vehicle comes to rest if it brakes now (m north, east, down)."""
        velocity = state.vx, state.vy, state.vz
        seconds = 0.5 * norm(velocity) / self.gains.acceleration + REACTION
        return add((state.x, state.y, state.z), velocity, seconds)

    def position_hold_velocity(self, state: imc.EstimatedState, point: Vector) -> Vector:
        """Velocity (m/s) that keeps the vehicle at a point (m)."""
        k = self.gains.position
        return k * (point[0] - state.x), k * (point[1] - state.y), k * (point[2] - state.z)

    def landing_velocity(self, state: imc.EstimatedState, point: Vector, descent: float | None = None) -> Vector:
        """Velocity (m/s) that lands the vehicle below or above a point (m), if given with a certain `descent`."""
        north, east, _ = self.position_hold_velocity(state, point)
        low = state.alt < self.gains.landing_altitude
        usual = self.gains.landing_rate if low else self.gains.descent
        return north, east, usual if descent is None else descent

    @property
    def level_command(self) -> MultirotorCommand:
        """The command that lets it sink slowly, level, however long it stands."""
        return MultirotorCommand(0.0, 0.0, 0.0, BLIND_THRUST * self.weight)

    def blind_descent_rate(self, height: float | None) -> float:
        """Descent (m/s) without a state at a measured height (m), None if nothing measures it."""
        low = height is not None and height < self.gains.landing_altitude
        return min(DESCENT, self.gains.landing_rate) if low else DESCENT

    def below_fence(self, velocity: Vector, room: float) -> Vector:
        """A velocity (m/s north, east, down) that stays `room` (m) below a limit of altitude, or comes back to it."""
        return velocity[0], velocity[1], max(velocity[2], -self.gains.position * room)

    def step(
        self,
        state: imc.EstimatedState,
        velocity: Vector,
        heading: float,
        dt: float,
        force: float | None = None,
        *,
        at_once: bool = False,
    ) -> MultirotorCommand:
        """The command for a velocity (m/s north, east, down) and a heading (rad), `dt` s after the last.

        `force` is the specific force (m/s²) measured along the mast, None if unknown. The reference of the vertical
        speed changes `at_once` if this is urgent.
        """
        gains = self.gains
        wanted, before = limit_horizontal_and_vertical(velocity, gains.speed, gains.climb, gains.descent), self._ramped
        before = (before[0], before[1], wanted[2]) if at_once else before
        self.velocity, change = wanted, add(wanted, before, -1.0)
        length, longest = norm(change), gains.acceleration * dt
        self._ramped = wanted if length <= longest else add(before, change, longest / length)
        ahead = add(self._ramped, before, -1.0)
        error = add(self._ramped, (state.vx, state.vy, state.vz), -1.0)
        rate = 1.0 / dt if dt else 0.0
        north = self._north.step(dt, error[0]) + rate * ahead[0]
        east = self._east.step(dt, error[1]) + rate * ahead[1]
        down = self._down.step(dt, error[2]) + rate * ahead[2]
        roll, pitch, thrust = tilt_and_thrust((north, east, down), state.psi, gains.tilt)
        turning = clamp_magnitude(gains.heading * wrap(heading - state.psi), gains.heading_rate)
        if abs(state.vz) < LEVEL and abs(error[2]) < FOLLOWS:  # on the ground it does not follow a descent
            self._learn_weight(min(1.0, dt / LEARNING), force)
        self._thrust = thrust
        self._blind.reset()
        return MultirotorCommand(roll, pitch, turning, thrust)

    def _learn_weight(self, share: float, force: float | None) -> None:
        """Use a weight that the accelerometer confirms; an integral alone may come from an unnoticed climb."""
        self._by_integral += share * (GRAVITY - self._down.i - self._by_integral)
        if force is None:
            if not self._confirmed:
                self.weight = min(self._by_integral, GRAVITY)
            return
        now = GRAVITY * self._thrust / force
        self._by_force += share * (now - self._by_force)
        settled = max(abs(now - self._by_force), abs(self._by_integral - self._by_force)) < SAME_WEIGHT
        if settled and LIGHTEST < self._by_force < HEAVIEST:
            self.weight, self._confirmed = self._by_force, True

    def update_load(self, dt: float, force: float | None) -> None:
        """Detect at once a lost or added load, from the specific force (m/s²) along the mast in the last `dt` s.

        One that differs from gravity is not that of a vehicle on the ground.
        """
        if force is None:
            self._changed = 0.0
            return
        expected = self._thrust * GRAVITY / self.weight
        moves = abs(force - GRAVITY) > MASS_CHANGE * GRAVITY
        self._changed = self._changed + dt if moves and abs(force - expected) > MASS_CHANGE * expected else 0.0
        if self._changed > CHANGE_TIME:
            share = min(1.0, dt / CHANGE_LEARNING)
            weight = self.weight + share * (GRAVITY * self._thrust / force - self.weight)
            self.weight = self._by_force = min(HEAVIEST, max(LIGHTEST, weight))

    def descend_blind(
        self,
        dt: float,
        falling: float | None = None,
        *,
        lost: float = 0.0,
        descent: float = DESCENT,
        above_fence: bool = False,
    ) -> MultirotorCommand:
        """The command for a level `descent` (m/s) without a state, `dt` s after the last.

        `falling` is the measured speed downward (m/s); without it, that is what thrust and weight make of the last one,
        where the rotors had no power for `lost` s. Nothing makes it climb `above_fence`.
        """
        most = min(self.gains.thrust, FENCE_THRUST * self.weight) if above_fence else self.gains.thrust
        if falling is not None:
            self.falling, self._brake = falling, 0.0
            if lost:
                self._blind.reset()
            share = 1.0 - self._blind.step(dt, descent - falling) / GRAVITY
        else:
            self.falling += lost * (GRAVITY - self._brake)
            hardest = min(HARDEST_BRAKE, max(0.0, GRAVITY * (most / self.weight - 1.0)))
            slower = BLIND_GAIN * (descent - self.falling)
            self._brake = max(-hardest, min(self.gains.acceleration, slower))
            self.falling += dt * self._brake
            share = BLIND_THRUST - self._brake / GRAVITY
        self._thrust = min(share * self.weight, most)
        return MultirotorCommand(0.0, 0.0, 0.0, self._thrust)
