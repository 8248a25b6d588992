"""Finds gaps in messages that come regularly."""

from dataclasses import dataclass, field
from typing import NamedTuple

import numpy as np

from runtime.logs import Array, PacketBlock

SHORTEST = 1.5  # s
FACTOR = 5.0  # periods
ENOUGH = 20  # intervals
REGULAR = 0.8  # share of the intervals that must be near the period
BINS, PER_OCTAVE, LOWEST = 160, 8, -10  # of the histogram of intervals: from 2^-10 s


class Gap(NamedTuple):
    """A time without the message: begin (s since 1970 UTC) and length (s)."""

    begin: float
    length: float


@dataclass
class MessageInterval:
    """Interval at which one entity sends one message."""

    last: float = np.nan
    histogram: Array = field(default_factory=lambda: np.zeros(BINS, np.int64))
    pauses: list[Gap] = field(default_factory=list[Gap])

    def update(self, times: Array) -> None:
        times = np.concatenate(([self.last], times[np.isfinite(times)]))
        steps = np.diff(times)
        forward = np.flatnonzero(steps > 0.0)
        bins = np.floor(np.log2(steps[forward]) * PER_OCTAVE).astype(np.int64) - LOWEST * PER_OCTAVE
        self.histogram += np.bincount(np.clip(bins, 0, BINS - 1), minlength=BINS)
        for index in forward[steps[forward] > SHORTEST]:
            self.pauses.append(Gap(float(times[index]), float(steps[index])))
        self.last = float(times[-1])

    @property
    def period(self) -> float:
        """The usual interval, s; NaN if it is not regular."""
        total = int(self.histogram.sum())
        if total < ENOUGH:
            return np.nan
        middle = int(np.searchsorted(np.cumsum(self.histogram), total / 2))
        near = self.histogram[max(0, middle - PER_OCTAVE // 2) : middle + PER_OCTAVE // 2 + 1].sum()
        return 2.0 ** ((middle + 0.5) / PER_OCTAVE + LOWEST) if near >= REGULAR * total else np.nan

    def gaps(self, end: float, least: float) -> list[Gap]:
        """The gaps until the log's end, longest first; none if the message came for less than `least` s."""
        if not self.period * self.histogram.sum() >= least:
            return []
        pauses = [*self.pauses, Gap(self.last, end - self.last)]
        found = [pause for pause in pauses if pause.length > max(SHORTEST, FACTOR * self.period)]
        return sorted(found, key=lambda gap: -gap.length)


class MessageIntervals:
    """The interval of each message of each entity, by message id, system and entity."""

    def __init__(self) -> None:
        self.found: dict[tuple[int, int, int], MessageInterval] = {}

    def __call__(self, block: PacketBlock) -> None:
        heads = block.headers
        keys = heads["id"].astype(np.int64) << 24 | heads["src"].astype(np.int64) << 8 | heads["src_ent"]
        order = np.argsort(keys, kind="stable")
        kinds, begins = np.unique(keys[order], return_index=True)
        for key, times in zip(kinds.tolist(), np.split(heads["timestamp"][order], begins[1:]), strict=True):
            self.found.setdefault((key >> 24, key >> 8 & 0xFFFF, key & 0xFF), MessageInterval()).update(times)
