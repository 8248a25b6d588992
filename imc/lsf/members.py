"""Compressed files as sequences of independent members: packs members, unpacks files and skips damage."""

import bz2
import math
import os
import re
import struct
import zlib
from collections.abc import Callable, Generator
from pathlib import Path
from typing import Any, BinaryIO, NamedTuple

PACKED_CHUNK = 1 << 14  # unpacks to 16 MiB at most
DOUBTFUL_CHUNK = 1 << 8  # first read of a search for a member, and of what it finds; doubled with each read
SEARCH_CHUNK = 1 << 18
LONGEST_MAGIC = 10


def gzip_member(data: bytes, level: int = 1) -> bytes:
    """`data` as one gzip member, without time, file name or operating system, so that equal data pack equally."""
    packer = zlib.compressobj(level, zlib.DEFLATED, -zlib.MAX_WBITS)
    body = packer.compress(data) + packer.flush()
    return b"\x1f\x8b\x08\0\0\0\0\0\0\xff" + body + struct.pack("<II", zlib.crc32(data), len(data) & 0xFFFFFFFF)


class Compression(NamedTuple):
    """A format: how members are packed, how they begin, and how they are unpacked."""

    suffix: str
    pack: Callable[[bytes], bytes]
    magic: re.Pattern[bytes]
    unpacker: Callable[[], Any]


COMPRESSIONS = {
    "gzip": Compression(".gz", gzip_member, re.compile(rb"\x1f\x8b\x08[\x00-\x1f]"), lambda: zlib.decompressobj(31)),
    "bzip2": Compression(".bz2", bz2.compress, re.compile(rb"BZh[1-9](?:1AY&SY|\x17rE8P\x90)"), bz2.BZ2Decompressor),
    "zlib": Compression(".z", zlib.compress, re.compile(rb"\x78[\x01\x5e\x9c\xda]"), zlib.decompressobj),
}


class Piece(NamedTuple):
    """Unpacked bytes of a member, or its `damage`; `member` is where it begins in the file."""

    member: int
    data: bytes
    damage: str


def unpack(file: BinaryIO, form: Compression, begin: int = 0, stop: float = math.inf) -> Generator[Piece, None, int]:
    """The contents of the members from `begin` on; after damage, continues with the next member that unpacks.

    Stops at the end of the file, or before a member at or after `stop` that follows a good one; returns where that is.
    """
    end, searching = file.seek(0, os.SEEK_END), False
    while begin < end and (searching or begin < stop):
        unpacker, position, produced, damage = form.unpacker(), begin, 0, ""
        chunk = DOUBTFUL_CHUNK if searching else PACKED_CHUNK
        file.seek(begin)
        while not unpacker.eof and not damage:
            packed = file.read(chunk)
            chunk = min(2 * chunk, PACKED_CHUNK)
            try:
                data = unpacker.decompress(packed)
                damage = "" if packed else "cut short"
            except (zlib.error, OSError) as error:
                data, damage = _salvage(file, form, begin, position, packed), str(error)
            position += len(packed)
            produced += len(data)
            yield Piece(begin, data, "")
        if not damage:
            begin, searching = position - len(unpacker.unused_data), False
            continue
        # The magic bytes also occur by chance; such a false member fails soon and is not reported as damage.
        if not searching or produced > 1024:
            name = Path(getattr(file, "name", "")).name
            yield Piece(begin, b"", f"member at byte {begin} of {name}: {damage}")
        begin, searching = _next_member(file, form, begin + 1), True
    return begin


def _salvage(file: BinaryIO, form: Compression, begin: int, position: int, packed: bytes) -> bytes:
    """The content before the damage in `packed`, which was read at `position`; the member starts at `begin`."""
    # A call that fails loses its output. So start the member again, and feed the damaged part byte by byte.
    unpacker = form.unpacker()
    file.seek(begin)
    while file.tell() < position:
        unpacker.decompress(file.read(min(PACKED_CHUNK, position - file.tell())))
    data = bytearray()
    try:
        for number in packed:
            data += unpacker.decompress(bytes((number,)))
    except (zlib.error, OSError, EOFError):
        pass
    return bytes(data)


def _next_member(file: BinaryIO, form: Compression, begin: int) -> int:
    """Where the next member may begin, at or after `begin`; the end of the file if there is none."""
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
