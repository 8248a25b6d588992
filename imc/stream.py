"""Finds the packets in a stream of bytes, even in a damaged one."""

import re
from collections import deque
from collections.abc import Callable
from typing import NamedTuple, TypeVar

from fastcrc.crc16 import arc

from imc.codec import DEFAULT, Codec
from imc.codec_compiler import LARGEST_PACKET
from imc.errors import DecodeError
from imc.layout import SMALLEST_PACKET
from imc.message import Message

T = TypeVar("T")

_GARBAGE = "no synchronization number"
_TOO_LARGE = "larger than a packet can be"
_TRUNCATED = "truncated"
_WRONG_CRC = "wrong CRC"


class Loss(NamedTuple):
    """Bytes that are not a message: offset from the start of the stream, length, reason."""

    offset: int
    length: int
    reason: str


class StreamParser:
    """Takes bytes as they arrive and returns the packets in them, in either byte order.

    A packet is accepted if its CRC is right, even if its id is unknown; the search continues after it. Otherwise the
    search continues one byte later, so that a damaged length hides no good packet. If bytes look like the start of a
    packet, the parser waits for the rest and keeps at most 65535 bytes. `close` stops waiting (at the end of the
    stream, or after a silence) and searches the bytes after that start; `resync_packets` does so for a start that has
    been waited for too long, if there is a packet behind it.

    losses: the latest 1000 stretches that are not messages, oldest first; adjoining ones are joined.
    lost: number of bytes in all of them, including those no longer listed.
    """

    def __init__(self, codec: Codec = DEFAULT) -> None:
        self._decode = codec.decode
        little = codec.sync.to_bytes(2, "little")
        self._little, self._big = little, little[::-1]
        self._search = re.compile(b"|".join(map(re.escape, (self._little, self._big)))).search
        self._waiting = bytearray()
        self._needed = 0
        self._looked = 1  # how far `resync_packets` has looked
        self._undecided: list[int] = []  # starts of packets that it has seen
        self._offset = 0
        self._adjoining = False
        self.losses: deque[Loss] = deque(maxlen=1000)
        self.lost: int = 0

    def feed(self, data: bytes) -> list[Message]:
        """The messages completed by these bytes; a packet that cannot be decoded is a loss."""
        return self._take(data, self._decode)

    def feed_packets(self, data: bytes) -> list[bytes]:
        """The packets completed by these bytes, not decoded."""
        return self._take(data, bytes)

    def close(self) -> list[Message]:
        """The messages after an incomplete packet that will not be completed. More can be fed afterward."""
        return self._scan(self._decode, final=True)

    def close_packets(self) -> list[bytes]:
        """The packets of the messages that `close` returns."""
        return self._scan(bytes, final=True)

    @property
    def incomplete_offset(self) -> int | None:
        """Offset in the stream of the packet whose rest is missing; None without one."""
        return self._offset if self._waiting else None

    def resync_packets(self) -> list[bytes]:
        """The packets behind the start of the unfinished one, not decoded, if there is any: that start was damaged.

        Without any it may be that of a large packet on a slow link, and is waited for further.
        """
        start = self._packet_behind()
        if start is None:
            return []
        self._lose(0, start, _TRUNCATED)
        self._drop(start)
        return self._scan(bytes, final=False)

    def _packet_behind(self) -> int | None:
        """Offset of the first whole packet behind the unfinished one; each byte is examined once."""
        data = bytes(self._waiting)
        starts, position = self._undecided, self._looked
        while match := self._search(data, position):
            starts.append(match.start())
            position = match.start() + 1
        self._looked, self._undecided = max(1, len(data) - 1), []
        for start in starts:
            order = "little" if data.startswith(self._little, start) else "big"
            size = int.from_bytes(data[start + 4 : start + 6], order) + SMALLEST_PACKET
            if len(data) - start < 6 or len(data) - start < size <= LARGEST_PACKET:
                self._undecided.append(start)
            elif size <= LARGEST_PACKET and _crc_is_right(memoryview(data)[start : start + size], order):
                return start
        return None

    def _drop(self, length: int) -> None:
        del self._waiting[:length]
        self._offset += length
        self._looked, self._undecided = 1, []

    def _take(self, data: bytes, accept: Callable[[bytes], T]) -> list[T]:
        self._waiting += data
        return self._scan(accept, final=False) if len(self._waiting) >= self._needed else []

    def _scan(self, accept: Callable[[bytes], T], final: bool) -> list[T]:
        data = bytes(self._waiting)
        view = memoryview(data)
        length = len(data)
        position = self._needed = 0
        found: list[T] = []
        while position < length:
            if data.startswith(self._little, position):
                order = "little"
            elif data.startswith(self._big, position):
                order = "big"
            else:
                position = self._skip_garbage(data, position, final)
                if length - position < 2:
                    break
                continue
            size = int.from_bytes(data[position + 4 : position + 6], order) + SMALLEST_PACKET
            end = position + size
            if size > LARGEST_PACKET:
                reason = _TOO_LARGE
            elif end > length or length - position < 6:
                if not final:
                    self._needed = size if length - position >= 6 else 6
                    break
                reason = _TRUNCATED
            else:
                if _crc_is_right(view[position:end], order):
                    self._adjoining = False
                    try:
                        found.append(accept(data[position:end]))
                    except DecodeError as error:
                        self._lose(position, size, error.reason)
                        self._adjoining = False
                    position = end
                    continue
                reason = _WRONG_CRC
            # Skip one byte only: a good packet may begin within what looked like one.
            self._lose(position, 1, reason)
            position += 1
        if final and position < length:
            self._lose(position, length - position, _TRUNCATED)
            position = length
        if position:
            self._drop(position)
        return found

    def _skip_garbage(self, data: bytes, position: int, final: bool) -> int:
        match = self._search(data, position)
        if match:
            end = match.start()
        else:
            half = not final and data[-1] in self._little
            end = max(len(data) - half, position)
        if end > position:
            self._lose(position, end - position, _GARBAGE)
        return end

    def _lose(self, position: int, length: int, reason: str) -> None:
        self.lost += length
        if self._adjoining:
            offset, before, why = self.losses.pop()
            # A damaged packet is a more useful reason than the garbage around it.
            self.losses.append(Loss(offset, before + length, reason if why == _GARBAGE else why))
        else:
            self.losses.append(Loss(self._offset + position, length, reason))
            self._adjoining = True


def _crc_is_right(packet: memoryview, order: str) -> bool:
    if order == "little":
        return not arc(packet)  # the CRC over data and its own CRC is zero
    return arc(packet[:-2]) == int.from_bytes(packet[-2:], "big")
