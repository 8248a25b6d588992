"""Whether a takeoff that was rejected takes place all the same: in the air, ArduPilot rejects a copy of the command."""

import math
from collections.abc import Callable

from mavlink.autopilot.climb_speed import ClimbSpeed
from mavlink.autopilot.command_client import PATIENCE

CLIMB_SHOWN = 5.0  # s after a refusal in which a vehicle that takes off is seen to climb


class TakeoffOrder:
    """The command of one takeoff; times in s.

    Without an acknowledgment the command is sent again after PATIENCE. A refusal before that counts at once, a later
    one only if the vehicle stays on the ground. `climb` judges the speed, and reports to `warn`.
    """

    def __init__(self, warn: Callable[[str], object]) -> None:
        self.climb: ClimbSpeed = ClimbSpeed(warn)
        self._ordered_at = self._doubted_at = math.inf
        self._reason = ""

    def give(self, now: float) -> None:
        """The command is sent."""
        self._ordered_at, self._doubted_at, self._reason = now, math.inf, ""
        self.climb.restart()

    def refuse(self, reason: str) -> None:
        """The autopilot has answered: "" if it obeys, else why not."""
        self._reason = reason

    def error(self, now: float, *, flies: bool) -> str:
        """Reason why the takeoff fails, as far as that is known now; "" if it may succeed."""
        if not self._reason or flies:
            self._reason = ""
            return ""
        self._doubted_at = min(self._doubted_at, now)
        repeated = self._doubted_at - self._ordered_at >= PATIENCE
        return "" if repeated and now - self._doubted_at < CLIMB_SHOWN else self._reason
