"""Packets that came before: copies of one packet by several ways, or back from others."""

from zlib import crc32


class DuplicateFilter:
    """Remembers the last packets, so many of them, by their checksums."""

    def __init__(self, most: int):
        self._most = most
        self._seen: dict[tuple[int, int], None] = {}

    def is_duplicate(self, packet: bytes) -> bool:
        """Whether a packet was asked for before; it is remembered."""
        key = crc32(packet), len(packet)
        if key in self._seen:
            return True
        self._seen[key] = None
        if len(self._seen) > self._most:
            del self._seen[next(iter(self._seen))]
        return False
