"""Compares what re-run tasks publish with what the log has of them."""

import math
from collections import deque
from collections.abc import Callable
from dataclasses import dataclass, field
from typing import NamedTuple

import imc
from support.rotations import wrap

EntityMessage = tuple[int, int]
"""Entity and message id."""


@dataclass(slots=True)
class FieldStatistics:
    """Differences of one number: re-simulated minus logged, in the field's unit; angles (rad) within half a turn."""

    unit: str = ""
    count: int = 0
    changed: int = 0
    largest: float = 0.0
    _sum: float = 0.0
    _squares: float = 0.0

    @property
    def mean(self) -> float:
        return self._sum / self.count if self.count else 0.0

    @property
    def rms(self) -> float:
        return math.sqrt(self._squares / self.count) if self.count else 0.0

    def add(self, logged: object, said: object) -> None:
        """Add a pair of values; values that are not numbers only count as changed or not."""
        self.count += 1
        if logged == said:
            return
        if isinstance(logged, (int, float)) and isinstance(said, (int, float)):
            difference = float(said) - float(logged)
            if math.isnan(difference):
                self.changed += not (math.isnan(logged) and math.isnan(said))
                return
            if self.unit == "rad":
                difference = wrap(difference)
            self._sum += difference
            self._squares += difference * difference
            self.largest = max(self.largest, abs(difference))
        self.changed += 1


@dataclass(slots=True)
class MessageCount:
    """The messages of one type and entity: in the log, in the re-simulation, and how their pairs differ."""

    logged: int = 0
    published: int = 0
    equal: int = 0
    changed: int = 0
    fields: dict[str, FieldStatistics] = field(default_factory=dict[str, FieldStatistics])

    @property
    def only_logged(self) -> int:
        return self.logged - self.equal - self.changed

    @property
    def only_published(self) -> int:
        return self.published - self.equal - self.changed


class FirstDifference(NamedTuple):
    """The first difference, after `after` equal packets; None for a side that has ended."""

    after: int
    logged: bytes | None
    published: bytes | None


@dataclass(slots=True)
class _Pending:
    logged: deque[tuple[float, bytes]] = field(default_factory=deque[tuple[float, bytes]])
    published: deque[tuple[float, bytes]] = field(default_factory=deque[tuple[float, bytes]])


