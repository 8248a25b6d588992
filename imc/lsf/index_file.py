"""Indices of logs on disk: in the user's cache, or beside the log."""

import errno
import hashlib
import os
from collections.abc import Iterator, Sequence
from hmac import compare_digest
from itertools import pairwise
from pathlib import Path
from typing import Annotated, Any

import msgspec
from fastcrc import crc32

from imc.layout import SMALLEST_PACKET
from imc.lsf.byte_reader import Members, ReportProgress, compression_of, unpacked_chunks
from imc.lsf.damage_list import DamageList
from imc.lsf.index import LogIndex, TypeIndex, build_index
from imc.lsf.parallel_gunzip import ParallelMap
from imc.lsf.scanner import Batch, scan
from imc.stream import Loss
from support.atomic_files import replace_file
from support.user_folders import cache_folder

SUFFIX = ".index"
MAGIC = b"SHOALIX2"
KEY_SIZE, SIGNATURE_SIZE = 32, 16
ENDS = 1 << 16  # bytes at each end of the log that identify its state
LARGEST = 1 << 27  # bytes of an index
LARGEST_HEAD = 1 << 22
CACHE = 1 << 28  # bytes of all indices in the cache
MOST_PACKETS = 1 << 26  # bounds the memory of an index

Number = Annotated[int, msgspec.Meta(ge=0, lt=1 << 48)]
Id = Annotated[int, msgspec.Meta(ge=0, lt=1 << 16)]


class FileState(msgspec.Struct, frozen=True):
    """Identifies a state of a log file."""

    size: int
    changed: int
    """ns since 1970 UTC"""
    touched: int
    """Time as in `changed`, but of the file's state, which no program can set"""
    ends: bytes
    """A digest of the start and the end of the file."""


class _Type(msgspec.Struct, frozen=True):
    id: Id
    count: Number
    step_width: Number
    sizes: Number
    bigs: Number


class _Head(msgspec.Struct, frozen=True):
    stamp: FileState
    sync: int
    crc: bool
    length: Number
    arrays: Number
    types: list[_Type]
    losses: list[tuple[Number, Number, str]]
    members: list[tuple[Number, Number]]


def file_state(path: Path) -> FileState:
    """The state of a log file. Raises OSError."""
    with path.open("rb") as file:
        state = os.fstat(file.fileno())
        digest = hashlib.blake2b(file.read(ENDS), digest_size=16)
        file.seek(max(0, state.st_size - ENDS))
        digest.update(file.read(ENDS))
    return FileState(state.st_size, state.st_mtime_ns, state.st_ctime_ns, digest.digest())


def open_index(
    path: Path,
    sync: int,
    crc: bool,
    places: Sequence[Path],
    loaded: bool = True,
    progress: ReportProgress | None = None,
    spread: ParallelMap | None = None,
) -> LogIndex:
    """The index of a log: if `loaded`, one in `places` that matches the log's present state; else a new one.

    A new one is saved in the first of the places that can be written. Raises OSError if the log cannot be read.
    """
    stamp = file_state(path)
    index = read_index(places, stamp, sync, crc, packed=compression_of(path) is not None) if loaded else None
    if index is None:
        members: Members = []
        lose = DamageList()
        length = 0

        def counted() -> Iterator[bytes]:
            nonlocal length
            for chunk in unpacked_chunks(path, lose, members, progress, spread):
                length += len(chunk)
                yield chunk

        types = build_index(_limited(scan(counted(), sync, lose, crc), path))
        index = LogIndex(types, lose.sorted(), members, crc, length)
        if places and file_state(path) == stamp:
            write_index(path, places, index, stamp, sync)
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


def path_beside(log: Path) -> Path:
    """Path of the index of a log that is kept beside it."""
    return log.with_name(log.name + SUFFIX)


