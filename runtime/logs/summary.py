"""Sums up a log in one pass: who sends what, when and how often, and what is damaged."""

import contextlib
import math
from collections.abc import Callable, Iterable
from dataclasses import dataclass, field
from pathlib import Path
from typing import TypeVar

import numpy as np

import imc
from imc.layout import SMALLEST_PACKET
from imc.lsf import ReportProgress
from imc.reserved_ids import UNKNOWN_SYSTEM
from runtime.logs.logged_clock_jumps import ClockStep, SystemClock
from runtime.logs.packet_block_reader import Array, PacketBlock, packet_blocks
from runtime.logs.system_names import KEPT, NAMING, SystemNames, type_name

K = TypeVar("K")

SHORTEST = 1.0  # s; over a shorter time, no rate is given


@dataclass(slots=True)
class PacketCount:
    """Packets of one kind: how many, their bytes, the first and the last time (s since 1970 UTC)."""

    count: int = 0
    size: int = 0
    first: float = math.inf
    last: float = -math.inf

    def add_packets(self, count: int, size: int, first: float, last: float) -> None:
        self.count += count
        self.size += size
        self.first = min(self.first, first)
        self.last = max(self.last, last)

    @property
    def rate(self) -> float:
        """Hz; NaN for too few packets or too short a time."""
        span = self.last - self.first
        return (self.count - 1) / span if self.count > 2 and SHORTEST < span < math.inf else math.nan


@dataclass
class LogSummary:
    """A log summed up. tallies: (message id, system, entity) -> PacketCount; clocks: system -> Clock."""

    path: Path
    schema: imc.Schema
    schema_source: Path | None
    file_size: int
    unpacked: int = 0
    tallies: dict[tuple[int, int, int], PacketCount] = field(default_factory=dict[tuple[int, int, int], PacketCount])
    clocks: dict[int, SystemClock] = field(default_factory=dict[int, SystemClock])
    names: SystemNames = field(default_factory=SystemNames)
    losses: list[imc.Loss] = field(default_factory=list[imc.Loss])
    writer: int | None = None

    @property
    def packets(self) -> int:
        return sum(tally.count for tally in self.tallies.values())

    @property
    def owner(self) -> int:
        """The system that wrote the log: whose logger has started it; without that, the one with the most packets."""
        if self.writer in self.clocks:
            return self.writer
        return max(self.clocks, key=lambda src: self.clocks[src].packets, default=UNKNOWN_SYSTEM)

    @property
    def start(self) -> float:
        """The owner's first time, s since 1970 UTC; NaN for an empty log."""
        return self.clocks[self.owner].start if self.clocks else math.nan

    @property
    def end(self) -> float:
        return self.clocks[self.owner].end if self.clocks else math.nan

    @property
    def duration(self) -> float:
        return self.end - self.start

    @property
    def clock_steps(self) -> list[ClockStep]:
        """Places where clocks were set: all jumps back, the owner's jumps ahead; others may only have been silent."""
        found = (step for clock in self.clocks.values() for step in clock.steps)
        return sorted(step for step in found if step.after < step.before or step.src == self.owner)

    @property
    def by_type(self) -> dict[str, PacketCount]:
        """Tallies by name of the message, most frequent first."""
        return self._grouped(lambda key: type_name(self.schema, key[0]))

    @property
    def by_entity(self) -> dict[tuple[int, int], PacketCount]:
        """Tallies by (system, entity), most frequent first."""
        return self._grouped(lambda key: (key[1], key[2]))

    def add_packet_block(self, block: PacketBlock) -> None:
        """Add more packets of the log."""
        heads = block.headers
        offsets = np.asarray(block.offsets)
        plain = ~np.isin(heads["id"], list(KEPT))  # a cut log begins with older ones of these
        for src in np.unique(heads["src"]):
            own = heads["src"] == src
            own &= plain | ~(own & plain).any()
            clock = self.clocks.setdefault(int(src), SystemClock(int(src)))
            clock.add_packet_times(heads["timestamp"][own], offsets[own])
        self._count(heads)
        if self.writer is None:
            controls = np.flatnonzero(heads["id"] == imc.LoggingControl.ID)
            self.writer = next((heads["src"][i].item() for i in controls if _starts(block.packets[i])), None)
        for index in np.flatnonzero(np.isin(heads["id"], list(NAMING))):
            self._learn(block.packets[index])

    def _count(self, heads: Array) -> None:
        keys = heads["id"].astype(np.int64) << 24 | heads["src"].astype(np.int64) << 8 | heads["src_ent"]
        order = np.argsort(keys, kind="stable")
        found, begins = np.unique(keys[order], return_index=True)
        times, sizes = heads["timestamp"][order], heads["size"][order].astype(np.int64) + SMALLEST_PACKET
        counts = np.diff(np.append(begins, len(keys)))
        total, first, last = np.add.reduceat(sizes, begins), *_extent(times, begins)
        for row, key in enumerate(found.tolist()):
            tally = self.tallies.setdefault((key >> 24, key >> 8 & 0xFFFF, key & 0xFF), PacketCount())
            tally.add_packets(int(counts[row]), int(total[row]), float(first[row]), float(last[row]))

    def _learn(self, packet: bytes) -> None:
        try:
            self.names.learn(self.schema.decode(packet))
        except imc.DecodeError:
            return

    def _grouped(self, group: Callable[[tuple[int, int, int]], K]) -> dict[K, PacketCount]:
        found: dict[K, PacketCount] = {}
        for key, tally in self.tallies.items():
            found.setdefault(group(key), PacketCount()).add_packets(tally.count, tally.size, tally.first, tally.last)
        return dict(sorted(found.items(), key=lambda item: -item[1].count))


def summarize(
    log: imc.Log, progress: ReportProgress | None = None, also: Iterable[Callable[[PacketBlock], object]] = ()
) -> LogSummary:
    """Read a log once and sum it up. `progress` gets the share read, 0 to 1; each of `also` gets all packets."""
    summary = LogSummary(log.path, log.schema, log.schema_source, log.path.stat().st_size)
    for block in packet_blocks(log, summary.losses, progress):
        summary.add_packet_block(block)
        for observer in also:
            observer(block)
        summary.unpacked = block.offsets[-1] + len(block.packets[-1])
    summary.unpacked = max([summary.unpacked, *(loss.offset + loss.length for loss in summary.losses)])
    return summary


def _extent(times: Array, begins: Array) -> tuple[Array, Array]:
    """First and last time of each group, without those of a stopped clock (before 1970, not finite)."""
    good = np.isfinite(times) & (times > 0.0)
    return (
        np.minimum.reduceat(np.where(good, times, np.inf), begins),
        np.maximum.reduceat(np.where(good, times, -np.inf), begins),
    )


def _starts(packet: bytes) -> bool:
    """Whether a LoggingControl reports that a log has been started."""
    with contextlib.suppress(imc.DecodeError):
        control = imc.decode(packet)
        return isinstance(control, imc.LoggingControl) and control.op == imc.LoggingControl.Op.STARTED
    return False
