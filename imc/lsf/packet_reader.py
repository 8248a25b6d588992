"""Reads packets by an index, and checks each against the index."""

import errno
from collections.abc import Iterator
from itertools import pairwise
from pathlib import Path
from typing import Any, Self

from fastcrc.crc16 import arc

from imc.layout import LARGEST_PACKET
from imc.lsf.batch_crc_check import PERIOD
from imc.lsf.byte_reader import ByteReader
from imc.lsf.index import PacketPositions
from imc.lsf.scanner import Batch, has_valid_crc, read_at_offsets

WINDOW = 1 << 20  # bytes read at a time
GAP = 1 << 16  # bytes; larger gaps between packets are not read
GROUP = 128  # packets whose CRCs are checked together


class StaleIndex(OSError):
    """A packet is not where the index has it: the log has changed, or the index is of another log."""

    def __init__(self, path: Path, offset: int):
        super().__init__(errno.EIO, f"changed since it was indexed: no such packet at byte {offset}", str(path))


class PacketReader:
    """Reads packets of an open log; close it, or use it in a `with` statement.

    Synchronization number, id, size and, if `crc`, the CRC of each packet are checked when it is read. Raises
    StaleIndex if one is wrong or missing, before any packet of the same batch is given out.
    """

    def __init__(self, path: Path, reader: ByteReader, sync: int, crc: bool):
        self._path = path
        self._reader = reader
        self._sync = sync
        self._crc = crc

    def __enter__(self) -> Self:
        return self

    def __exit__(self, *error: object) -> None:
        self._reader.__exit__(*error)

    def batches(self, places: PacketPositions) -> Iterator[Batch]:
        """The packets with their bytes, read in parts."""
        import numpy as np

        ends = places.ends
        apart = np.flatnonzero(places.offsets[1:] - ends[:-1] > GAP) + 1
        for first, last in pairwise([0, *apart.tolist(), len(ends)]):
            while first < last:
                base = int(places.offsets[first])
                behind = min(last, max(first + 1, int(np.searchsorted(places.offsets, base + WINDOW))))
                part = places.select(slice(first, behind))
                yield self._batch(part, base, self._reader.read_range(base, int(ends[behind - 1])))
                first = behind

    def table_batches(self, tables: list[PacketPositions]) -> Iterator[list[tuple[int, slice, Batch]]]:
        """The packets of several tables in one pass: number of the table, part of it, and the packets of that part."""
        import numpy as np

        windows = [places.offsets // WINDOW for places in tables]
        for window in np.unique(np.concatenate([np.empty(0, np.int64), *windows])).tolist():
            base = window * WINDOW
            data = self._reader.read_range(base, base + WINDOW + LARGEST_PACKET)
            found: list[tuple[int, slice, Batch]] = []
            for number, (places, all_of) in enumerate(zip(tables, windows, strict=True)):
                part = slice(*np.searchsorted(all_of, (window, window + 1)).tolist())
                if part.start < part.stop:
                    found.append((number, part, self._batch(places.select(part), base, data)))
            yield found

    def _batch(self, places: PacketPositions, base: int, data: Any) -> Batch:
        import numpy as np

        starts, ends = places.offsets - base, places.ends - base
        if ends.size and ends[-1] > len(data):
            raise StaleIndex(self._path, int(places.offsets[np.searchsorted(ends, len(data), "right")]))
        batch = Batch(base, data, starts, ends, places.heads, places.big)
        if starts.size and not batch.big.any() and _equal(batch.heads):
            batch = batch._replace(rows=_side_by_side(batch))
        right = self._heads_right(batch)
        if not right.all():
            raise StaleIndex(self._path, base + int(starts[np.argmin(right)]))
        if self._crc and (wrong := _first_wrong_crc(batch)) is not None:
            raise StaleIndex(self._path, base + int(starts[wrong]))
        return batch

    def _heads_right(self, batch: Batch) -> Any:
        """Whether each packet begins with its synchronization number, id and size."""
        import numpy as np

        if batch.rows is not None:
            found = np.ndarray(batch.starts.shape, "<u8", batch.rows, 0, batch.rows.strides[:1])
            return found & 0xFFFF_FFFF_FFFF == int(batch.heads[0]) << 16 | self._sync
        found = read_at_offsets(batch.data, batch.starts, "<u8") & 0xFFFF_FFFF_FFFF
        right = found == (batch.heads.astype(np.uint64) << 16 | self._sync)
        if batch.big.any():
            heads = batch.heads[batch.big].astype(np.uint64)
            found = read_at_offsets(batch.data, batch.starts[batch.big], ">u8") >> 16
            right[batch.big] = found == self._sync << 32 | (heads & 0xFFFF) << 16 | heads >> 16
        return right


def _first_wrong_crc(batch: Batch) -> int | None:
    """The first packet with a wrong CRC, up to the size of its group."""
    # See `scanner._crcs_right`: the CRC over several packets in a row is zero if all are right.
    count = batch.starts.size
    if batch.big.any():
        cuts = zip(batch.starts.tolist(), batch.ends.tolist(), batch.big.tolist(), strict=True)
        return next((n for n, (a, b, big) in enumerate(cuts) if not has_valid_crc(bytes(batch.data[a:b]), big)), None)
    if batch.rows is not None:
        size, rows = batch.rows.shape[1], batch.rows.data.cast("B")
        together = max(1, min(GROUP, PERIOD // size))  # within a period, equal damage to two packets cannot cancel
        groups = (rows[begin : begin + together * size] for begin in range(0, count * size, together * size))
    else:
        data = memoryview(batch.data)
        packets = list(map(data.__getitem__, map(slice, batch.starts.tolist(), batch.ends.tolist())))
        together = GROUP
        groups = (b"".join(packets[begin : begin + together]) for begin in range(0, count, together))
    return next((number * together for number, group in enumerate(groups) if arc(group)), None)


def _side_by_side(batch: Batch) -> Any:
    size = int(batch.ends[0] - batch.starts[0])
    return read_at_offsets(batch.data, batch.starts, f"V{size}").view("u1").reshape(-1, size)


def _equal(heads: Any) -> bool:
    return bool((heads == heads[:1]).all())
