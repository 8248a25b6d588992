"""Detects that a vehicle is stuck on its path or strays from it."""

import math
from dataclasses import dataclass

from autonomy.guidance.track import PathProgress
from support.rotations import wrap

MISSES = 2
CLOSER = 1.0  # m nearer to the track: the vehicle comes back


@dataclass(frozen=True)
class AlongTrack:
    """Least progress per `period` (s): `speed` (m/s) along the track or, off course, `turning` (rad/s) toward it."""

    period: float
    speed: float
    turning: float


@dataclass(frozen=True)
class CrossTrack:
    """Largest `distance` (m) from the track, which may be exceeded for `patience` (s)."""

    distance: float
    patience: float


class DivergenceMonitor:
    """Watches a vehicle on its path; None turns a check off."""

    def __init__(self, along: AlongTrack | None, cross: CrossTrack | None):
        self._along = along
        self._cross = cross
        self.restart(-math.inf)

    def restart(self, at: float) -> None:
        """Start over at a time (s); there are no errors before it."""
        self._begin = at
        self._checked: float | None = None
        self._outside: float | None = None
        self._misses = 0
        self._remaining = self._error = self._aside = self._farthest = 0.0

    def error_text(self, now: float, where: PathProgress, target: float, uncertainty: float) -> str:
        """The error, empty if there is none. `target` is the course to the path (rad), `uncertainty` is in m."""
        if now < self._begin:
            return ""
        if self._along is not None and self._is_stuck(self._along, now, where, target):
            return "along-track divergence error"
        if self._cross is not None and self._is_off(self._cross, now, where, uncertainty):
            return "cross-track divergence error"
        return ""

    def _is_stuck(self, along: AlongTrack, now: float, where: PathProgress, target: float) -> bool:
        off_course = abs(wrap(target - where.course))
        if self._checked is not None and now - self._checked < along.period:
            return False
        first, self._checked = self._checked is None, now
        remaining, self._remaining = self._remaining, where.left
        error, self._error = self._error, off_course
        aside, self._aside = self._aside, abs(where.y)
        if first:
            return False
        if off_course < 0.5 * math.pi:
            # A leg that begins at the center of a large circle is first approached at nearly a right angle.
            gained = max(remaining - where.left, aside - self._aside) >= along.period * along.speed
        else:
            gained = error - off_course >= along.period * along.turning
        self._misses = 0 if gained else self._misses + 1
        return self._misses >= MISSES

    def _is_off(self, cross: CrossTrack, now: float, where: PathProgress, uncertainty: float) -> bool:
        if abs(where.y) < cross.distance + uncertainty:
            self._outside = None
            return False
        if self._outside is None or abs(where.y) < self._farthest - CLOSER:
            self._outside, self._farthest = now, abs(where.y)
        return now - self._outside >= cross.patience
