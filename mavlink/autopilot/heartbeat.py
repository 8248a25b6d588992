"""Whether messages of an autopilot arrive, are late, or are lost."""

import math


class HeartbeatWatch:
    """The HEARTBEAT of an autopilot, at times (s).

    It is late when none has come for `late` s: what was to be done waits. It is lost after `timeout` s.
    """

    def __init__(self) -> None:
        self.at: float = -math.inf
        self.lost: bool = False
        self._late_at, self._back_at = math.inf, -math.inf

    @property
    def is_alive(self) -> bool:
        """Whether a HEARTBEAT has come, and it is not lost."""
        return self.at > -math.inf and not self.lost

    def receive(self, now: float) -> bool:
        """Take one; True if it is the first, or the first after a loss."""
        new, self.at = not self.is_alive, now
        if self._late_at < math.inf:
            self._back_at = now
        self.lost, self._late_at = False, math.inf
        return new

    def is_late(self, now: float, late: float) -> bool:
        return self.is_alive and now - self.at > late

    def resumes(self, now: float, patience: float) -> bool:
        """Whether HEARTBEAT was late until at most `patience` s ago: other messages may still be on their way."""
        return now - self._back_at <= patience

    def becomes_late(self, now: float, late: float) -> bool:
        """Whether HEARTBEAT is late since this call."""
        if not self.is_late(now, late) or self._late_at < math.inf:
            return False
        self._late_at = now
        return True

    def becomes_lost(self, now: float, timeout: float) -> bool:
        """Whether HEARTBEAT is lost since this call."""
        if not self.is_alive or now - self.at <= timeout:
            return False
        self.lost = True
        return True
