"""Members of a gzip file unpacked in stretches that do not depend on each other, as several threads can."""

import os
import re
from collections import deque
from collections.abc import Callable, Generator, Iterable, Iterator
from io import BytesIO
from typing import BinaryIO, Protocol

from imc.lsf.members import COMPRESSIONS, LONGEST_MAGIC, Compression, Piece, unpack

STRETCH = 1 << 18  # packed bytes unpacked together, about
LONGEST = 1 << 20  # packed bytes in which a member has to begin
LARGEST = 1 << 22  # unpacked bytes of a stretch
AHEAD = 8  # stretches being unpacked at a time
HEADER = re.compile(rb"\x1f\x8b\x08\x00....[\x00\x02\x04][\x00\x03\x0b\xff]", re.DOTALL)

Pieces = list[Piece] | None
"""What a stretch holds; nothing where it is not a row of whole members."""


class Spread(Protocol):
    """Applies a function to each part, results in the order of the parts: `map`, or that of an Executor."""

    def __call__(self, function: Callable[[bytes], Pieces], parts: Iterable[bytes], /) -> Iterator[Pieces]: ...


def unpack_ahead(file: BinaryIO, form: Compression, begin: int, spread: Spread | None) -> Iterator[Piece]:
    """What `unpack` gives, some stretches ahead through `spread`.

    A stretch goes from one place that looks like the header of a member to a later one. Where it turns out to be
    anything but whole members, it is unpacked in order, on to the next member that is good and begins behind it.
    """
    if spread is None or form is not COMPRESSIONS["gzip"]:
        yield from unpack(file, form, begin)
        return
    end = file.seek(0, os.SEEK_END)
    begin = yield from unpack(file, form, begin, begin + STRETCH)  # a few packets need no more
    while begin < end:
        reached = yield from _whole_stretches(file, begin, spread)
        begin = yield from unpack(file, form, reached, reached + STRETCH)


def _whole_stretches(file: BinaryIO, begin: int, spread: Spread) -> Generator[Piece, None, int]:
    """The pieces of the stretches from `begin` to the first that is not good; returns where this one begins."""
    waiting = deque[tuple[int, Iterator[Pieces]]]()
    stretches = _stretches(file, begin)
    while True:
        while len(waiting) < AHEAD and (packed := next(stretches, b"")):
            waiting.append((len(packed), spread(_unpack_stretch, (packed,))))
        if not waiting:
            return begin
        length, found = waiting.popleft()
        pieces = next(found)
        if pieces is None:
            return begin
        for piece in pieces:
            yield Piece(begin + piece.member, piece.data, "")
        begin += length


def _stretches(file: BinaryIO, begin: int) -> Iterator[bytes]:
    """The file from `begin`, cut where members may begin; it ends early where none does for long."""
    data = b""
    while True:
        file.seek(begin + len(data))
        data += file.read(LONGEST + LONGEST_MAGIC - len(data))
        found = HEADER.search(data, STRETCH)
        if found is None:
            if len(data) < LONGEST and data:
                yield data
            return
        yield data[: found.start()]
        begin += found.start()
        data = data[found.start() :]


def _unpack_stretch(packed: bytes) -> Pieces:
    pieces, size = list[Piece](), 0
    for piece in unpack(BytesIO(packed), COMPRESSIONS["gzip"]):
        size += len(piece.data)
        if piece.damage or size > LARGEST:
            return None
        pieces.append(piece)
    return pieces
