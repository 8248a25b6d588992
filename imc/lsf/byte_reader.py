"""The unpacked bytes of a log file: all of them in order, or parts."""

import os
from bisect import bisect_left, bisect_right
from collections.abc import Callable, Iterator
from io import BufferedReader
from pathlib import Path
from typing import Any, BinaryIO, Protocol, Self

from imc.lsf.gzip_members import COMPRESSIONS, Compression, MemberData
from imc.lsf.parallel_gunzip import ParallelMap, unpack_ahead
from imc.lsf.scanner import PIECE, Lose

MEMORY = 1 << 24
MEMBER_STEP = 1 << 16  # least unpacked bytes between two members of `Members`

Members = list[tuple[int, int]]
"""Beginnings of the members of a compressed file: offset in the file, offset in the unpacked bytes."""

ReportProgress = Callable[[float], None]
"""Called with the share that is done, 0 to 1."""


class ByteReader(Protocol):
    """Reads parts of an open log; close it, or use it in a `with` statement."""

    def read_range(self, begin: int, end: int) -> Any:
        """The bytes from begin to end, fewer if the log ends before, in a buffer that the next call overwrites."""
        ...

    def __enter__(self) -> Self: ...

    def __exit__(self, *error: object) -> None: ...


def compression_of(path: Path) -> Compression | None:
    """Compression of a log, by its suffix; None without one."""
    return next((form for form in COMPRESSIONS.values() if form.suffix == path.suffix), None)


def unpacked_chunks(
    path: Path,
    lose: Lose,
    members: Members | None = None,
    progress: ReportProgress | None = None,
    spread: ParallelMap | None = None,
) -> Iterator[bytes]:
    """All bytes of a log. Calls `lose` for damaged members; appends to `members` where members begin.

    spread: unpacks stretches of the file ahead.
    """
    form = compression_of(path)
    with path.open("rb") as file:
        size = max(1, file.seek(0, os.SEEK_END))
        file.seek(0)
        for chunk in _plain_chunks(file) if form is None else _unpacked_chunks(file, form, lose, members, spread):
            yield chunk
            if progress:
                progress(min(1.0, file.tell() / size))


def _plain_chunks(file: BinaryIO) -> Iterator[bytes]:
    while chunk := file.read(PIECE):
        yield chunk


def _unpacked_chunks(
    file: BinaryIO, form: Compression, lose: Lose, members: Members | None, spread: ParallelMap | None
) -> Iterator[bytes]:
    offset, member = 0, -1
    for piece in unpack_ahead(file, form, 0, spread):
        if piece.member != member:
            member = piece.member
            # A reader that begins at a false member would report it as damage.
            if members is not None and not piece.doubtful and (not members or offset - members[-1][1] >= MEMBER_STEP):
                members.append((member, offset))
        if piece.damage:
            lose(offset, 0, piece.damage)
        offset += len(piece.data)
        yield piece.data


def open_reader(path: Path, members: Members, lose: Lose, spread: ParallelMap | None = None) -> ByteReader:
    """A reader of parts of a log; `members` is the list that `unpacked_chunks` filled. Raises OSError.

    Calls `lose` for damaged members.
    """
    form = compression_of(path)
    file = path.open("rb")
    return _Plain(file) if form is None else _Packed(file, form, members, lose, spread)


class _Plain:
    def __init__(self, file: BufferedReader):
        self._file = file
        self._buffer = bytearray()

    def read_range(self, begin: int, end: int) -> memoryview:
        if len(self._buffer) < end - begin:
            self._buffer = bytearray(end - begin)
        self._file.seek(begin)
        view = memoryview(self._buffer)[: end - begin]
        return view[: self._file.readinto(view)]

    def __enter__(self) -> Self:
        return self

    def __exit__(self, *error: object) -> None:
        self._file.close()


class _Packed:
    """Unpacks from the last known member before the wanted bytes, or continues from its position.

    It keeps the latest MEMORY bytes, because messages read in order of time may be a little out of order in the log.
    """

    def __init__(self, file: BinaryIO, form: Compression, members: Members, lose: Lose, spread: ParallelMap | None):
        self._file = file
        self._lose = lose
        self._spread = spread
        self._form = form
        self._packed = [packed for packed, _ in members]
        self._unpacked = [unpacked for _, unpacked in members]
        self._pieces: Iterator[MemberData] = iter(())
        self._starts: list[int] = []
        self._blocks: list[bytes] = []
        self._end = 0

    def read_range(self, begin: int, end: int) -> bytes:
        nearest = bisect_right(self._unpacked, begin) - 1
        known = self._unpacked[nearest] if nearest >= 0 else 0
        if not self._starts or begin < self._starts[0] or known > self._end:
            packed = self._packed[nearest] if nearest >= 0 else 0
            self._pieces = unpack_ahead(self._file, self._form, packed, self._spread, known)
            self._starts, self._blocks, self._end = [], [], known
        while self._end < end and (piece := next(self._pieces, None)):
            if piece.damage:
                self._lose(self._end, 0, piece.damage)
            if piece.data:
                self._starts.append(self._end)
                self._blocks.append(piece.data)
                self._end += len(piece.data)
            while len(self._starts) > 1 and self._starts[1] <= min(begin, self._end - MEMORY):
                del self._starts[0], self._blocks[0]
        first = max(0, bisect_right(self._starts, begin) - 1)
        last = bisect_left(self._starts, end)
        base = self._starts[first] if self._starts else 0
        return b"".join(self._blocks[first:last])[begin - base : end - base]

    def __enter__(self) -> Self:
        return self

    def __exit__(self, *error: object) -> None:
        self._file.close()
