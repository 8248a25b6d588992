"""Copies: of one packet by several ways, or back from others; of an order that the network has doubled."""

import math
from collections.abc import Hashable
from zlib import crc32


class DuplicateFilter:
    """Remembers the last `most` items, each for `period` s; packets by their lengths and checksums."""

    def __init__(self, most: int, period: float = math.inf):
        self._most = most
        self._period = period
        self._seen: dict[Hashable, float] = {}

    def is_duplicate(self, item: Hashable, now: float = 0.0) -> bool:
        """Whether an item has come before, at the time `now` (s); else it is remembered."""
        key = (crc32(item), len(item)) if isinstance(item, bytes) else item
        if now - self._seen.get(key, -math.inf) < self._period:
            return True
        self._seen.pop(key, None)  # it is the newest again
        self._seen[key] = now
        if len(self._seen) > self._most:
            del self._seen[next(iter(self._seen))]
        return False
