"""Indices of logs on disk: in the user's cache, or beside the log."""

import errno
import hashlib
import os
from collections.abc import Iterator, Sequence
from itertools import pairwise
from pathlib import Path
from typing import Annotated, Any

import msgspec
from fastcrc import crc32

from imc.layout import SMALLEST_PACKET
from imc.lsf.bytes import Members, ReportShare, chunks, compression_of
from imc.lsf.index import LogIndex, TypeIndex, build
from imc.lsf.members_ahead import Spread
from imc.lsf.losses import Losses
from imc.lsf.scanner import Batch, scan
from imc.stream import Loss

SUFFIX = ".index"
MAGIC = b"SHOALIX2"
ENDS = 1 << 16  # bytes at each end of the log that identify its state
LARGEST = 1 << 27  # bytes of an index
LARGEST_HEAD = 1 << 22
CACHE = 1 << 28  # bytes of all indices in the cache
MOST_PACKETS = 1 << 26  # bounds the memory of an index

Number = Annotated[int, msgspec.Meta(ge=0, lt=1 << 48)]
Id = Annotated[int, msgspec.Meta(ge=0, lt=1 << 16)]


class Stamp(msgspec.Struct, frozen=True):
    """Identifies a state of a log file."""

    size: int
    changed: int
    """ns since 1970 UTC"""
    ends: bytes
    """A digest of the start and the end of the file."""


class _Type(msgspec.Struct, frozen=True):
    id: Id
    count: Number
    step_width: Number
    sizes: Number
    bigs: Number


class _Head(msgspec.Struct, frozen=True):
    stamp: Stamp
    sync: int
    crc: bool
    length: Number
    types: list[_Type]
    losses: list[tuple[Number, Number, str]]
    members: list[tuple[Number, Number]]


def stamp_of(path: Path) -> Stamp:
    """The state of a log file. Raises OSError."""
    with path.open("rb") as file:
        state = os.fstat(file.fileno())
        digest = hashlib.blake2b(file.read(ENDS), digest_size=16)
        file.seek(max(0, state.st_size - ENDS))
        digest.update(file.read(ENDS))
    return Stamp(state.st_size, state.st_mtime_ns, digest.digest())


def index_of(
    path: Path,
    sync: int,
    crc: bool,
    places: Sequence[Path],
    loaded: bool = True,
    progress: ReportShare | None = None,
    spread: Spread | None = None,
) -> LogIndex:
    """The index of a log: if `loaded`, one in `places` that matches the log's present state; else a new one.

    A new one is saved in the first of the places that can be written. Raises OSError if the log cannot be read.
    """
    stamp = stamp_of(path)
    index = load(places, stamp, sync, crc, packed=compression_of(path) is not None) if loaded else None
    if index is None:
        members: Members = []
        lose = Losses()
        length = 0

        def counted() -> Iterator[bytes]:
            nonlocal length
            for chunk in chunks(path, lose, members, progress, spread):
                length += len(chunk)
                yield chunk

        types = build(_limited(scan(counted(), sync, lose, crc), path))
        index = LogIndex(types, lose.sorted(), members, crc, length)
        if places and stamp_of(path) == stamp:
            save(path, places, index, stamp, sync)
    return index


def _limited(batches: Iterator[Batch], path: Path) -> Iterator[Batch]:
    count = 0
    for batch in batches:
        count += batch.starts.size
        if count > MOST_PACKETS:
            raise OSError(errno.EFBIG, f"more than {MOST_PACKETS} packets; cut it first (shoal log cut)", str(path))
        yield batch


def has_index(path: Path, places: Sequence[Path]) -> bool:
    """Whether an index in one of the places may match the log's present state."""
    changed = path.stat().st_mtime_ns
    return any(place.is_file() and place.stat().st_mtime_ns >= changed for place in places)


def beside(log: Path) -> Path:
    """Where the index of a log is if it is kept beside it."""
    return log.with_name(log.name + SUFFIX)


def in_cache(log: Path) -> list[Path]:
    """Where the index of a log is in the user's cache; nowhere if the user has no home."""
    folder = os.environ.get("XDG_CACHE_HOME", "")
    try:
        cache = Path(folder) if os.path.isabs(folder) else Path.home() / ".cache"
    except RuntimeError:
        return []
    name = hashlib.blake2b(os.fsencode(log.resolve()), digest_size=16).hexdigest()
    return [cache / "shoal" / "logs" / (name + SUFFIX)]


