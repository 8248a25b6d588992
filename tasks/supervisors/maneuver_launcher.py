"""Starts and stops maneuvers one by one: the next request waits until the last is answered."""

from collections import deque
from collections.abc import Callable

import imc
from runtime import Task
from runtime.kernel import Timer

Phase = imc.ManeuverControlState.State


class ManeuverLauncher:
    """Publishes StopManeuver and maneuvers for a task, each after the answer to the last.

    Pass every ManeuverControlState to `on_maneuver_state`. A maneuver without an answer within `timeout` (s) is
    dropped and passed to `unanswered`.
    """

    def __init__(self, task: Task, timeout: float, unanswered: Callable[[imc.Message], object]):
        self._task = task
        self._timeout = timeout
        self._unanswered = unanswered
        self._queue: deque[imc.Message] = deque()
        self._pending: imc.Message | None = None
        self._running = False
        self._timer: Timer | None = None

    def start(self, maneuver: imc.Message) -> None:
        """Stop the running maneuver, then start this one; drops a maneuver that still waits."""
        self.stop()
        self._queue.append(maneuver)
        self._next()

    def stop(self) -> None:
        self._queue.clear()
        self._queue.append(imc.StopManeuver())
        self._next()

    def is_stray(self, report: imc.ManeuverControlState) -> bool:
        """Whether the report is from a maneuver that was not started here."""
        return report.state == Phase.EXECUTING and self._pending is None and not self._running

    def adopt(self) -> None:
        """Treat a stray maneuver as started here, so that it is stopped before the next."""
        self._running = True

    def mark_ended(self) -> None:
        """The maneuver started here no longer runs and need not be stopped."""
        self._running = False

    def track_maneuver_state(self, report: imc.ManeuverControlState) -> bool:
        """Handle a report; returns whether it is from the maneuver started last, not from one being stopped."""
        if report.state == Phase.EXECUTING:
            if self._pending is None or isinstance(self._pending, imc.StopManeuver):
                return self._pending is None and self._running
            self._running = True
        elif isinstance(self._pending, imc.StopManeuver):
            self._running = False
            self._answered()
            return False
        elif self._pending is not None:
            return False
        else:
            was_running, self._running = self._running, False
            return was_running and report.state != Phase.STOPPED
        self._answered()
        return True

    def _answered(self) -> None:
        self._pending = None
        if self._timer is not None:
            self._timer.cancel()
            self._timer = None
        self._next()

    def _next(self) -> None:
        while self._queue and self._pending is None:
            message = self._queue.popleft()
            if isinstance(message, imc.StopManeuver) and not self._running:
                continue
            self._pending = message
            self._timer = self._task.after(self._timeout, self._late)
            self._task.publish(message)

    def _late(self) -> None:
        message, self._pending, self._timer = self._pending, None, None
        if message is None:
            return
        self._task.log.error(f"no maneuver answers {type(message).__name__} within {self._timeout:g} s")
        self._running = False
        if not isinstance(message, imc.StopManeuver):
            self._unanswered(message)
        self._next()
