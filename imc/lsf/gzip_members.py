"""Compressed files as sequences of independent members: packs members, unpacks files and skips damage."""

import bz2
import math
import os
import re
import struct
import zlib
from collections.abc import Callable, Generator, Iterator
from pathlib import Path
from typing import Any, BinaryIO, NamedTuple

PACKED_CHUNK = 1 << 14
LARGEST_PIECE = 1 << 20  # unpacked bytes in memory at a time
MOST_TIMES, HARMLESS = 1000, 1 << 24  # a log never shrinks that much; less than 16 MiB may
COST_OF_MEMBER = 1 << 12  # packed bytes that could be read in the time that a false member takes
LONGEST_FALSE = 1024  # unpacked bytes of what only looks like the begin of a member
MOST_WASTED = 8  # bytes read in vain for each byte of progress, and for each of the first LARGEST_PIECE
DOUBTFUL_CHUNK = 1 << 8  # first read of a search for a member, and of what it finds; doubled with each read
SEARCH_CHUNK = 1 << 18
LONGEST_MAGIC = 10
LOST_SECTOR = 512  # bytes
SHORTEST_TAIL = 16  # zeros at the end of a file that are more than the end of a member
_FILLINGS = (bytes(LOST_SECTOR), b"\xff" * LOST_SECTOR)  # what a file system or a memory card leaves of lost data


def compress_member(data: bytes, level: int = 1) -> bytes:
    """`data` as one gzip member, without time, file name or operating system, so that equal data pack equally."""
    packer = zlib.compressobj(level, zlib.DEFLATED, -zlib.MAX_WBITS)
    body = packer.compress(data) + packer.flush()
    return b"\x1f\x8b\x08\0\0\0\0\0\0\xff" + body + struct.pack("<II", zlib.crc32(data), len(data) & 0xFFFFFFFF)


class Compression(NamedTuple):
    """A format: how members are packed, how they begin (`magic`, and its `first` bytes), and how they are unpacked."""

    suffix: str
    pack: Callable[[bytes], bytes]
    first: bytes
    magic: re.Pattern[bytes]
    unpacker: Callable[[], Any]


COMPRESSIONS = {
    "gzip": Compression(
        ".gz", compress_member, b"\x1f\x8b\x08", re.compile(rb"\x1f\x8b\x08[\x00-\x1f]"), lambda: zlib.decompressobj(31)
    ),
    "bzip2": Compression(
        ".bz2", bz2.compress, b"BZh", re.compile(rb"BZh[1-9](?:1AY&SY|\x17rE8P\x90)"), bz2.BZ2Decompressor
    ),
    "zlib": Compression(".z", zlib.compress, b"\x78", re.compile(rb"\x78[\x01\x5e\x9c\xda]"), zlib.decompressobj),
}


class MemberData(NamedTuple):
    """Unpacked bytes of a member, or its `damage`; `member` is where it begins in the file.

    It is `doubtful` whether there is a member if it was searched for after damage.
    """

    member: int
    data: bytes
    damage: str
    doubtful: bool = False


def unpack_members(
    file: BinaryIO, form: Compression, begin: int = 0, stop: float = math.inf, unpacked: int = 0
) -> Generator[MemberData, None, tuple[int, int]]:
    """The contents of the members from `begin` on; after damage, continues with the next member that unpacks.

    Stops at the end of the file, or before a member at or after `stop` that follows a good one; returns where that is
    in the file and in the content. `unpacked` is where `begin` is in the content. If the content is more than
    MOST_TIMES as large as the file up to there, that is damage, and nothing more is read.
    """
    end, searching, first, wasted, again = file.seek(0, os.SEEK_END), False, begin, 0, True
    while begin < end and (searching or begin < stop):
        member, before = _Member(file, form, begin, DOUBTFUL_CHUNK if searching else PACKED_CHUNK, again), unpacked
        for data in member:
            unpacked += len(data)
            yield MemberData(begin, data, "", searching)
            if unpacked > max(HARMLESS, MOST_TIMES * member.end):
                yield MemberData(begin, b"", f"{member}: it unpacks to more than {MOST_TIMES} times its size")
                return end, unpacked
        if not member.damage:
            begin, searching = member.end, False
            continue
        # The magic bytes also occur by chance; such a false member fails soon and is not reported as damage.
        if not searching or unpacked - before > LONGEST_FALSE:
            yield MemberData(begin, b"", f"{member}: {member.damage}")
        # The next member may begin before the place where this one failed. But in a file full of false members that all
        # fail late, looking at each byte again for each of them would take quadratic time.
        wasted += COST_OF_MEMBER + member.end - begin + member.looked
        again = wasted < MOST_WASTED * (begin - first + LARGEST_PIECE)
        after = begin + 1 if again else max(begin + COST_OF_MEMBER, member.end)
        begin, searching = _next_member(file, form, after), True
    return begin, unpacked


