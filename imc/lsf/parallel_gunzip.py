"""Unpacks a gzip file in independent stretches, so that several threads can share the work."""

import os
import re
from collections import deque
from collections.abc import Callable, Generator, Iterable, Iterator
from io import BytesIO
from typing import BinaryIO, Protocol

from imc.lsf.gzip_members import COMPRESSIONS, LONGEST_MAGIC, Compression, MemberData, unpack_members

STRETCH = 1 << 18  # packed bytes unpacked together, about
LONGEST = 1 << 20  # packed bytes within which a member must begin
LARGEST = 1 << 22  # most unpacked bytes of a stretch, which bounds the memory
AHEAD = 8  # stretches being unpacked at a time
HEADER = re.compile(rb"\x1f\x8b\x08\x00....[\x00\x02\x04][\x00\x03\x0b\xff]", re.DOTALL)

Pieces = list[MemberData] | None
"""The contents of a stretch; None if it is not a sequence of whole members."""


class ParallelMap(Protocol):
    """Applies a function to each part and gives the results in order: `map`, or that of an Executor."""

    def __call__(self, function: Callable[[bytes], Pieces], parts: Iterable[bytes], /) -> Iterator[Pieces]: ...


def unpack_ahead(
    file: BinaryIO, form: Compression, begin: int, spread: ParallelMap | None, unpacked: int = 0
) -> Iterator[MemberData]:
    """Do the same as `unpack_members`, but some stretches ahead with `spread`.

    A stretch goes from one place that looks like the header of a member to a later one. If it is not a sequence of
    whole members, it is unpacked in order, up to the next good member after it.
    """
    # Finding headers without unpacking is a guess: the same bytes may occur inside a member. A wrong cut leaves half a
    # member at the end of a stretch, which `_unpack_stretch` notices. So a bad guess costs time, but never data.
    if spread is None or form is not COMPRESSIONS["gzip"]:
        yield from unpack_members(file, form, begin, unpacked=unpacked)
        return
    end = file.seek(0, os.SEEK_END)
    # enough for a reader of a few packets
    begin, unpacked = yield from unpack_members(file, form, begin, begin + STRETCH, unpacked)
    while begin < end:
        begin, unpacked = yield from _whole_stretches(file, begin, unpacked, spread)
        begin, unpacked = yield from unpack_members(file, form, begin, begin + STRETCH, unpacked)


def _whole_stretches(
    file: BinaryIO, begin: int, unpacked: int, spread: ParallelMap
) -> Generator[MemberData, None, tuple[int, int]]:
    """The pieces of the stretches from `begin` to the first bad one; returns its begin, as `unpack_members`."""
    waiting = deque[tuple[int, Iterator[Pieces]]]()
    stretches = _stretches(file, begin)
    while True:
        while len(waiting) < AHEAD and (packed := next(stretches, b"")):
            waiting.append((len(packed), spread(_unpack_stretch, (packed,))))
        if not waiting:
            return begin, unpacked
        length, found = waiting.popleft()
        pieces = next(found)
        if pieces is None:
            return begin, unpacked
        for piece in pieces:
            unpacked += len(piece.data)
            yield MemberData(begin + piece.member, piece.data, "")
        begin += length


def _stretches(file: BinaryIO, begin: int) -> Iterator[bytes]:
    """The file from `begin`, cut where members may begin; stops early if none begins within LONGEST bytes."""
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
    pieces, size = list[MemberData](), 0
    for piece in unpack_members(BytesIO(packed), COMPRESSIONS["gzip"]):
        size += len(piece.data)
        if piece.damage or size > LARGEST:
            return None
        pieces.append(piece)
    return pieces
