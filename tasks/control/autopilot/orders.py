"""Commands to an autopilot, each of which it has to acknowledge."""

from collections import deque
from collections.abc import Callable
from dataclasses import dataclass

from mavlink import Fields

ACCEPTED, IN_PROGRESS = 0, 5
RESULTS = ("accepted", "temporarily rejected", "denied", "unsupported", "not carried out", "in progress", "cancelled",
           "accepted only as COMMAND_LONG", "accepted only as COMMAND_INT", "refused for its frame")  # fmt: skip
PATIENCE, LONG_PATIENCE, TRIES = 1.0, 10.0, 6  # s, s while it is in progress
MOST = 64
SILENT, DROPPED = -1, -2  # the results of commands that were never acknowledged, or never sent

Then = Callable[[int], object]


def in_words(result: int) -> str:
    """A MAV_RESULT for people."""
    if result == SILENT:
        return "not acknowledged"
    if result == DROPPED:
        return f"not sent: {MOST} other commands wait"
    return RESULTS[result] if result < len(RESULTS) else f"answered with {result}"


@dataclass(slots=True)
class Order:
    """One command: the name of its message, its fields, what to do with the result, and when it is sent again."""

    message: str
    fields: Fields
    then: Then
    urgent: bool = False
    tries: int = 0
    due: float = 0.0


class Orders:
    """Sends one command at a time, again without an answer; urgent ones overtake the others.

    `transmit(message, fields)` sends. An acknowledgment counts if it names the command.
    """

    def __init__(self, transmit: Callable[[str, Fields], object]) -> None:
        self._transmit = transmit
        self._waiting: deque[Order] = deque()
        self._current: Order | None = None

    @property
    def busy(self) -> bool:
        return self._current is not None

    def give(self, message: str, fields: Fields, then: Then, now: float, *, urgent: bool = False) -> None:
        """Send a command as soon as those before it are settled; if too many wait, the last of them is DROPPED."""
        order = Order(message, fields, then, urgent)
        dropped = self._waiting.pop() if len(self._waiting) >= MOST else None
        if urgent:
            if self._current is not None and not self._current.urgent:
                self._current.tries = 0
                self._waiting.appendleft(self._current)
                self._current = None
            self._waiting.appendleft(order)
        else:
            self._waiting.append(order)
        self.look_after(now)
        if dropped is not None:
            dropped.then(DROPPED)

    def forget(self, *, urgent: bool = True) -> None:
        """Drop all commands, since who should acknowledge them is not there any more; or only those not urgent."""
        kept = [] if urgent else [order for order in self._waiting if order.urgent]
        self._waiting = deque(kept)
        if self._current is not None and (urgent or not self._current.urgent):
            self._current = None

    def hear(self, command: int, result: int, now: float) -> None:
        """Take an acknowledgment."""
        current = self._current
        if current is None or current.fields["command"] != command:
            return
        if result == IN_PROGRESS:
            current.due = now + LONG_PATIENCE
            return
        self._settle(current, result, now)

    def look_after(self, now: float) -> None:
        """Send what is due."""
        current = self._current
        if current is None:
            if not self._waiting:
                return
            current = self._current = self._waiting.popleft()
        elif now < current.due:
            return
        if current.tries >= TRIES:
            self._settle(current, SILENT, now)
            return
        if current.message == "COMMAND_LONG":
            self._transmit(current.message, {**current.fields, "confirmation": current.tries})
        else:
            self._transmit(current.message, current.fields)
        current.tries += 1
        current.due = now + PATIENCE

    def _settle(self, order: Order, result: int, now: float) -> None:
        self._current = None
        order.then(result)
        self.look_after(now)
