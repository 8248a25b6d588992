"""The logs of one run of a vehicle, which starts a new log with each plan."""

import math
from collections.abc import Iterator, Sequence
from itertools import pairwise

import imc
from runtime.logs import logs_of_run, place_of

CONFIGURATION = "Config.ini"


class LoggedRun:
    """Consecutive logs as if they were one; no messages are missing between them."""

    def __init__(self, logs: Sequence[imc.Log]):
        self.logs = logs
        self.path = logs[-1].path
        self.schema = logs[-1].schema

    def packets(self) -> Iterator[tuple[int, bytes]]:
        """Offset in its log, and bytes, of each packet."""
        for log in self.logs:
            yield from log.packets()


def run_of(log: imc.Log) -> LoggedRun:
    """The logs of the run up to this one if all are in the vehicle's folder and end cleanly; else this one alone."""
    place = place_of(log.path.parent)
    if place is None:
        return LoggedRun([log])
    logs = [log]
    try:
        logs = [*(imc.Log(folder) for folder in logs_of_run(log.path.parent)[: place.number - 1]), log]
        numbers = [found.number for each in logs if (found := place_of(each.path.parent))]
        whole = numbers == list(range(1, place.number + 1))
        whole = whole and all(_end(before) == _begin(after) for before, after in pairwise(logs))
    except (OSError, ValueError):
        whole = False
    return LoggedRun(logs if whole else [log])


def _begin(log: imc.Log) -> float:
    return next((imc.header(packet).timestamp for _, packet in log.packets()), math.nan)


def _end(log: imc.Log) -> float:
    """When the log ended; NaN if it did not end cleanly."""
    last = b""
    for _, packet in log.packets():
        last = packet
    if not last or imc.header(last).id != imc.LoggingControl.ID:
        return math.nan
    stopped = getattr(log.schema.decode(last), "op", None) == imc.LoggingControl.Op.STOPPED
    return imc.header(last).timestamp if stopped else math.nan
