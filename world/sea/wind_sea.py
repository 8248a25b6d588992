"""A wind sea as a sum of waves: how high it is at a place and a time, and what of it a hull follows."""

import math
from typing import Any, NamedTuple
from zlib import crc32

import numpy as np
from numpy.random import PCG64, Generator, SeedSequence
from numpy.typing import NDArray

from support.rotations import Vector, body_rates
from world.sea.wave_statistics import SeaState

Floats = NDArray[np.floating[Any]]

GRAVITY = 9.80665  # m/s²
COUNT = 96  # waves that make up a sea
INSTANT = 1e-4  # s before and after now, between whose places the difference is a velocity
LATE = np.array([[-INSTANT], [INSTANT]])
FLAT = 0.01  # rad; for less, the difference of two terms would be lost in rounding


class WaveMotion(NamedTuple):
    """Motion of a boat by waves: m north, east and down of its place in calm water, and its velocity there.

    `angles` are roll, pitch and yaw (rad), `rates` p, q, r (rad/s).
    """

    offset: Vector
    velocity: Vector
    angles: Vector
    rates: Vector


class WindSea:
    """A sea of `waves` that come from `bearing` (rad from north); the same `seed` gives the same sea.

    Waves of deep water (omega² = g k) and of equal energy, one for each part of the spectrum of Pierson and Moskowitz
    (1964), with a peak at 0.4 sqrt(g / H) rad/s (Fossen 2011, ch. 8.2); directions spread with cos² to both sides. What
    is shorter than the last part, a fifteenth of the length at the peak, is left out. Places are m north and east of
    the world's origin, times s from the start of the run.
    """

    def __init__(self, waves: SeaState, bearing: float = 0.0, seed: int = 0):
        random = Generator(PCG64(SeedSequence([seed, crc32(b"wind sea")])))
        parts = (np.arange(COUNT) + random.uniform(size=COUNT)) / COUNT
        height = max(waves.height, 1e-9)
        # Of the energy, exp(-1.25 (peak / omega)⁴) is below a frequency.
        below = np.clip(parts, 1e-6, 1.0 - 0.5 / COUNT)
        self.frequency: NDArray[np.float64] = 0.4 * math.sqrt(GRAVITY / height) * (1.25 / -np.log(below)) ** 0.25
        angle = np.linspace(-0.5 * math.pi, 0.5 * math.pi, 1001)
        share = 0.5 + (angle + 0.5 * np.sin(2.0 * angle)) / math.pi
        spread = np.interp((random.permutation(COUNT) + random.uniform(size=COUNT)) / COUNT, share, angle)
        self.wave_number: NDArray[np.float64] = self.frequency**2 / GRAVITY
        self.direction: NDArray[np.float64] = bearing + math.pi + spread
        self._north, self._east = np.cos(self.direction), np.sin(self.direction)
        self.phase: NDArray[np.float64] = random.uniform(0.0, math.tau, COUNT)
        self.amplitude: float = 0.25 * waves.height * math.sqrt(2.0 / COUNT)

    def elevation(self, north: float, east: float, time: float) -> float:
        """Height of the surface above its mean (m)."""
        return float(self.amplitude * np.sum(np.cos(self._phases(north, east, time))))

    def surface_slope(self, north: float, east: float, time: float) -> tuple[float, float]:
        """Slope of the surface to the north and to the east."""
        steep = -self.amplitude * self.wave_number * np.sin(self._phases(north, east, time))
        return float(np.sum(steep * self._north)), float(np.sum(steep * self._east))

    def surface_orbital_velocity(self, north: float, east: float, time: float) -> Vector:
        """Orbital velocity of the water at the surface (m/s; north, east, down)."""
        phase, fast = self._phases(north, east, time), self.amplitude * self.frequency
        along = fast * np.cos(phase)
        level = float(np.sum(along * self._north)), float(np.sum(along * self._east))
        return *level, float(-np.sum(fast * np.sin(phase)))

    def hull_motion(
        self,
        place: tuple[float, float],
        velocity: Vector,
        heading: float,
        turn: float,
        size: tuple[float, float],
        time: float,
    ) -> WaveMotion:
        """Motion of a hull of a `size` (length, beam; m) that sails at a `velocity` (m/s; NED) and `turn`s (rad/s).

        What it does in calm water and in waves is added (Fossen 2011, ch. 8.2). It moves as the mean of the water over
        its waterplane, a rectangle, and lies in the plane that fits best to the surface there: the balance of a
        wall-sided hull without inertia, to which the closed forms of Jensen, Mansour and Olsen (Ocean Engineering 31,
        2004) tend for waves that are long beside its draft.
        """
        north, east = place[0] + LATE * velocity[0], place[1] + LATE * velocity[1]
        yaw = heading + LATE * turn
        forward, starboard = self._along(np.cos(yaw), np.sin(yaw)), self._along(-np.sin(yaw), np.cos(yaw))
        ahead, across = (0.5 * s * self.wave_number * part for s, part in zip(size, (forward, starboard), strict=True))
        (length, lean), (beam, heel) = _share(ahead), _share(across)
        phase = self._phases(north, east, time + LATE)
        crest, front = self.amplitude * np.cos(phase) * length * beam, self.amplitude * np.sin(phase)
        steep = front * self.wave_number
        front *= length * beam
        pitch = np.arctan(-np.sum(steep * forward * lean * beam, axis=1))
        roll = np.arctan(np.sum(steep * starboard * heel * length, axis=1) * np.cos(pitch))
        rows = -np.sum(front * self._north, axis=1), -np.sum(front * self._east, axis=1), -np.sum(crest, axis=1)
        # At two instants around `time`: their difference gives the rates.
        before, after = np.stack([*rows, roll, pitch], axis=1).tolist()
        n, e, d, phi, theta = (0.5 * (first + last) for first, last in zip(before, after, strict=True))
        vn, ve, vd, phi_rate, theta_rate = (
            (last - first) / (2.0 * INSTANT) for first, last in zip(before, after, strict=True)
        )
        return WaveMotion(
            (n, e, d), (vn, ve, vd), (phi, theta, heading), body_rates(phi, theta, phi_rate, theta_rate, turn)
        )

    def _along(self, north: Any, east: Any) -> Floats:
        """Components of the directions of the waves along a vector."""
        return north * self._north + east * self._east

    def _phases(self, north: Any, east: Any, time: Any) -> Floats:
        return self.wave_number * self._along(north, east) - self.frequency * time + self.phase


def _share(half: Floats) -> tuple[Floats, Floats]:
    """Remaining share of the height and the slope of waves over a length, `half` of which is that many rad of them.

    Height: the mean; slope: that of the line that fits best; beside those in the middle.
    """
    half = np.where(np.abs(half) < FLAT, FLAT, half)
    sine = np.sin(half) / half
    return sine, 3.0 * (sine - np.cos(half)) / (half * half)
