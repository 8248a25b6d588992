"""Counts the messages on the bus of the vehicle in this process."""

from shoal.console.health.message_rates import Counts, KindCount
from tasks.transports.console import Console


class BusCounter:
    """A `MessageCounter` of the vehicle whose task serves the page. Its time is that of the vehicle."""

    def __init__(self, task: Console) -> None:
        self._task = task

    def start(self) -> None:
        self._task.set_counting(True)

    def stop(self) -> None:
        self._task.set_counting(False)

    def counts(self) -> Counts:
        name = self._task.system_name
        return {(name, *place): KindCount(*found) for place, found in self._task.message_counts().items()}

    def now(self) -> float:
        return self._task.now