class RerunComparison:
    """Compares the packets of both sides as they come; memory does not grow with the log.

    Packets of the same type, entity and `id` are pairs if their times are within `tolerance` (s). `bytes` is how many
    bytes differ; packets without a partner count whole. `first` is where the two first differ in content or order.
    """

    def __init__(self, schema: imc.Schema, tolerance: float):
        self.counts: dict[EntityMessage, MessageCount] = {}
        self.bytes: int = 0
        self.packets: int = 0
        self.first: FirstDifference | None = None
        self._schema = schema
        self._tolerance = tolerance
        self._pending: dict[tuple[int, int, int], _Pending] = {}
        self._logged: deque[bytes] = deque()
        self._said: deque[bytes] = deque()

    @property
    def equal(self) -> bool:
        """Whether all packets are identical and in the same order."""
        return self.first is None

    def add_logged(self, header: imc.Header, packet: bytes) -> None:
        self._tally(header).logged += 1
        pending = self._queue(header, packet)
        pending.logged.append((header.timestamp, packet))
        if self.first is None:
            self._logged.append(packet)
            self._walk()
        self._pair(header, pending)

    def add_published(self, header: imc.Header, packet: bytes) -> None:
        self._tally(header).published += 1
        pending = self._queue(header, packet)
        pending.published.append((header.timestamp, packet))
        if self.first is None:
            self._said.append(packet)
            self._walk()
        self._pair(header, pending)

    def finish(self) -> None:
        """Compare the rest: both sides are complete."""
        for pending in self._pending.values():
            self.bytes += sum(len(packet) for _, packet in (*pending.logged, *pending.published))
        self._pending.clear()
        if self.first is None and (self._logged or self._said):
            logged, said = self._logged, self._said
            self.first = FirstDifference(self.packets, logged[0] if logged else None, said[0] if said else None)

    def _tally(self, header: imc.Header) -> MessageCount:
        return self.counts.setdefault((header.src_ent, header.id), MessageCount())

    def _queue(self, header: imc.Header, packet: bytes) -> _Pending:
        number = 0
        if "id" in self._field_units(header.id):
            value = getattr(self._decode(packet), "id", 0)
            number = value if isinstance(value, int) else 0
        return self._pending.setdefault((header.src_ent, header.id, number), _Pending())

    def _walk(self) -> None:
        while self._logged and self._said:
            logged, said = self._logged.popleft(), self._said.popleft()
            if logged != said:
                self.first = FirstDifference(self.packets, logged, said)
                self._logged.clear()
                self._said.clear()
                return
            self.packets += 1

    def _pair(self, header: imc.Header, pending: _Pending) -> None:
        while pending.logged and pending.published:
            (then, logged), (now, said) = pending.logged[0], pending.published[0]
            if now - then > self._tolerance or self._nearer(pending.logged, now):
                self.bytes += len(logged)
                pending.logged.popleft()
            elif then - now > self._tolerance or self._nearer(pending.published, then):
                self.bytes += len(said)
                pending.published.popleft()
            else:
                pending.logged.popleft()
                pending.published.popleft()
                self._compare(self._tally(header), header.id, logged, said)

    def _nearer(self, queue: deque[tuple[float, bytes]], time: float) -> bool:
        """Whether the second of a queue is nearer to a time than the first."""
        return len(queue) > 1 and self._tolerance > 0.0 and abs(queue[1][0] - time) < abs(queue[0][0] - time)

    def _compare(self, tally: MessageCount, number: int, logged: bytes, said: bytes) -> None:
        if logged == said:
            tally.equal += 1
            for statistics in tally.fields.values():
                statistics.count += 1
            return
        tally.changed += 1
        self.bytes += sum(a != b for a, b in zip(logged, said, strict=False)) + abs(len(logged) - len(said))
        before, after = _values(self._decode(logged)), _values(_decoded(imc.builtin(), said))
        for name, unit in self._field_units(number).items():
            statistics = tally.fields.get(name)
            if statistics is None:
                statistics = tally.fields[name] = FieldStatistics(unit, count=tally.equal)
            statistics.add(before.get(name), after.get(name))

    def _decode(self, packet: bytes) -> imc.Message | None:
        return _decoded(self._schema, packet)

    def _field_units(self, number: int) -> dict[str, str]:
        kind = self._schema.types_by_id.get(number)
        return {} if kind is None else {f.attribute: f.unit for f in kind.fields}


class LastMomentBuffer:
    """Passes packets on to a comparison; those of the moment `end` (ns since 1970 UTC) only in `compare_last`.

    A run that is stopped by hand ends in the middle of a moment. `now` returns the time (ns since 1970 UTC).
    """

    def __init__(self, comparison: RerunComparison, now: Callable[[], int]):
        self.end: int | None = None
        self._comparison = comparison
        self._now = now
        self._logged: list[tuple[imc.Header, bytes]] = []
        self._said: list[tuple[imc.Header, bytes]] = []

    def add_logged(self, header: imc.Header, packet: bytes) -> None:
        if self._is_last():
            self._logged.append((header, packet))
        else:
            self._comparison.add_logged(header, packet)

    def add_published(self, header: imc.Header, packet: bytes) -> None:
        if self._is_last():
            self._said.append((header, packet))
        else:
            self._comparison.add_published(header, packet)

    def _is_last(self) -> bool:
        return self.end is not None and self._now() >= self.end

    def compare_last(self, doubtful: bool) -> bool:
        """Compare the last moment, unless it is `doubtful` and differs. Returns whether it was compared."""
        if doubtful and self._logged != self._said:
            return False
        for header, packet in self._logged:
            self._comparison.add_logged(header, packet)
        for header, packet in self._said:
            self._comparison.add_published(header, packet)
        return True


def _decoded(schema: imc.Schema, packet: bytes) -> imc.Message | None:
    try:
        return schema.decode(packet)
    except imc.DecodeError:
        return None


def _values(message: imc.Message | None) -> dict[str, object]:
    return {} if message is None else {name: getattr(message, name) for name in message.__struct_fields__}
