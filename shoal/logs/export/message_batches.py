"""The packets to export, in batches, grouped by message; those of fixed size as arrays."""

from collections import Counter
from collections.abc import Iterable, Iterator
from dataclasses import dataclass, field
from functools import cached_property
from typing import NamedTuple

import numpy as np

import imc
from imc.layout import ADDRESS_FIELDS, HEADER_FIELDS, SMALLEST_PACKET, VARIABLE, numpy_columns
from imc.lsf import Batch, ReportProgress, read_at_offsets
from runtime.logs import Array, LogSummary, SystemNames
from shoal.logs.selection import OwnerClock, PacketSelection, selection_mask

BATCH_BYTES = 1 << 21

HEADER_AND_ORDER = np.dtype([*numpy_columns({"id": "H", "size": "H", **ADDRESS_FIELDS}), ("big", "?")])
"""A header, and whether the packet is big-endian."""


class ExportBatch(NamedTuple):
    """Consecutive packets of the export: number of the first; the bytes that contain them, and where each starts and
    ends there; their headers (an array of HEADER_AND_ORDER)."""

    first: int
    data: bytes
    starts: Array
    ends: Array
    headers: Array

    def packet(self, row: int) -> bytes:
        return self.data[self.starts[row] : self.ends[row]]

    def packet_bytes(self) -> bytes:
        """All packets, one after the other."""
        if np.array_equal(self.ends[:-1], self.starts[1:]):
            return self.data[self.starts[0] : self.ends[-1]]
        places = zip(self.starts.tolist(), self.ends.tolist(), strict=True)
        return b"".join([self.data[start:end] for start, end in places])


class MessageBatch(NamedTuple):
    """Packets of one message in a batch; `rows`: where they are in it.

    array: the packets, if all are little-endian and of the message's fixed size; the fields of header and message are
    named as in Python. None if the packets must be decoded one by one.
    """

    message: imc.MessageType
    rows: Array
    array: Array | None


@dataclass
class LogSource:
    """A log, and what to export of it.

    skipped: reason -> number of messages that could not be written; unreadable_photos: those that could not be read;
    notes: what the export lacks, and why.
    """

    log: imc.Log
    summary: LogSummary
    selection: PacketSelection = field(default_factory=PacketSelection)
    skipped: Counter[str] = field(default_factory=Counter[str])
    unreadable_photos: list[str] = field(default_factory=list[str])
    notes: list[str] = field(default_factory=list[str])
    packets: int = 0

    @property
    def schema(self) -> imc.Schema:
        return self.log.schema

    @property
    def names(self) -> SystemNames:
        return self.summary.names

    @cached_property
    def _layouts(self) -> dict[int, np.dtype[np.void]]:
        return {m.id: layout for m in self.schema.messages if (layout := _layout(m)) is not None}

    def batches(self, progress: ReportProgress = lambda _: None) -> Iterator[ExportBatch]:
        """The selected packets; `progress` gets the share of the log that has been read, 0 to 1."""
        watch = OwnerClock(self.summary.owner)
        self.packets = 0
        for batch in _merged(self.log.batches()):
            progress((batch.base + len(batch.data)) / max(1, self.summary.unpacked))
            heads = _headers(batch)
            keep = selection_mask(heads, self.selection, watch)
            if keep.any():
                yield ExportBatch(self.packets, batch.data, batch.starts[keep], batch.ends[keep], heads[keep])
                self.packets += int(keep.sum())

    def groups(self, batch: ExportBatch) -> Iterator[MessageBatch]:
        """The packets of a batch by message; those of unknown id count as skipped."""
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
                    yield MessageBatch(message, rows, read_at_offsets(batch.data, batch.starts[rows], layout))
                    continue
            yield MessageBatch(message, rows, None)

    def decode(self, batch: ExportBatch, rows: Array) -> Iterator[tuple[int, imc.Message]]:
        """(place in `rows`, message) of a batch; what cannot be decoded counts as skipped."""
        starts, ends = batch.starts[rows].tolist(), batch.ends[rows].tolist()
        for place, (start, end) in enumerate(zip(starts, ends, strict=True)):
            try:
                yield place, self.schema.decode(batch.data[start:end])
            except imc.DecodeError as error:
                self.skipped[str(error)] += 1


def _merged(batches: Iterable[Batch]) -> Iterator[Batch]:
    """The same packets in fewer batches of about BATCH_BYTES."""
    waiting: list[Batch] = []
    for batch in batches:
        waiting.append(batch)
        if sum(len(batch.data) for batch in waiting) >= BATCH_BYTES:
            yield _joined(waiting)
            waiting = []
    if waiting:
        yield _joined(waiting)


def _joined(batches: list[Batch]) -> Batch:
    shifts = np.cumsum([0, *(len(batch.data) for batch in batches)])
    pairs = list(zip(batches, shifts[:-1], strict=True))
    return Batch(
        batches[0].base,
        b"".join([batch.data for batch in batches]),
        np.concatenate([batch.starts + shift for batch, shift in pairs]),
        np.concatenate([batch.ends + shift for batch, shift in pairs]),
        np.concatenate([batch.heads for batch in batches]),
        np.concatenate([batch.big for batch in batches]),
    )


def _headers(batch: Batch) -> Array:
    """Headers as HEADER_AND_ORDER."""
    found = np.empty(len(batch.starts), HEADER_AND_ORDER)
    found["id"], found["size"], found["big"] = batch.heads & 0xFFFF, batch.heads >> 16, batch.big
    for name in ADDRESS_FIELDS:
        found[name] = batch.header_values(name)
    return found


def nanoseconds(times: Array) -> Array:
    """Times (s since 1970 UTC) in integer ns, exact to 0.5 ns; one that is not between 1970 and 2038 is replaced by the
    valid one before it."""
    good = (times >= 0.0) & (times < 1 << 31)
    if not good.all():
        last = np.maximum.accumulate(np.where(good, np.arange(len(times)), -1))
        first = times[good][0] if good.any() else 0.0
        times = np.where(last >= 0, times[last], first)
    whole = np.floor(times)
    return whole.astype(np.int64) * 1_000_000_000 + np.rint((times - whole) * 1e9).astype(np.int64)


def _layout(message: imc.MessageType) -> np.dtype[np.void] | None:
    """The dtype of a message's packet; None if the message has text, bytes or other messages."""
    if VARIABLE.intersection(message.wire_codes):
        return None
    header = {name if name in ADDRESS_FIELDS else f"_{name}": code for name, code in HEADER_FIELDS.items()}
    fields = {field_.attribute: code for field_, code in zip(message.fields, message.wire_codes, strict=True)}
    return np.dtype(numpy_columns({**header, **fields, "_crc": "H"}))