def path_in_cache(log: Path) -> list[Path]:
    """Path of the index of a log in the user's cache; empty if the user has no home."""
    try:
        cache = cache_folder() / "logs"
    except RuntimeError:
        return []
    name = hashlib.blake2b(os.fsencode(log.resolve()), digest_size=16).hexdigest()
    return [cache / (name + SUFFIX)]


def _key() -> bytes:
    """The user's secret, which signs indices, so that only the user's own are used. Raises OSError, RuntimeError."""
    path = cache_folder() / "logs" / "key"
    if path.is_file() and len(found := path.read_bytes()) == KEY_SIZE:
        return found
    path.parent.mkdir(parents=True, exist_ok=True, mode=0o700)
    with replace_file(path, 0o600, durable=False) as file:
        file.write(made := os.urandom(KEY_SIZE))
    return made


def read_index(places: Sequence[Path], stamp: FileState, sync: int, crc: bool, *, packed: bool) -> LogIndex | None:
    """The index on disk of a log in this state; None if it is missing, damaged or of another state."""
    for place in places:
        try:
            if not place.is_file() or place.stat().st_size > LARGEST:
                continue
            head, index = _decode(place.read_bytes(), _key())
        except (OSError, RuntimeError, ValueError, msgspec.DecodeError):
            continue
        matches = head.stamp == stamp and head.sync == sync and (packed or index.length == stamp.size)
        if matches and (head.crc == crc or (head.crc and not head.losses)):
            return index
    return None


def write_index(log: Path, places: Sequence[Path], index: LogIndex, stamp: FileState, sync: int) -> Path | None:
    """Write the index of a log in this state, and return its path; None if it cannot be written.

    In the cache, the oldest indices make room for it.
    """
    try:
        parts = _encode(index, stamp, sync, _key())
    except (OSError, RuntimeError):
        return None
    if sum(len(part) for part in parts) > LARGEST:
        return None
    for place in places:
        try:
            place.parent.mkdir(parents=True, exist_ok=True, mode=0o700)
            with replace_file(place, 0o600, durable=False) as file:
                file.writelines(parts)
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


def _encode(index: LogIndex, stamp: FileState, sync: int, key: bytes) -> list[bytes | memoryview]:
    types: list[_Type] = []
    parts: list[bytes | memoryview] = []
    for number, found in index.types.items():
        types.append(_Type(number, found.total, found.steps.itemsize, found.sizes.size, found.big.size))
        for array in (found.steps, found.sizes, found.big):
            parts.append(array.astype(array.dtype.newbyteorder("<"), copy=False).data.cast("B"))
    losses = [(loss.offset, loss.length, loss.reason) for loss in index.losses]
    checksum = 0
    for part in parts:
        checksum = crc32.iso_hdlc(part, checksum)
    found = _Head(stamp, sync, index.crc, index.length, checksum, types, losses, index.members)
    head = msgspec.msgpack.encode(found)
    return [MAGIC, _signature(head, key), len(head).to_bytes(4, "little"), head, *parts]


def _signature(head: bytes | memoryview, key: bytes) -> bytes:
    return hashlib.blake2b(head, digest_size=SIGNATURE_SIZE, key=key).digest()


def _decode(data: bytes, key: bytes) -> tuple[_Head, LogIndex]:
    """Raises ValueError or msgspec.DecodeError if it is not an index that was signed with the key."""
    # Only the head is signed, since that takes no time. With right ids and counts, nothing can be hidden in the arrays:
    # each packet is checked when it is read.
    import numpy as np

    begin = len(MAGIC) + SIGNATURE_SIZE
    signature, body = data[len(MAGIC) : begin], memoryview(data)[begin:]
    place = 4 + int.from_bytes(body[:4], "little")
    known = data.startswith(MAGIC) and place <= LARGEST_HEAD
    if not known or not compare_digest(_signature(body[4:place], key), signature):
        raise ValueError("not an index of this user, or damaged")
    head = msgspec.msgpack.decode(body[4:place], type=_Head)
    if crc32.iso_hdlc(body[place:]) != head.arrays:
        raise ValueError("damaged")
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
