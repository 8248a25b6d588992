"""Measures and reports the lag of a vehicle's time behind the computer's."""

import math
import time
from typing import TYPE_CHECKING

from runtime.kernel import SECOND
from runtime.task import State
from support.log_limit import ReportLimit

if TYPE_CHECKING:
    from runtime.vehicle.vehicle import Vehicle

WINDOW = 10.0  # s of real time over which the pace is measured
SILENCE = 60.0  # s of real time between two warnings of a kind
ENOUGH = 0.95  # share of the requested speed below which a warning is logged
MERGED = 0.01  # share of the periodic calls
NAMED_STALL = 1.0  # s, least stall that is reported
STARTING = 1.0  # s after the start, in which tasks load what they need: a stall that begins then is the start's own
LONGEST_STALL = 10.0  # s, after which the position is unknown: the plan has to end
STALL_HOLD = 10.0  # s for which the entity is in ERROR then
STEP = 0.5  # s, least step of the system time that is reported; a busy computer may read two clocks this far apart
HUNG = 10.0  # s of real time in offloaded work, after which it is named


class RealtimeLag:
    """The pace of a vehicle whose clock follows real time; `poll` is called about once a second of its time.

    Only this reports a stall of the process, and `Task.age` leaves that time out. After one of
    more than `LONGEST_STALL` the vehicle's own entity is in ERROR for a while, so that a plan ends as after any error.
    `speed` is what the clock reached in the last window, in seconds of the vehicle per second of real time, `merged`
    the share of periodic calls that came so late in it that they were merged with others.
    """

    def __init__(self, vehicle: "Vehicle"):
        self._vehicle = vehicle
        self.wanted: float = vehicle.kernel.clock.speed
        self.speed: float = self.wanted
        self.merged: float = 0.0
        self._all_missed = self._all_due = 0
        self._at: tuple[float, int] | None = None
        self._ticks: dict[str, tuple[int, int]] = {}  # missed and due, by task
        self._warnings, self._hung = ReportLimit(SILENCE), ReportLimit()
        self._offset = self._system_time()
        self._polled, self._started, self._stalled_until = 0, 0, math.inf

    def poll(self) -> None:
        """Measure, and warn in the log book."""
        self._look_at_stalls()
        self._look_at_system_time()
        self._look_at_workers()
        real, now = time.monotonic(), self._vehicle.kernel.now_ns
        if self._at is None:
            self._at = real, now
            self._look_at_ticks(0.0)
        passed = real - self._at[0]
        if passed < WINDOW:
            return
        self.speed = (now - self._at[1]) / SECOND / passed
        self._at = real, now
        if self.speed < ENOUGH * self.wanted:
            self._warn(
                "speed",
                f"the computer is too slow: time passes {self.speed:.3g} times as fast as real time, "
                f"not {self.wanted:g} times",
            )
        self._look_at_ticks(passed)

    def __str__(self) -> str:
        """The speed that the clock reached in the last window, if that is less than it should."""
        return self._shortage(self.speed, self.merged)

    def describe_run(self, passed: float, real: float) -> str:
        """The same for the whole run, in which `passed` s of the vehicle took `real` s."""
        return self._shortage(passed / real if real else self.wanted, self._all_missed / max(1, self._all_due))

    def _shortage(self, speed: float, merged: float) -> str:
        if speed < ENOUGH * self.wanted:
            return f"{speed:.3g}x of {self.wanted:g}x"
        return f"{100.0 * merged:.0f} % of the periodic calls too late" if merged > MERGED else ""

    def _look_at_ticks(self, passed: float) -> None:
        worst, most, missed, due = "", 0, 0, 0
        before, self._ticks = self._ticks, {}
        for task in self._vehicle.tasks:
            ticks = sum(ticker.missed for ticker in task.tickers), sum(ticker.due for ticker in task.tickers)
            self._ticks[task.name] = ticks
            recent, passed_by = (now - then for now, then in zip(ticks, before.get(task.name, ticks), strict=True))
            if passed_by <= 0:
                continue  # it is new, or was started again
            missed += recent
            due += passed_by
            if recent > most:
                worst, most = task.name, recent
        self.merged = missed / due if due else 0.0
        self._all_missed += missed
        self._all_due += due
        if self.merged > MERGED:
            self._warn(
                "merged",
                f"the computer is too slow for real time: {100.0 * self.merged:.0f} % of the periodic calls of the "
                f"last {passed:.0f} s came too late and were merged with others, most of them in {worst}",
            )

    def _look_at_stalls(self) -> None:
        kernel, daemon = self._vehicle.kernel, self._vehicle.daemon
        polled, self._polled = self._polled, kernel.now_ns
        if not polled:
            self._started = kernel.now_ns + round(STARTING * SECOND)
        stall = kernel.stalls.longest_since(polled, self._started) / SECOND
        if not stall and (loading := kernel.stalls.longest_since(polled) / SECOND) > LONGEST_STALL:
            self._warn("start", f"the start took {loading:.1f} s: the computer was busy")
        text = f"the process stood still for {stall:.1f} s"
        if stall > LONGEST_STALL:
            self._stalled_until = kernel.now + STALL_HOLD
            daemon.log.error(f"{text}: the computer was busy or halted")
            daemon.set_entity_state(State.ERROR, text)
        elif kernel.now > self._stalled_until:
            self._stalled_until = math.inf
            daemon.set_entity_state(State.NORMAL, "active")
        if NAMED_STALL < stall <= LONGEST_STALL:
            self._warn("stall", f"{text}: the computer was busy or halted; no task is at fault for missed messages")

    def _look_at_system_time(self) -> None:
        offset = self._system_time()
        step, self._offset = (offset - self._offset) / SECOND, offset
        if abs(step) > STEP:
            self._vehicle.daemon.log.warning(
                f"the system time was set {'forward' if step > 0.0 else 'back'} by {abs(step):.3f} s, or the computer "
                f"slept; the vehicle keeps its own time until the run is started again: {abs(offset) / SECOND:.3f} s "
                f"{'behind' if offset > 0 else 'ahead of'} the system time"
            )

    def _system_time(self) -> int:
        """Time (ns) by which the system time is ahead; 0 for a clock that does not follow it."""
        return time.time_ns() - self._vehicle.kernel.clock.read() if self.wanted == 1.0 else 0

    def _look_at_workers(self) -> None:
        for title, seconds in self._vehicle.worker.current_work():
            if seconds > HUNG and self._hung.is_due(title):
                self._vehicle.daemon.log.warning(f"offloaded work has not returned for {seconds:.0f} s: {title}")

    def _warn(self, kind: str, text: str) -> None:
        if self._warnings.is_due(kind, time.monotonic()):
            self._vehicle.daemon.log.warning(text)
