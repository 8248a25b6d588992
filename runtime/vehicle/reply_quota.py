"""How many replies each asker gets, so that nobody keeps a vehicle busy with questions."""

from imc.reserved_ids import UNKNOWN_SYSTEM
from runtime.bus import DropCounter

RATE, BURST = 200.0, 400.0  # replies to one asker: per second, at once
RATE_OF_ALL, BURST_OF_ALL = 400.0, 1200.0
MOST_ASKERS = 64
ALL = UNKNOWN_SYSTEM  # all askers together


class ReplyQuota:
    """Counts replies by asker (IMC id); `refused` counts the requests that got none.

    Askers share an allowance (ALL), too, because anybody can ask in many names.
    """

    def __init__(self) -> None:
        self.refused = DropCounter()
        self._left: dict[int, tuple[float, float]] = {}

    def try_acquire(self, asker: int, replies: int, now: float) -> bool:
        """Whether an asker may have this many replies now (s); a request for more than BURST takes all of it."""
        own = self._balance(asker, now, RATE, BURST)
        everybody = self._balance(ALL, now, RATE_OF_ALL, BURST_OF_ALL)
        granted = min(own, everybody) >= min(replies, BURST)
        if granted:
            taken = min(replies, BURST)
            own, everybody = own - taken, everybody - taken
        else:
            self.refused.count(asker)
        if asker not in self._left and len(self._left) > MOST_ASKERS:
            del self._left[next(name for name in self._left if name != ALL)]
        self._left[asker], self._left[ALL] = (own, now), (everybody, now)
        return granted

    def _balance(self, asker: int, now: float, rate: float, burst: float) -> float:
        left, then = self._left.get(asker, (burst, now))
        return min(burst, left + rate * max(0.0, now - then))
