"""Lists the logs below a folder; reads only the beginning and the end of each file."""

import contextlib
import math
import os
import zlib
from collections.abc import Callable, Iterable, Iterator
from itertools import islice
from operator import itemgetter
from pathlib import Path
from typing import NamedTuple

import numpy as np

import imc
from imc.discovery import displayable_name
from imc.layout import SYNC
from imc.lsf import COMPRESSIONS, Batch, Compression, DamageList, log_file_names, scan
from runtime.logs import Array, SystemNames, packet_headers, without_outliers

TAIL = 1 << 19  # bytes
GLANCE = 200  # packets
NEAR = 1 << 13  # bytes of a first look at beginning and end
NEAR_TAIL = 1 << 16  # packed bytes in which the last member should begin
LARGEST_MEMBER = 1 << 24
MOST_TRIED = 8  # members at the end; the bytes that begin one also occur by chance


class LogOverview(NamedTuple):
    """A log: its file, its system, begin and end (s since 1970 UTC; NaN if unknown), bytes on disk, what is wrong."""

    path: Path
    system: str
    start: float
    end: float
    size: int
    problem: str


def logs_below(folder: Path) -> list[LogOverview]:
    """The logs in a folder and its subfolders, by path; of several Data.lsf files in one, the one `imc.Log` opens."""
    found: list[Path] = []
    for place, folders, files in os.walk(folder):
        folders.sort()
        found += [Path(place, name) for name in log_file_names(files)]
    names = SystemNames()
    return [log_overview(path, names) for path in sorted(found)]


def log_overview(path: Path, names: SystemNames) -> LogOverview:
    """Look at the first and the last messages of a log."""
    size = 0
    try:
        size = path.stat().st_size
        if not path.is_file():
            return LogOverview(path, "", math.nan, math.nan, size, "not a file")
        if (seen := _quick_glance(path, size, names)) is not None:
            return seen
        log = imc.Log(path, schema=imc.builtin())
        packets = [packet for _, packet in islice(log.packets(), GLANCE)] if size else []
        first = _headers(packets)
        if first is None and size:
            log = imc.Log(path)  # another IMC version has another sync number
            packets = [packet for _, packet in islice(log.packets(), GLANCE)]
            first = _headers(packets, log.schema.sync)
        if first is None:
            return LogOverview(path, "", math.nan, math.nan, size, "no message in it" if size else "empty")
        last = _headers(_last_packets(path, log.schema), log.schema.sync)
        if last is None:
            last = _headers((packet for _, packet in log.packets()), log.schema.sync)
    except OSError as error:
        return LogOverview(path, "", math.nan, math.nan, size, error.strerror or str(error))
    except imc.SchemaError as error:
        return LogOverview(path, "", math.nan, math.nan, size, str(error))
    owners, counts = np.unique(first["src"], return_counts=True)
    owner = int(owners[counts.argmax()])
    system = _announced(packets, owner) or names.system_name(owner)
    return LogOverview(path, system, _bound(first, owner, np.min), _bound(last, owner, np.max), size, "")


def _quick_glance(path: Path, size: int, names: SystemNames) -> LogOverview | None:
    """The same from a few KiB; None if it takes a closer look: damage, another sync number, few messages at the end."""
    form = next((form for form in COMPRESSIONS.values() if form.suffix == path.suffix), None)
    with path.open("rb") as file:
        head = file.read(NEAR)
        file.seek(max(0, size - (NEAR_TAIL if form else NEAR)))
        tail = file.read(NEAR_TAIL)
    try:
        batch = _first_batch(form.unpacker().decompress(head, NEAR) if form else head)
    except (OSError, zlib.error):
        return None
    if batch is None:
        return None
    first = _seen(batch)
    owners, counts = np.unique(first["src"][:GLANCE], return_counts=True)
    owner = int(owners[counts.argmax()])
    begin = _bound(first[:GLANCE], owner, np.min)
    for ending in _last_members(tail, form) if form else (tail,):
        last = _first_batch(ending)
        end = math.nan if last is None else _bound(_seen(last), owner, np.max)
        if not math.isnan(begin) and not math.isnan(end):
            announced = batch.select((batch.heads & 0xFFFF) == imc.Announce.ID).packets()
            return LogOverview(
                path, _announced(map(itemgetter(1), announced), owner) or names.system_name(owner), begin, end, size, ""
            )
    return None


def _last_members(tail: bytes, form: Compression) -> Iterator[bytes]:
    """The ends of the members that begin in `tail`, the last one first."""
    for match in reversed(list(form.magic.finditer(tail))[-MOST_TRIED:]):
        try:
            yield form.unpacker().decompress(tail[match.start() :], LARGEST_MEMBER)[-NEAR:]
        except (OSError, zlib.error):
            continue


def _first_batch(data: bytes) -> Batch | None:
    """The packets in a part of a log: scan puts at least this much into one batch."""
    return next(scan([data], SYNC, DamageList()), None)


def _seen(batch: Batch) -> Array:
    """System and time of packets."""
    found = np.empty(batch.starts.size, [("src", "u2"), ("timestamp", "f8")])
    found["src"], found["timestamp"] = batch.header_values("src"), batch.times()
    return found


def _announced(packets: Iterable[bytes], owner: int) -> str:
    """The name with which a system announces itself among the first packets of its log; "" if it does not."""
    for packet in packets:
        with contextlib.suppress(imc.DecodeError):
            message = imc.decode(packet)
            if (
                isinstance(message, imc.Announce)
                and message.src == owner
                and (name := displayable_name(message.sys_name))
            ):
                return name
    return ""


def _headers(packets: Iterable[bytes], sync: int = SYNC) -> Array | None:
    found = packet_headers(list(packets), sync)
    return found if len(found) else None


def _bound(heads: Array | None, owner: int, pick: Callable[[Array], float]) -> float:
    """The first or last time of a system, without stray times."""
    if heads is None:
        return math.nan
    times = heads["timestamp"][heads["src"] == owner]
    near = without_outliers(times)
    return float(pick(near)) if len(near) else math.nan


def _last_packets(path: Path, schema: imc.Schema) -> list[bytes]:
    """The packets in the end of a file; none if no compressed member begins there."""
    with path.open("rb") as file:
        file.seek(max(0, path.stat().st_size - TAIL))
        tail = file.read(TAIL)
    form = next((form for form in COMPRESSIONS.values() if form.suffix == path.suffix), None)
    parser = imc.StreamParser(schema.codec)
    packets = parser.feed_packets(_unpacked(tail, form) if form else tail) + parser.close_packets()
    return packets[-GLANCE:]


def _unpacked(tail: bytes, form: Compression) -> bytes:
    """The content of the compressed members that begin in the end of a file."""
    data, position = bytearray(), 0
    while (match := form.magic.search(tail, position)) is not None:
        unpacker = form.unpacker()
        try:
            data += unpacker.decompress(tail[match.start() :], LARGEST_MEMBER)
        except (OSError, zlib.error):
            position = match.start() + 1
            continue
        position = len(tail) - len(unpacker.unused_data) if unpacker.eof else len(tail)
    return bytes(data)
