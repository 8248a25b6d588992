"""Lists the logs below a folder; reads only the beginning and the end of each file."""

import math
import os
import zlib
from collections.abc import Callable, Iterable
from itertools import islice
from pathlib import Path
from typing import NamedTuple

import numpy as np

import imc
from imc.layout import SYNC
from imc.lsf import COMPRESSIONS, Compression
from runtime.logs import Array, Names, headers, without_strays

TAIL = 1 << 19  # bytes
GLANCE = 200  # packets
LARGEST_MEMBER = 1 << 24


class Glance(NamedTuple):
    """A log: its file, its system, begin and end (s since 1970 UTC; NaN if unknown), bytes on disk, what is wrong."""

    path: Path
    system: str
    start: float
    end: float
    size: int
    problem: str


def logs_below(folder: Path) -> list[Glance]:
    """The logs in a folder and its subfolders, by path; of several Data.lsf files in one, the one `imc.Log` opens."""
    found: list[Path] = []
    for place, folders, files in os.walk(folder):
        folders.sort()
        suffixes = (".lsf", *(f".lsf{form.suffix}" for form in COMPRESSIONS.values()))
        preferred = next((f"Data{suffix}" for suffix in suffixes if f"Data{suffix}" in files), None)
        names = [preferred] if preferred else sorted(name for name in files if name.endswith(suffixes))
        found += [Path(place, name) for name in names]
    names = Names()
    return [glance(path, names) for path in sorted(found)]


def glance(path: Path, names: Names) -> Glance:
    """Look at the first and the last messages of a log."""
    size = 0
    try:
        size = path.stat().st_size
        log = imc.Log(path, schema=imc.builtin())
        first = _headers(packet for _, packet in islice(log.packets(), GLANCE)) if size else None
        if first is None and size:
            log = imc.Log(path)  # another IMC version has another sync number
            first = _headers((packet for _, packet in islice(log.packets(), GLANCE)), log.schema.sync)
        if first is None:
            return Glance(path, "", math.nan, math.nan, size, "no message in it" if size else "empty")
        last = _headers(_last_packets(path, log.schema), log.schema.sync)
        if last is None:
            last = _headers((packet for _, packet in log.packets()), log.schema.sync)
    except OSError as error:
        return Glance(path, "", math.nan, math.nan, size, error.strerror or str(error))
    except imc.SchemaError as error:
        return Glance(path, "", math.nan, math.nan, size, str(error))
    owners, counts = np.unique(first["src"], return_counts=True)
    owner = int(owners[counts.argmax()])
    return Glance(path, names.system(owner), _bound(first, owner, np.min), _bound(last, owner, np.max), size, "")


def _headers(packets: Iterable[bytes], sync: int = SYNC) -> Array | None:
    found = headers(list(packets), sync)
    return found if len(found) else None


def _bound(heads: Array | None, owner: int, pick: Callable[[Array], float]) -> float:
    """The first or last time of a system, without stray times."""
    if heads is None:
        return math.nan
    times = heads["timestamp"][heads["src"] == owner]
    near = without_strays(times)
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
