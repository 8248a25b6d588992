"""The pitch of a vehicle that zigzags between two depths, or two altitudes."""

import math
from dataclasses import dataclass
from enum import IntEnum

TOLERANCE = 0.2  # m
SURFACE = 0.3  # m
LEAST_DIVE = 1.0  # m of water that a dive from the surface needs
USUAL_DIVE = 2.0  # m of water that a dive from below the surface needs, or the amplitude
STALL = 10.0  # s without getting deeper, after which a dive ends
BLIND = 60.0  # s for which the altitude may be unknown, if it is to be followed


class Slope(IntEnum):
    """Slope of the vehicle: up, down or level."""

    UP = 1
    LEVEL = 0
    DOWN = -1


class UnknownAltitudeError(RuntimeError):
    """The altitude that is to be followed has been unknown for too long."""


@dataclass(frozen=True)
class YoYoSettings:
    """A zigzag of `amplitude` (m) above and below `z`, a depth or with `by_altitude` an altitude (m); `pitch` in rad.

    `deepest` (m) and `lowest` (m above the bottom) are never passed; the pitch changes by at most `step` (rad) at once.
    """

    z: float
    amplitude: float
    pitch: float
    by_altitude: bool = False
    deepest: float = math.inf
    lowest: float = -math.inf
    step: float = math.radians(10.0)

    @property
    def lower_turn(self) -> float:
        """The depth or altitude (m) of the lower turn."""
        return max(0.0, self.z - self.amplitude) if self.by_altitude else self.z + self.amplitude


class YoYoMotion:
    """Turns between up and down; `pitch` (rad) is the present one, `short` (m) what was missing to the lower turn.

    Above the bottom it turns at the lowest altitude, and rises until there is enough water below for another dive,
    beyond its upper depth if necessary. At the surface of water that is too shallow it stays level.
    """

    def __init__(self, settings: YoYoSettings, now: float):
        self.settings = settings
        self.pitch: float = 0.0
        self.short: float = math.inf
        self._slope = Slope.DOWN
        self._dived, self._deeper, self._sounded = -math.inf, now, now

    def update(self, depth: float, altitude: float, now: float) -> bool:
        """Use a depth and an altitude (m, negative if unknown) at a time (s); True if the pitch changes.

        Raises UnknownAltitudeError.
        """
        self._slope = self._turn(depth, altitude, now)
        return self._tilt(self._slope * self.settings.pitch)

    def level(self) -> bool:
        """One step toward level; False if it is."""
        return self._tilt(0.0)

    def is_between_turns(self, depth: float, altitude: float) -> bool:
        """Whether a depth and an altitude (m) are between the turns."""
        height = altitude if self.settings.by_altitude else depth
        return abs(height - self.settings.z) <= self.settings.amplitude

    def _turn(self, depth: float, altitude: float, now: float) -> Slope:
        at = self.settings
        below, above = at.deepest - depth, depth
        if altitude >= 0.0:
            self._sounded = now
            below = min(below, altitude - at.lowest)
        if at.by_altitude:
            if altitude < 0.0:
                if now - self._sounded > BLIND:
                    raise UnknownAltitudeError(f"altitude has been unknown for {BLIND:g} s")
                return Slope.UP if depth > SURFACE else Slope.LEVEL
            left = altitude - at.lower_turn
            above = min(above, at.z + at.amplitude - altitude)
        else:
            left = at.lower_turn - depth
            above = min(above, depth - at.z + at.amplitude)
        below, self.short = min(below, left), min(self.short, left)
        if self._slope is Slope.DOWN:
            return Slope.UP if below <= TOLERANCE or self._stalls(depth, now) else Slope.DOWN
        if depth <= SURFACE:
            turns, otherwise = below >= LEAST_DIVE, Slope.LEVEL
        else:
            turns, otherwise = above <= TOLERANCE and below >= min(USUAL_DIVE, at.amplitude), Slope.UP
        self._dived, self._deeper = -math.inf, now
        return Slope.DOWN if turns else otherwise

    def _stalls(self, depth: float, now: float) -> bool:
        """Whether a dive has ended, for any reason."""
        if depth > self._dived + TOLERANCE:
            self._dived, self._deeper = depth, now
        return now - self._deeper > STALL

    def _tilt(self, target: float) -> bool:
        if self.pitch == target:
            return False
        self.pitch += max(-self.settings.step, min(self.settings.step, target - self.pitch))
        return True