def load(places: Sequence[Path], stamp: Stamp, sync: int, crc: bool, *, packed: bool) -> LogIndex | None:
    """The index on disk of a log in this state; None if it is missing, damaged or of another state."""
    for place in places:
        try:
            if not place.is_file() or place.stat().st_size > LARGEST:
                continue
            head, index = _decode(place.read_bytes())
        except (OSError, ValueError, msgspec.DecodeError):
            continue
        matches = head.stamp == stamp and head.sync == sync and (packed or index.length == stamp.size)
        if matches and (head.crc == crc or (head.crc and not head.losses)):
            return index
    return None


def save(log: Path, places: Sequence[Path], index: LogIndex, stamp: Stamp, sync: int) -> Path | None:
    """Write the index of a log in this state, and return its path; None if it cannot be written.

    In the cache, the oldest indices make room for it.
    """
    parts = _encode(index, stamp, sync)
    if sum(len(part) for part in parts) > LARGEST:
        return None
    for place in places:
        waiting = place.with_name(f".{place.name}.{os.getpid()}")
        try:
            place.parent.mkdir(parents=True, exist_ok=True, mode=0o700)
            try:
                with waiting.open("xb") as file:
                    file.writelines(parts)
                waiting.replace(place)
            finally:
                waiting.unlink(missing_ok=True)
            if place.parent != log.parent:
                _make_room(place.parent)
        except OSError:
            continue
        return place
    return None


def _make_room(cache: Path) -> None:
    kept = [(file.stat(), file) for file in cache.glob("*" + SUFFIX)]
    size = 0
    for state, file in sorted(kept, key=lambda item: -item[0].st_mtime_ns):
        size += state.st_size
        if size > CACHE:
            file.unlink(missing_ok=True)


def _encode(index: LogIndex, stamp: Stamp, sync: int) -> list[bytes | memoryview]:
    types: list[_Type] = []
    parts: list[bytes | memoryview] = []
    for number, found in index.types.items():
        types.append(_Type(number, found.total, found.steps.itemsize, found.sizes.size, found.big.size))
        for array in (found.steps, found.sizes, found.big):
            parts.append(array.astype(array.dtype.newbyteorder("<"), copy=False).data.cast("B"))
    losses = [(loss.offset, loss.length, loss.reason) for loss in index.losses]
    head = msgspec.msgpack.encode(_Head(stamp, sync, index.crc, index.length, types, losses, index.members))
    parts[:0] = [len(head).to_bytes(4, "little"), head]
    checksum = 0
    for part in parts:
        checksum = crc32.iso_hdlc(part, checksum)
    return [MAGIC, checksum.to_bytes(4, "little"), *parts]


def _decode(data: bytes) -> tuple[_Head, LogIndex]:
    """Raises ValueError or msgspec.DecodeError if it is not an index; no number in the file is trusted."""
    import numpy as np

    begin = len(MAGIC) + 4
    body = memoryview(data)[begin:]
    if not data.startswith(MAGIC) or crc32.iso_hdlc(body) != int.from_bytes(data[len(MAGIC) : begin], "little"):
        raise ValueError("not an index, or damaged")
    place = 4 + int.from_bytes(body[:4], "little")
    if place > LARGEST_HEAD:
        raise ValueError("too large")
    head = msgspec.msgpack.decode(body[4:place], type=_Head)
    types: dict[int, TypeIndex] = {}
    covered = sum(length for _, length, _ in head.losses)

    def take(kind: str, count: int) -> Any:
        nonlocal place
        array = np.frombuffer(body, kind, count, place)
        place += array.nbytes
        return array

    for entry in head.types:
        if not (entry.count > 0 and {entry.sizes, entry.bigs} <= {1, entry.count} and entry.step_width in (2, 4, 8)):
            raise ValueError("wrong counts")
        found = TypeIndex(
            entry.count, take(f"<u{entry.step_width}", entry.count), take("<u2", entry.sizes), take("u1", entry.bigs)
        )
        steps = found.steps
        if (steps[1:] < SMALLEST_PACKET).any() or float(steps.sum(dtype="f8")) + SMALLEST_PACKET > head.length:
            raise ValueError("packets outside the log")
        covered += found.total * SMALLEST_PACKET + int(found.sizes.sum(dtype="i8")) * (found.total // found.sizes.size)
        types[entry.id] = found
    if covered != head.length:  # each byte of a log is in a packet or in a loss
        raise ValueError("packets are missing, or are there twice")
    members: Members = head.members
    if any(a >= b for pair in pairwise(members) for a, b in zip(*pair, strict=True)):
        raise ValueError("members out of order")
    return head, LogIndex(types, [Loss(*loss) for loss in head.losses], members, head.crc, head.length)
