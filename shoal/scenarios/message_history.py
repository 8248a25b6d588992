"""History of messages in a run: when they arrived, for how long something has held, values from before."""

import math
from collections import deque
from collections.abc import Callable
from dataclasses import dataclass, field

from runtime.kernel import SECOND

OnMessage = Callable[[float], object]
"""Called with the time since the start of the run (s)."""


class ArrivalHistory:
    """The arrivals of messages until now; `now_ns` returns the time since the start of the run (ns).

    `before` is called just before another one counts, when the age is largest.
    """

    def __init__(self, now_ns: Callable[[], int], window: int):
        self.count: int = 0
        self.before: list[OnMessage] = []
        self._now_ns = now_ns
        self._window = window
        self._last = 0
        self._recent: deque[int] = deque()

    def record_arrival(self) -> None:
        """A message arrives now."""
        self.count += 1
        self._last = self._now_ns()
        if self._window:
            self._recent.append(self._last)
            self._drop_old()

    def age(self) -> float:
        """The time since the last arrival (s), since the start of the run if there was none."""
        return (self._now_ns() - self._last) / SECOND

    def rate(self) -> float:
        """Arrivals per second within the window."""
        self._drop_old()
        now, arrived = self._now_ns(), len(self._recent)
        while arrived and self._recent[arrived - 1] == now:  # the window ends before now: no phase counts one more
            arrived -= 1
        return arrived * SECOND / self._window

    def is_window_open(self) -> bool:
        """Whether the run is shorter than the window, so that there is no rate yet."""
        return self._now_ns() < self._window

    def _drop_old(self) -> None:
        oldest = self._now_ns() - self._window
        while self._recent and self._recent[0] < oldest:
            self._recent.popleft()


@dataclass
class _Span:
    """A margin from `begin` until `end` (s)."""

    begin: float
    margin: float
    end: float = math.inf


class HeldMargin:
    """The smallest margin of a condition within the last `seconds`.

    It is not known before the condition has been judged for so long, unless it has failed meanwhile.
    """

    def __init__(self, seconds: float):
        self._seconds = seconds
        self._since = math.nan  # when the margin became known
        self._now = 0.0
        self._spans: deque[_Span] = deque()  # margins that only rise: a smaller one hides those before it

    def update(self, now: float, margin: float) -> None:
        """The margin from now on; NaN if it is not known."""
        self._now = now
        if margin != margin:
            self._since = math.nan
            self._spans.clear()
            return
        if self._since != self._since:
            self._since = now
        if self._spans:
            self._spans[-1].end = now
        while self._spans and self._spans[-1].margin >= margin:
            self._spans.pop()
        self._spans.append(_Span(now, margin))
        while self._spans[0].end <= now - self._seconds:
            self._spans.popleft()

    def margin(self, unknown: float) -> float:
        """The margin now, or `unknown`."""
        if not self._spans:
            return unknown
        least = self._spans[0].margin
        is_long_enough = self._now - self._since >= self._seconds - 1e-9  # s; sums of decimal fractions
        return least if is_long_enough or least <= 0.0 else unknown


@dataclass
class CapturedValue:
    """A value that a run has captured, NaN before; `listeners` are called when there is another one."""

    value: float = math.nan
    is_there: bool = False
    listeners: list[OnMessage] = field(default_factory=list[OnMessage])

    def capture(self, value: float, now: float) -> None:
        """Keep a value in place of the one before."""
        self.value, self.is_there = value, True
        for listener in self.listeners:
            listener(now)
