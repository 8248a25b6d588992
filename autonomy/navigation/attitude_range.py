"""Attitudes that a vehicle cannot have: mostly wrong units."""

import math
from collections import deque
from dataclasses import dataclass

LARGEST_TILT = math.radians(60.0)
LARGEST_ROLL, LARGEST_PITCH = math.radians(181.0), math.radians(91.0)  # of any vehicle, with their rounding
LARGEST_HEADING = math.tau + 0.1  # rad; some count from 0 to 2π, others from -π to π
SEVERAL, WITHIN = 3, 1.0  # so many in so many seconds are no single error
HOLD = 3.0  # s without any, after which attitudes are trusted again


@dataclass
class AttitudeRange:
    """Rejects impossible attitudes (rad) and, after several, all of them for some time.

    An attitude in degrees is possible now and then: the few that look right are not. One that is no number says nothing
    about the others, and is rejected alone. Roll and pitch are at most the `largest_roll` and `largest_pitch`, by
    default those of a multirotor in the air.
    """

    largest_roll: float = LARGEST_TILT
    largest_pitch: float = LARGEST_TILT

    def __post_init__(self) -> None:
        self._times, self._until = deque[float](maxlen=SEVERAL), -math.inf

    def accepts(self, now: float, phi: float, theta: float, psi: float) -> bool:
        """Whether an attitude at a time (s) can be used."""
        tilted = abs(phi) <= self.largest_roll and abs(theta) <= self.largest_pitch
        if tilted and abs(psi) <= LARGEST_HEADING:
            return now >= self._until
        if not math.isfinite(phi + theta + psi):
            return False
        self._times.append(now)
        if len(self._times) == SEVERAL and now - self._times[0] < WITHIN:
            self._until = now + HOLD
        return False

    def rejects(self, now: float) -> bool:
        """Whether attitudes are not trusted at a time (s)."""
        return now < self._until
