"""Indices of logs on disk: beside the log, or in the user's cache if its folder is not writable."""

import hashlib
import os
from itertools import pairwise
from pathlib import Path
from typing import Annotated, Any

import msgspec
from fastcrc import crc32

from imc.layout import SMALLEST_PACKET
from imc.lsf.bytes import Members, ReportShare, chunks
from imc.lsf.index import LogIndex, TypeIndex, build
from imc.lsf.members_ahead import Spread
from imc.lsf.scanner import scan
from imc.stream import Loss

SUFFIX = ".index"
MAGIC = b"SHOALIX1"
ENDS = 1 << 16  # bytes at each end of the log that identify its state
LARGEST = 1 << 31

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
    kept: bool,
    loaded: bool = True,
    progress: ReportShare | None = None,
    spread: Spread | None = None,
) -> LogIndex:
    """The index of a log: the one on disk, if `loaded`, and if it matches the log's present state; else a new one, saved if `kept`.

    Raises OSError if the log cannot be read.
    """
    stamp = stamp_of(path)
    index = load(path, stamp, sync, crc) if kept and loaded else None
    if index is None:
        members: Members = []
        losses: dict[tuple[int, str], Loss] = {}

        def lose(offset: int, length: int, reason: str) -> None:
            losses[offset, reason] = Loss(offset, length, reason)

        types = build(scan(chunks(path, lose, members, progress, spread), sync, lose, crc))
        index = LogIndex(types, sorted(losses.values()), members, crc)
        if kept and stamp_of(path) == stamp:
            save(path, index, stamp, sync)
    return index


def has_index(path: Path) -> bool:
    """Whether an index on disk may match the log's present state."""
    changed = path.stat().st_mtime_ns
    return any(place.is_file() and place.stat().st_mtime_ns >= changed for place in places_for(path))


def places_for(log: Path) -> list[Path]:
    """Where the index of a log may be, the best place first."""
    cache = Path(os.environ.get("XDG_CACHE_HOME") or Path.home() / ".cache") / "shoal" / "logs"
    name = hashlib.blake2b(os.fsencode(log.resolve()), digest_size=16).hexdigest()
    return [log.with_name(log.name + SUFFIX), cache / (name + SUFFIX)]


def load(log: Path, stamp: Stamp, sync: int, crc: bool) -> LogIndex | None:
    """The index on disk of a log in this state; None if it is missing, damaged or of another state."""
    for place in places_for(log):
        try:
            if place.stat().st_size > LARGEST:
                continue
            head, index = _decode(place.read_bytes())
        except (OSError, ValueError, msgspec.DecodeError):
            continue
        if head.stamp == stamp and head.sync == sync and (head.crc == crc or (head.crc and not head.losses)):
            return index
    return None


def save(log: Path, index: LogIndex, stamp: Stamp, sync: int) -> Path | None:
    """Write the index of a log in this state, and return its path; None if it cannot be written."""
    parts = _encode(index, stamp, sync)
    for place in places_for(log):
        waiting = place.with_name(f".{place.name}.{os.getpid()}")
        try:
            if place.parent != log.parent:
                place.parent.mkdir(parents=True, exist_ok=True, mode=0o700)
            try:
                with waiting.open("wb") as file:
                    file.writelines(parts)
                waiting.replace(place)
            finally:
                waiting.unlink(missing_ok=True)
        except OSError:
            continue
        return place
    return None


def _encode(index: LogIndex, stamp: Stamp, sync: int) -> list[bytes | memoryview]:
    types: list[_Type] = []
    parts: list[bytes | memoryview] = []
    length = 0
    for number, found in index.types.items():
        last = int(found.steps.sum(dtype="i8"))
        length = max(length, last + int(found.sizes[-1]) + SMALLEST_PACKET)
        types.append(_Type(number, found.total, found.steps.itemsize, found.sizes.size, found.big.size))
        for array in (found.steps, found.sizes, found.big):
            parts.append(array.astype(array.dtype.newbyteorder("<"), copy=False).data.cast("B"))
    losses = [(loss.offset, loss.length, loss.reason) for loss in index.losses]
    head = msgspec.msgpack.encode(_Head(stamp, sync, index.crc, length, types, losses, index.members))
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
    head = msgspec.msgpack.decode(body[4:place], type=_Head)
    types: dict[int, TypeIndex] = {}

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
        types[entry.id] = found
    members: Members = head.members
    if any(a >= b for pair in pairwise(members) for a, b in zip(*pair, strict=True)):
        raise ValueError("members out of order")
    return head, LogIndex(types, [Loss(*loss) for loss in head.losses], members, head.crc)
