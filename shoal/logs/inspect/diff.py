"""Finds where two logs differ, and by how much."""

import math
from array import array
from collections import Counter
from collections.abc import Iterable, Iterator
from dataclasses import dataclass, field
from typing import Any, NamedTuple

import numpy as np

import imc
from imc.lsf import ReportProgress
from runtime.logs import NAMING, Array, SystemNames, packet_blocks, type_name

MOST_PAIRS = 100_000  # whose fields are compared
RELATED = 0.1  # share of messages that must match by time, else logs are compared by order


class LogMessage(NamedTuple):
    """A message of a log: its number from 1, offset in the unpacked log, the message (None after the end)."""

    number: int
    offset: int
    message: imc.Message | None


@dataclass
class TypeDifference:
    """Messages of one type: equal in both logs, changed, only in one."""

    same: int = 0
    changed: int = 0
    only_a: int = 0
    only_b: int = 0


@dataclass
class FieldDifference:
    """Difference of a field in pairs of messages: its count; for numbers the mean and greatest absolute difference."""

    count: int = 0
    total: float = 0.0
    greatest: float = 0.0
    at: float = math.nan
    numeric: bool = True

    @property
    def mean(self) -> float:
        return self.total / self.count if self.count else 0.0


@dataclass
class LogDifference:
    """Difference of two logs. `by_time`: messages were paired by time, else by order."""

    packets: tuple[int, int]
    names: SystemNames
    losses: tuple[list[imc.Loss], list[imc.Loss]]
    first: tuple[LogMessage, LogMessage] | None = None
    reordered: bool = False
    by_time: bool = True
    types: dict[str, TypeDifference] = field(default_factory=dict[str, TypeDifference])
    fields: dict[tuple[str, str], FieldDifference] = field(default_factory=dict[tuple[str, str], FieldDifference])
    pairs: int = 0
    compared: int = 0

    @property
    def equal(self) -> bool:
        return self.first is None


class _PacketArrays:
    """A log's packets as arrays: key of type and sender, time, offset, fingerprint."""

    def __init__(self, log: imc.Log, names: SystemNames, losses: list[imc.Loss], progress: ReportProgress | None):
        keys, times, offsets, prints = array("q"), array("d"), array("q"), array("q")
        for block in packet_blocks(log, losses, progress):
            heads = block.headers
            key = heads["id"].astype(np.int64) << 24 | heads["src"].astype(np.int64) << 8 | heads["src_ent"]
            keys.frombytes(key.tobytes())
            times.frombytes(heads["timestamp"].tobytes())
            offsets.extend(block.offsets)
            # Valid in this process only: Python salts the hash of bytes.
            prints.extend(map(hash, block.packets))
            for index in np.flatnonzero(np.isin(heads["id"], list(NAMING))):
                try:
                    names.learn(log.schema.decode(block.packets[index]))
                except imc.DecodeError:
                    continue
        self.log = log
        self.keys, self.offsets, self.prints = (np.asarray(column, np.int64) for column in (keys, offsets, prints))
        self.times = np.asarray(times, np.float64)

    def fetch(self, wanted: Array) -> Iterator[bytes]:
        """The packets with these numbers (from 0, ascending)."""
        left = iter(wanted.tolist())
        number = next(left, -1)
        for place, (_, packet) in enumerate(self.log.packets()):
            if place == number:
                yield packet
                number = next(left, -1)
                if number < 0:
                    return

    def place(self, number: int) -> LogMessage:
        if number >= len(self.keys):
            return LogMessage(number + 1, -1, None)
        packet = next(self.fetch(np.array([number])))
        return LogMessage(number + 1, int(self.offsets[number]), _decoded(self.log, packet))


def compare_logs(a: imc.Log, b: imc.Log, progress: ReportProgress | None = None) -> LogDifference:
    """Compare two logs. Needs about 30 bytes of memory per packet, and up to MOST_PAIRS changed packets."""
    names = SystemNames()
    losses: tuple[list[imc.Loss], list[imc.Loss]] = ([], [])
    one, two = _PacketArrays(a, names, losses[0], progress), _PacketArrays(b, names, losses[1], progress)
    found = LogDifference((len(one.keys), len(two.keys)), names, losses)
    common = min(found.packets)
    parting = np.flatnonzero(one.prints[:common] != two.prints[:common])
    if len(parting) == 0 and found.packets[0] == found.packets[1]:
        return found
    at = int(parting[0]) if len(parting) else common
    found.first = one.place(at), two.place(at)
    left_a, left_b = _unmatched(one.prints, two.prints), _unmatched(two.prints, one.prints)
    found.reordered = len(left_a) == len(left_b) == 0
    pairs_a, pairs_b = _pairs(one, two, left_a, left_b, found)
    _count(one, two, left_a, left_b, pairs_a, found)
    found.pairs = len(pairs_a)
    _compare_fields(one, two, pairs_a, pairs_b, found)
    return found


