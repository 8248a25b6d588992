"""Follows the clock of each system in a log: its first and last time, and where it was set."""

from typing import NamedTuple

import numpy as np

from runtime.logs.packet_block_reader import Array

BACK, AHEAD = 1.0, 10.0  # s
WINDOW = 16  # packets on each side; a stray time returns to normal within them
GROUP = 256
NEAR, SPREAD = 60.0, 3.0  # s and interquartile ranges that times may be from the median of their group


class ClockStep(NamedTuple):
    """A place where a system's time jumps, and stays: offset in the unpacked log, times (s) before and after."""

    offset: int
    src: int
    before: float
    after: float


class SystemClock:
    """The times of one system's packets, in the order of the log.

    start, end: s since 1970 UTC, without stray times: single ones far from their neighbors. outliers: how many.
    """

    def __init__(self, src: int):
        self.src = src
        self.packets: int = 0
        self.start: float = np.nan
        self.end: float = np.nan
        self.outliers: int = 0
        self.steps: list[ClockStep] = []
        self._times: Array = np.empty(0)
        self._offsets: Array = np.empty(0, np.int64)

    def add_packet_times(self, times: Array, offsets: Array) -> None:
        """Add the times and offsets of more packets."""
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
        rows = np.full((-(-len(times) // GROUP), GROUP), np.nan)
        rows.reshape(-1)[: len(times)] = np.where(np.isfinite(times) & (times > 0.0), times, np.nan)
        near = _near_others(rows)
        self.outliers += len(times) - int(near.sum())
        if near.any():
            begins = np.where(near, rows, np.inf).min(axis=1)
            self.start = float(begins[near.any(axis=1)][0]) if np.isnan(self.start) else self.start
            self.end = float(np.fmax(self.end, rows[near].max()))

    def _look(self, times: Array, offsets: Array, place: int) -> None:
        before, after = float(times[place - 1]), float(times[place])
        around = np.diff(times[place - WINDOW : place + WINDOW])
        # A stray time makes two jumps, there and back; only a clock that was set stays.
        if not (around * np.sign(before - after) > abs(after - before) / 2).any():
            self.steps.append(ClockStep(int(offsets[place]), self.src, before, after))


def without_outliers(times: Array) -> Array:
    """The finite times, without those far from the others."""
    return times[_near_others(times[np.newaxis])[0]]


def _near_others(rows: Array) -> Array:
    """A mask of the times of each row that are near the median of that row; NaN never is."""
    ordered = np.sort(np.where(np.isfinite(rows), rows, np.nan), axis=1)  # NaN come last
    counts = np.isfinite(ordered).sum(axis=1)
    low, middle, high = (
        np.take_along_axis(ordered, (np.maximum(counts - 1, 0) * share).astype(np.int64)[:, np.newaxis], axis=1)
        for share in (0.25, 0.5, 0.75)
    )
    return np.abs(rows - middle) <= np.fmax(NEAR, SPREAD * (high - low))
