"""What of a log is exported: packets in batches, grouped by message, those of one size as arrays."""

from collections import Counter
from collections.abc import Callable, Iterator
from dataclasses import dataclass, field
from functools import cached_property
from itertools import islice
from typing import NamedTuple

import numpy as np

import imc
from imc.codec import SMALLEST_PACKET
from runtime.logs.cut import Choice, Watch, wanted
from runtime.logs.headers import Array, Block, headers
from runtime.logs.names import Names
from runtime.logs.summary import Summary

BATCH_PACKETS, BATCH_BYTES, PIECE = 1 << 14, 1 << 21, 1 << 9

_NUMBERS = {"b": "i1", "B": "u1", "h": "<i2", "H": "<u2", "i": "<i4", "I": "<u4", "q": "<i8", "f": "<f4", "d": "<f8"}
_HEADER = (
    ("_sync", "<u2"),
    ("_id", "<u2"),
    ("_size", "<u2"),
    ("timestamp", "<f8"),
    ("src", "<u2"),
    ("src_ent", "u1"),
    ("dst", "<u2"),
    ("dst_ent", "u1"),
)

Progress = Callable[[int], object]


class Batch(NamedTuple):
    """Consecutive packets of the export: the number of the first, their bytes, their headers (an array of HEADER)."""

    first: int
    packets: list[bytes]
    headers: Array


class Group(NamedTuple):
    """Packets of one message in a batch: where they are in it.

    array: the packets, where all of them are little-endian and of the one size that the message has; its fields are
    named as in Python, those of the header too. None where they have to be decoded one by one.
    """

    message: imc.MessageType
    rows: Array
    array: Array | None


@dataclass
class Source:
    """A log, and what of it is wanted. skipped: what could not be written, and how often."""

    log: imc.Log
    summary: Summary
    choice: Choice = field(default_factory=Choice)
    skipped: Counter[str] = field(default_factory=Counter[str])
    packets: int = 0

    @property
    def schema(self) -> imc.Schema:
        return self.log.schema

    @property
    def names(self) -> Names:
        return self.summary.names

    @cached_property
    def _layouts(self) -> dict[int, np.dtype[np.void]]:
        return {m.id: layout for m in self.schema.messages if (layout := _layout(m)) is not None}

    def batches(self, progress: Progress = lambda _: None) -> Iterator[Batch]:
        """The wanted packets; `progress` hears how many bytes of the unpacked log have been read."""
        watch = Watch(self.summary.owner)
        self.packets = 0
        for block in self._blocks():
            keep = wanted(block, self.choice, watch)
            progress(block.offsets[-1])
            if not keep.any():
                continue
            packets = block.packets if keep.all() else [block.packets[row] for row in np.flatnonzero(keep)]
            yield Batch(self.packets, packets, block.headers[keep])
            self.packets += len(packets)

    def _blocks(self) -> Iterator[Block]:
        found: list[tuple[int, bytes]] = []
        packets, size = self.log.packets(), 0
        while piece := list(islice(packets, PIECE)):
            found += piece
            size += sum([len(packet) for _, packet in piece])
            if len(found) >= BATCH_PACKETS or size >= BATCH_BYTES:
                yield self._block(found)
                found, size = [], 0
        if found:
            yield self._block(found)

    def _block(self, found: list[tuple[int, bytes]]) -> Block:
        packets = [packet for _, packet in found]
        return Block(packets, [offset for offset, _ in found], headers(packets, self.schema.sync))

    def groups(self, batch: Batch) -> Iterator[Group]:
        """The packets of a batch by message, without those of unknown id, which count as skipped."""
        ids = batch.headers["id"]
        order = np.argsort(ids, kind="stable")
        found, begins = np.unique(ids[order], return_index=True)
        parts: list[Array] = np.split(order, begins[1:])
        for number, rows in zip(found.tolist(), parts, strict=True):
            message = self.schema.types_by_id.get(number)
            if message is None:
                self.skipped[f"message id {number} is unknown"] += len(rows)
                continue
            layout = self._layouts.get(number)
            sizes: Array = batch.headers["size"][rows]
            if layout is not None and bool(np.all(sizes == layout.itemsize - SMALLEST_PACKET)):
                data = b"".join(list(map(batch.packets.__getitem__, rows.tolist())))
                array: Array = np.frombuffer(data, layout)
                if (array["_sync"] == self.schema.sync).all():
                    yield Group(message, rows, array)
                    continue
            yield Group(message, rows, None)

    def decoded(self, batch: Batch, rows: Array) -> Iterator[tuple[int, imc.Message]]:
        """Row and message of packets of a batch; what cannot be decoded counts as skipped."""
        numbers: list[int] = rows.tolist()
        for row in numbers:
            try:
                yield row, self.schema.decode(batch.packets[row])
            except imc.DecodeError as error:
                self.skipped[str(error)] += 1


def nanoseconds(times: Array) -> Array:
    """Times (s since 1970 UTC) in integer ns, exact to half of one; what is not between 1970 and 2038 takes the time
    before it."""
    good = (times >= 0.0) & (times < 1 << 31)
    if not good.all():
        last = np.maximum.accumulate(np.where(good, np.arange(len(times)), -1))
        first = times[good][0] if good.any() else 0.0
        times = np.where(last >= 0, times[last], first)
    whole = np.floor(times)
    return whole.astype(np.int64) * 1_000_000_000 + np.rint((times - whole) * 1e9).astype(np.int64)


def _layout(message: imc.MessageType) -> np.dtype[np.void] | None:
    """The whole packet of a message; None if it has text, bytes or messages inside."""
    if set(message.wire) & set("TRML"):
        return None
    fields = [(field_.attribute, _NUMBERS[code]) for field_, code in zip(message.fields, message.wire, strict=True)]
    return np.dtype([*_HEADER, *fields, ("_crc", "<u2")])