def _unmatched(mine: Array, theirs: Array) -> Array:
    """The numbers of packets that the other log does not have, or has fewer times."""
    order = np.argsort(mine, kind="stable")
    values, begins, counts = np.unique(mine[order], return_index=True, return_counts=True)
    others, other_counts = np.unique(theirs, return_counts=True)
    places = np.searchsorted(others, values)
    places[places == len(others)] = 0
    shared = np.where(others[places] == values, other_counts[places], 0) if len(others) else np.zeros_like(counts)
    rank = np.arange(len(mine)) - np.repeat(begins, counts)
    return np.sort(order[rank >= np.repeat(shared, counts)])


def _pairs(
    one: _PacketArrays, two: _PacketArrays, left_a: Array, left_b: Array, found: LogDifference
) -> tuple[Array, Array]:
    """The numbers of changed messages in both logs, paired by type, sender and time, else by type, sender and order."""
    pairs = _matched(one.keys[left_a], one.times[left_a], two.keys[left_b], two.times[left_b])
    shared = len(one.keys) - len(left_a)
    found.by_time = len(pairs[0]) + shared > RELATED * min(found.packets)
    if not found.by_time:
        pairs = _matched(one.keys[left_a], left_a * 0.0, two.keys[left_b], left_b * 0.0)
    order = np.argsort(pairs[0], kind="stable")
    return left_a[pairs[0][order]], left_b[pairs[1][order]]


def _matched(keys_a: Array, times_a: Array, keys_b: Array, times_b: Array) -> tuple[Array, Array]:
    """Places of rows with the same key and time in both; the first pairs with the first, the second with the second."""
    kind = np.dtype([("key", "i8"), ("time", "i8"), ("rank", "i8")])
    ranked: list[Array] = []
    for keys, times in ((keys_a, times_a), (keys_b, times_b)):
        rows = np.zeros(len(keys), kind)
        rows["key"], rows["time"] = keys, np.ascontiguousarray(times).view(np.int64)
        order = np.lexsort((rows["time"], rows["key"]))
        ordered = rows[order]
        new = np.ones(len(rows), bool)
        new[1:] = (ordered["key"][1:] != ordered["key"][:-1]) | (ordered["time"][1:] != ordered["time"][:-1])
        begins = np.maximum.accumulate(np.where(new, np.arange(len(rows)), 0))
        rows["rank"][order] = np.arange(len(rows)) - begins
        ranked.append(rows)
    _, places_a, places_b = np.intersect1d(*ranked, assume_unique=True, return_indices=True)
    return places_a, places_b


def _count(
    one: _PacketArrays, two: _PacketArrays, left_a: Array, left_b: Array, pairs: Array, found: LogDifference
) -> None:
    columns = (one.keys, one.keys[left_a], two.keys[left_b], one.keys[pairs])
    ids: list[list[int]] = [(keys >> 24).tolist() for keys in columns]
    totals, a, b, changed = map(Counter, ids)
    for number in sorted({*totals, *b}):
        name = type_name(one.log.schema if number in one.log.schema.types_by_id else two.log.schema, number)
        both = changed[number]
        found.types[name] = TypeDifference(totals[number] - a[number], both, a[number] - both, b[number] - both)


def _compare_fields(
    one: _PacketArrays, two: _PacketArrays, pairs_a: Array, pairs_b: Array, found: LogDifference
) -> None:
    pairs_a, pairs_b = pairs_a[:MOST_PAIRS], pairs_b[:MOST_PAIRS]
    order = np.argsort(pairs_b)
    theirs = dict(zip(pairs_b[order].tolist(), two.fetch(pairs_b[order]), strict=True))
    for number, packet in zip(pairs_b.tolist(), one.fetch(pairs_a), strict=True):
        mine, other = _decoded(one.log, packet), _decoded(two.log, theirs[number])
        found.compared += 1
        for name, before, after in differing_fields(mine, other):
            key = (type(mine).__name__, name)
            _add(found.fields.setdefault(key, FieldDifference()), before, after, mine.timestamp)


def differing_fields(mine: imc.Message, other: imc.Message) -> list[tuple[str, Any, Any]]:
    """The fields in which two messages of one type differ: name, value here, value there. NaN equals NaN."""
    names: Iterable[str] = type(mine).__struct_fields__
    values = ((name, getattr(mine, name), getattr(other, name, None)) for name in names)
    return [(name, before, after) for name, before, after in values if before != after and repr(before) != repr(after)]


def _add(field: FieldDifference, before: Any, after: Any, time: float) -> None:
    field.count += 1
    if not isinstance(before, int | float) or not isinstance(after, int | float):
        field.numeric = False
        return
    apart = abs(after - before)
    if math.isfinite(apart):
        field.total += apart
        if apart > field.greatest or field.count == 1:
            field.greatest, field.at = apart, time


def _decoded(log: imc.Log, packet: bytes) -> imc.Message:
    """The message of a packet; imc.Unknown if the schema cannot decode it."""
    try:
        return log.schema.decode(packet)
    except imc.DecodeError:
        head = imc.header(packet)
        return imc.Unknown(id=head.id, payload=packet[20:-2], timestamp=head.timestamp, src=head.src)
