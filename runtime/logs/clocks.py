"""Follows the clocks of a log's systems: when they began and ended, and where they were set."""

from typing import NamedTuple

import numpy as np

from runtime.logs.headers import Array

BACK, AHEAD = 1.0, 10.0  # s
WINDOW = 16  # packets on each side in which a time that was astray comes back
GROUP = 256
NEAR, SPREAD = 60.0, 3.0  # s and quartile ranges that times may be from the middle of their group


class ClockStep(NamedTuple):
    """Where a system's time leaps, and stays: offset in the unpacked log, times (s) before and after."""

    offset: int
    src: int
    before: float
    after: float


class Clock:
    """The times of one system's packets, in the order of the log.

    start, end: s since 1970 UTC; single times far from those around them do not count. strays: how many those are.
    """

    def __init__(self, src: int):
        self.src = src
        self.packets = 0
        self.start = self.end = np.nan
        self.strays = 0
        self.steps: list[ClockStep] = []
        self._times: Array = np.empty(0)
        self._offsets: Array = np.empty(0, np.int64)

    def feed(self, times: Array, offsets: Array) -> None:
        """Take the times and offsets of further packets."""
        self.packets += len(times)
        self._bound(times)
        finite = np.isfinite(times)
        times, offsets = times[finite], offsets[finite]
        times, offsets = np.concatenate((self._times, times)), np.concatenate((self._offsets, offsets))
        leaps = np.diff(times)
        places = np.flatnonzero((leaps < -BACK) | (leaps > AHEAD)) + 1
        for place in places[(places >= WINDOW) & (places <= len(times) - WINDOW)]:
            self._look(times, offsets, int(place))
        keep = 2 * WINDOW - 1
        self._times, self._offsets = times[-keep:], offsets[-keep:]

    def _bound(self, times: Array) -> None:
        for begin in range(0, len(times), GROUP):
            group = times[begin : begin + GROUP]
            finite = group[np.isfinite(group) & (group > 0.0)]
            near = without_strays(finite)
            self.strays += len(group) - len(near)
            if len(near):
                self.start = float(near.min()) if np.isnan(self.start) else self.start
                self.end = float(np.fmax(self.end, near.max()))

    def _look(self, times: Array, offsets: Array, place: int) -> None:
        before, after = float(times[place - 1]), float(times[place])
        around = np.diff(times[place - WINDOW : place + WINDOW])
        # Where a time is astray there are two leaps, there and back.
        if not (around * np.sign(before - after) > abs(after - before) / 2).any():
            self.steps.append(ClockStep(int(offsets[place]), self.src, before, after))


def without_strays(times: Array) -> Array:
    """Finite times, without those far from the others."""
    if len(times) == 0:
        return times
    low, middle, high = np.quantile(times, (0.25, 0.5, 0.75))
    return times[np.abs(times - middle) <= max(NEAR, SPREAD * (high - low))]
