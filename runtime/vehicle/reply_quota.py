"""Limits the replies per requester, so that requests cannot overload a vehicle."""

from imc.reserved_ids import UNKNOWN_SYSTEM
from runtime.bus import DropCounter
from support.token_bucket import TokenBucket, TokenBuckets

RATE, BURST = 200.0, 400.0  # replies to one asker: per second, at once
RATE_OF_ALL, BURST_OF_ALL = 400.0, 1200.0
MOST_ASKERS = 64


class ReplyQuota:
    """Counts replies by asker (IMC id); `refused` counts the requests that got none.

    All askers together share an allowance, too, because anybody can ask in many names.
    """

    def __init__(self) -> None:
        self.refused: DropCounter[int] = DropCounter(UNKNOWN_SYSTEM)
        self._own = TokenBuckets(RATE, BURST, MOST_ASKERS)
        self._shared = TokenBucket(RATE_OF_ALL, BURST_OF_ALL)

    def try_acquire(self, asker: int, replies: int, now: float) -> bool:
        """Whether an asker may have this many replies now (s); a request for more than BURST takes all of it."""
        cost, own = min(replies, BURST), self._own[asker]
        granted = min(own.refill(now), self._shared.refill(now)) >= cost
        if granted:
            own.spend(now, cost)
            self._shared.spend(now, cost)
        else:
            self.refused.count(asker)
        return granted
