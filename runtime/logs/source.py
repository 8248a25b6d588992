"""What of a log is exported: packets in batches, grouped by message, those of one size as arrays."""

from collections import Counter
from collections.abc import Callable, Iterable, Iterator
from dataclasses import dataclass, field
from functools import cached_property
from typing import NamedTuple

import numpy as np

import imc
from imc import packet_scan
from imc.codec import SMALLEST_PACKET
from imc.packet_scan import at_each
from runtime.logs.cut import Choice, Watch, wanted
from runtime.logs.headers import Array
from runtime.logs.names import Names
from runtime.logs.summary import Summary

BATCH_BYTES = 1 << 21

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

HEADER_AND_ORDER = np.dtype([("id", "<u2"), ("size", "<u2"), *_HEADER[3:], ("big", "?")])
"""A header, and whether the packet is big-endian."""

Progress = Callable[[int], object]


class Batch(NamedTuple):
    """Consecutive packets of the export: the number of the first; the bytes they lie in, and where they begin and end
    there; their headers (an array of HEADER_AND_ORDER)."""

    first: int
    data: bytes
    starts: Array
    ends: Array
    headers: Array

    def packet(self, row: int) -> bytes:
        return self.data[self.starts[row] : self.ends[row]]

    def joined(self) -> bytes:
        """All packets, one behind the other."""
        if np.array_equal(self.ends[:-1], self.starts[1:]):
            return self.data[self.starts[0] : self.ends[-1]]
        places = zip(self.starts.tolist(), self.ends.tolist(), strict=True)
        return b"".join([self.data[start:end] for start, end in places])


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
        for batch in _merged(self.log.batches()):
            progress(batch.base + len(batch.data))
            heads = _headers(batch)
            keep = wanted(heads, self.choice, watch)
            if keep.any():
                yield Batch(self.packets, batch.data, batch.starts[keep], batch.ends[keep], heads[keep])
                self.packets += int(keep.sum())

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
            if layout is not None:
                heads = batch.headers[rows]
                plain = (heads["size"] == layout.itemsize - SMALLEST_PACKET) & ~heads["big"]
                if bool(np.all(plain)):
                    yield Group(message, rows, at_each(batch.data, batch.starts[rows], layout))
                    continue
            yield Group(message, rows, None)

    def decoded(self, batch: Batch, rows: Array) -> Iterator[tuple[int, imc.Message]]:
        """Messages of a batch, and which of the rows they are in; what cannot be decoded counts as skipped."""
        starts, ends = batch.starts[rows].tolist(), batch.ends[rows].tolist()
        for place, (start, end) in enumerate(zip(starts, ends, strict=True)):
            try:
                yield place, self.schema.decode(batch.data[start:end])
            except imc.DecodeError as error:
                self.skipped[str(error)] += 1


def _merged(batches: Iterable[packet_scan.Batch]) -> Iterator[packet_scan.Batch]:
    """The same packets in fewer batches, of BATCH_BYTES about."""
    waiting: list[packet_scan.Batch] = []
    for batch in batches:
        waiting.append(batch)
        if sum(len(batch.data) for batch in waiting) >= BATCH_BYTES:
            yield _joined(waiting)
            waiting = []
    if waiting:
        yield _joined(waiting)


def _joined(batches: list[packet_scan.Batch]) -> packet_scan.Batch:
    shifts = np.cumsum([0, *(len(batch.data) for batch in batches)])
    pairs = list(zip(batches, shifts[:-1], strict=True))
    return packet_scan.Batch(
        batches[0].base,
        b"".join([batch.data for batch in batches]),
        np.concatenate([batch.starts + shift for batch, shift in pairs]),
        np.concatenate([batch.ends + shift for batch, shift in pairs]),
        np.concatenate([batch.heads for batch in batches]),
        np.concatenate([batch.big for batch in batches]),
    )


def _headers(batch: packet_scan.Batch) -> Array:
    """Headers as HEADER_AND_ORDER."""
    found = np.empty(len(batch.starts), HEADER_AND_ORDER)
    found["id"], found["size"], found["big"] = batch.heads & 0xFFFF, batch.heads >> 16, batch.big
    for name, place, kind in (
        ("timestamp", 6, "f8"),
        ("src", 14, "u2"),
        ("src_ent", 16, "u1"),
        ("dst", 17, "u2"),
        ("dst_ent", 19, "u1"),
    ):
        found[name] = batch.header_values(place, kind)
    return found


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
