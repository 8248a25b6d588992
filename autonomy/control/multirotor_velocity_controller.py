"""Turns the desired velocity and heading of a multirotor into roll, pitch, heading rate and thrust."""

from dataclasses import dataclass
from typing import NamedTuple

import imc
from autonomy.control.multirotor_tilt_and_thrust import GRAVITY, tilt_and_thrust
from autonomy.control.pid import PID, PIDGains
from support.number_parsing import clamp_magnitude
from support.rotations import Vector, wrap
from support.vectors import add, limit_horizontal_and_vertical, norm

LEVEL, LEARNING = 0.5, 5.0  # m/s, s: when and how fast the weight is learned
BLIND_THRUST, BLIND_DESCENT, BLIND_GAIN = 0.98, 1.5, 1.0  # share of the weight, m/s, 1/s: a blind descent
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


class MultirotorCommand(NamedTuple):
    """Roll and pitch (rad), heading rate (rad/s) and specific thrust (m/s²)."""

    roll: float
    pitch: float
    heading_rate: float
    thrust: float


class MultirotorController:
    """PIDs of velocity north, east and down, whose reference changes no faster than the vehicle can accelerate.

    `velocity` (m/s) is the desired velocity of the last step within the limits. The weight is learned in level flight;
    `descend_blind` needs it. `falling` (m/s) is the descent assumed there.
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
        self.falling = 0.0
        self._ramped: Vector = (0.0, 0.0, 0.0)
        self._weight = GRAVITY

    def stopping_point(self, state: imc.EstimatedState) -> Vector:
        """Where the vehicle comes to rest if it brakes now (m north, east, down)."""
        velocity = state.vx, state.vy, state.vz
        seconds = 0.5 * norm(velocity) / self.gains.acceleration + REACTION
        return add((state.x, state.y, state.z), velocity, seconds)

    def position_hold_velocity(self, state: imc.EstimatedState, point: Vector) -> Vector:
        """Velocity (m/s) that keeps the vehicle at a point (m)."""
        k = self.gains.position
        return k * (point[0] - state.x), k * (point[1] - state.y), k * (point[2] - state.z)

    def landing_velocity(self, state: imc.EstimatedState, point: Vector) -> Vector:
        """Velocity (m/s) that lands the vehicle below or above a point (m)."""
        north, east, _ = self.position_hold_velocity(state, point)
        low = state.alt < self.gains.landing_altitude
        return north, east, self.gains.landing_rate if low else self.gains.descent

    def step(self, state: imc.EstimatedState, velocity: Vector, heading: float, dt: float) -> MultirotorCommand:
        """The command for a velocity (m/s north, east, down) and a heading (rad), `dt` s after the last."""
        gains = self.gains
        wanted, before = limit_horizontal_and_vertical(velocity, gains.speed, gains.climb, gains.descent), self._ramped
        self.velocity, change = wanted, add(wanted, before, -1.0)
        length, longest = norm(change), gains.acceleration * dt
        self._ramped = wanted if length <= longest else add(before, change, longest / length)
        ahead = add(self._ramped, before, -1.0)
        error = add(self._ramped, (state.vx, state.vy, state.vz), -1.0)
        rate = 1.0 / dt if dt else 0.0
        laws = self._north, self._east, self._down
        n, e, d = (law.step(dt, e, 0.0) + rate * step for law, e, step in zip(laws, error, ahead, strict=True))
        roll, pitch, thrust = tilt_and_thrust((n, e, d), state.psi, gains.tilt)
        turning = clamp_magnitude(gains.heading * wrap(heading - state.psi), gains.heading_rate)
        if abs(state.vz) < LEVEL:
            self._weight += min(1.0, dt / LEARNING) * (GRAVITY - self._down.i - self._weight)
        return MultirotorCommand(roll, pitch, turning, thrust)

    def descend_blind(self, dt: float) -> MultirotorCommand:
        """The command for a level descent without a state, `dt` s after the last."""
        brake = clamp_magnitude(BLIND_GAIN * (BLIND_DESCENT - self.falling), self.gains.acceleration)
        self.falling += dt * brake
        weight = min(self._weight, GRAVITY)  # one that was learned in a climb nobody noticed is too large
        return MultirotorCommand(0.0, 0.0, 0.0, BLIND_THRUST * weight - brake)
