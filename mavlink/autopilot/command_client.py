"""Commands to an autopilot, each of which it has to acknowledge."""

import math
from collections import deque
from collections.abc import Callable
from dataclasses import dataclass

from mavlink import Fields

ACCEPTED, IN_PROGRESS = 0, 5
RESULTS = ("accepted", "temporarily rejected", "denied", "unsupported", "not carried out", "in progress", "canceled",
           "accepted only as COMMAND_LONG", "accepted only as COMMAND_INT", "rejected for its frame")  # fmt: skip
PATIENCE, LONG_PATIENCE, TRIES = 1.0, 10.0, 6  # s, s while it is in progress
LONGEST_QUEUE = 64
SILENT, DROPPED, WITHDRAWN = -1, -2, -3  # of commands that were never acknowledged, never sent, or canceled

OnResult = Callable[[int], object]


def result_text(result: int) -> str:
    """A MAV_RESULT for people."""
    if result == SILENT:
        return "not acknowledged"
    if result == DROPPED:
        return f"not sent: {LONGEST_QUEUE} other commands wait"
    if result == WITHDRAWN:
        return "withdrawn"
    return RESULTS[result] if result < len(RESULTS) else f"answered with {result}"


@dataclass(slots=True)
class QueuedCommand:
    """One command: the name of its message, its fields, what to do with the result, and when it is sent again."""

    message: str
    fields: Fields
    on_result: OnResult
    urgent: bool = False
    tries: int = 0
    due: float = 0.0


class CommandClient:
    """Sends one command at a time, again without an answer; urgent ones overtake the others.

    `transmit(message, fields)` sends. An acknowledgment counts if it names the command.
    """

    def __init__(self, transmit: Callable[[str, Fields], object]) -> None:
        self._transmit = transmit
        self._waiting: deque[QueuedCommand] = deque()
        self._current: QueuedCommand | None = None

    @property
    def busy(self) -> bool:
        return self._current is not None

    @property
    def next_deadline(self) -> float:
        """Time at which `tick` has something to do (s): infinite while nothing waits."""
        if self._current is None:
            return -math.inf if self._waiting else math.inf
        return self._current.due

    def send(self, message: str, fields: Fields, on_result: OnResult, now: float, *, urgent: bool = False) -> None:
        """Send a command as soon as those before it are settled; if too many wait, the last of them is DROPPED."""
        command = QueuedCommand(message, fields, on_result, urgent)
        dropped = self._waiting.pop() if len(self._waiting) >= LONGEST_QUEUE else None
        if urgent:
            if self._current is not None and not self._current.urgent:
                self._current.tries = 0
                self._waiting.appendleft(self._current)
                self._current = None
            self._waiting.appendleft(command)
        else:
            self._waiting.append(command)
        self.tick(now)
        if dropped is not None:
            dropped.on_result(DROPPED)

    def cancel(self, *, urgent: bool = True) -> None:
        """Drop all commands, since who should acknowledge them is not there any more; or only those not urgent.

        Each is WITHDRAWN, when none of them is left.
        """
        each = [*self._waiting] if self._current is None else [self._current, *self._waiting]
        dropped = [command for command in each if urgent or not command.urgent]
        self._waiting = deque(command for command in self._waiting if command.urgent and not urgent)
        if self._current is not None and (urgent or not self._current.urgent):
            self._current = None
        for command in dropped:
            command.on_result(WITHDRAWN)

    def receive(self, command: int, result: int, now: float) -> None:
        """Take an acknowledgment."""
        current = self._current
        if current is None or current.fields["command"] != command:
            return
        if result == IN_PROGRESS:
            current.due = now + LONG_PATIENCE
            return
        self._settle(current, result, now)

    def tick(self, now: float) -> None:
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

    def _settle(self, command: QueuedCommand, result: int, now: float) -> None:
        self._current = None
        command.on_result(result)
        self.tick(now)