class _Member:
    """A member of a file. Iterate over its content; then `end` is where it ends or fails, and `damage` why it fails.

    One that is cut off may by chance unpack on through the next one, whose content would then come twice. And where its
    data is lost, zeros for example, it may unpack to copies of what came before, with good CRCs. So where another one
    begins inside it, or data may be lost, a `wary` one looks ahead whether it ends well, and ends there if not;
    `looked` is how many bytes that took. bzip2 has a checksum in each block, so this does not happen there.
    """

    def __init__(self, file: BinaryIO, form: Compression, begin: int, chunk: int, wary: bool):
        self.begin = self.end = begin
        self.damage = ""
        self.looked = 0
        self._wary = wary
        self._file = file
        self._form = form
        self._chunk = chunk

    def __str__(self) -> str:
        return f"member at byte {self.begin} of {Path(getattr(self._file, 'name', '')).name}"

    def __iter__(self) -> Iterator[bytes]:
        unpacker, produced, chunk = self._form.unpacker(), 0, self._chunk
        can_copy = hasattr(unpacker, "copy")
        wary, checks_filling, at_header = self._wary and can_copy, can_copy, True
        while not unpacker.eof:
            if wary and at_header and self.end > self.begin and self._holds_member():
                if not self._ends_well(unpacker.copy()):
                    self.damage = "cut short"
                    return
                wary = False
            self._file.seek(self.end)
            packed = self._file.read(chunk + LOST_SECTOR - 1)
            lost = _lost_from(packed, len(packed) < chunk + LOST_SECTOR - 1) if checks_filling else -1
            if lost == 0 and self.end > self.begin:
                if not self._ends_well(unpacker.copy(), of_bomb=False):
                    self.damage = f"its data is lost from byte {self.end} on"
                    return
                checks_filling, lost = False, -1
            packed = packed[: lost if lost > 0 else None]
            likely = wary and packed.find(self._form.first, at_header) >= 0  # much faster than the search
            header = self._form.magic.search(packed, at_header) if likely else None
            at_header = header is not None and header.start() < chunk
            packed = packed[: header.start() if header and at_header else chunk]
            if at_header and not packed:
                continue
            chunk = min(2 * chunk, PACKED_CHUNK)
            self.end += len(packed)
            try:
                for data in _contents(unpacker, packed):
                    produced += len(data)
                    yield data
            except (zlib.error, OSError) as error:
                self.damage = str(error)
                yield from self._salvage(self.end - len(packed), produced)
                return
            if not packed:
                self.damage = "cut short"
                return
        self.end -= len(unpacker.unused_data)

    def _holds_member(self) -> bool:
        """Whether another member begins at `end`, and not only its magic bytes, which also occur by chance."""
        self._file.seek(self.end)
        unpacker, packed = self._form.unpacker(), self._file.read(COST_OF_MEMBER)
        self.looked += len(packed)
        try:
            return len(unpacker.decompress(packed, LONGEST_FALSE + 1)) > LONGEST_FALSE or unpacker.eof
        except zlib.error:
            return False

    def _ends_well(self, unpacker: Any, *, of_bomb: bool = True) -> bool:
        """Whether a copy of the unpacker gets from `end` to the end of this member, whose checksum then is right.

        `of_bomb` is the answer if that unpacks to far too much.
        """
        self._file.seek(self.end)
        produced = 0
        try:
            while not unpacker.eof and (packed := self._file.read(PACKED_CHUNK)):
                self.looked += len(packed)
                produced += sum(map(len, _contents(unpacker, packed)))  # integers
                if produced > max(HARMLESS, MOST_TIMES * (self.end + self.looked)):
                    return of_bomb  # if true, `unpack_members` comes there, and stops
        except zlib.error:
            return False
        return unpacker.eof

    def _salvage(self, position: int, known: int) -> Iterator[bytes]:
        """The content before the damage, which is behind `position`; without its first `known` bytes."""
        # A call that fails loses its output. So start the member again, and feed the damaged part byte by byte.
        unpacker = self._form.unpacker()
        self._file.seek(self.begin)
        try:
            while (place := self._file.tell()) < self.end:
                packed = self._file.read(min(PACKED_CHUNK, position - place) if place < position else 1)
                for data in _contents(unpacker, packed):
                    if fresh := data[known:]:
                        yield fresh
                    known = max(0, known - len(data))
        except (zlib.error, OSError, EOFError):
            self.end = self._file.tell()


def _lost_from(packed: bytes, is_end: bool) -> int:
    """Offset in packed bytes of a filling that no data packs to; else -1. `is_end`: they end where the file does.

    A sector of equal bytes would be the same byte half a million times: no packet is so long.
    """
    found = [place for filling in _FILLINGS if (place := packed.find(filling)) >= 0]
    if is_end and len(packed) - (content := len(packed.rstrip(b"\0"))) >= SHORTEST_TAIL:
        found.append(content)
    return min(found, default=-1)


def _contents(unpacker: Any, packed: bytes) -> Iterator[bytes]:
    """Unpack the content that `packed` adds to a member, in pieces of at most LARGEST_PIECE."""
    while True:
        data = unpacker.decompress(packed, LARGEST_PIECE)
        yield data
        if unpacker.eof or len(data) < LARGEST_PIECE:
            return
        packed = getattr(unpacker, "unconsumed_tail", b"")  # bz2 keeps it inside


def _next_member(file: BinaryIO, form: Compression, begin: int) -> int:
    """Possible beginning of the next member, at or after `begin`; the end of the file if there is none."""
    overlap = LONGEST_MAGIC - 1
    file.seek(begin)
    window, chunk = b"", DOUBTFUL_CHUNK
    while block := file.read(chunk):
        window, chunk = window + block, min(2 * chunk, SEARCH_CHUNK)
        if found := form.magic.search(window):
            return begin + found.start()
        begin += max(0, len(window) - overlap)
        window = window[-overlap:]
    return begin + len(window)
