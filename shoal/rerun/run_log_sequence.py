"""The logs of one run of a vehicle, which starts a new log with each plan."""

import math
from collections.abc import Iterator, Sequence
from itertools import pairwise
from pathlib import Path

import imc
from runtime.logs import logs_of_run, missing_logs, read_log_run_position
from support.file_errors import describe_os_error
from support.terminal_text import printable

CONFIGURATION = "Config.ini"


class LoggedRun:
    """Consecutive logs as if they were one; no messages are missing between them.

    gap: why they do not begin with the run, and what to do; empty if they do, or if the log does not contain it.
    """

    def __init__(self, logs: Sequence[imc.Log], gap: str = ""):
        self.logs = logs
        self.gap = gap
        self.path: Path = logs[-1].path
        self.schema: imc.Schema = logs[-1].schema

    def packets(self) -> Iterator[tuple[int, bytes]]:
        """Offset in its log, and bytes, of each packet."""
        for log in self.logs:
            yield from log.packets()


def find_run_of_log(log: imc.Log) -> LoggedRun:
    """The logs of the run up to this one if all are in the vehicle's folder and end cleanly; else this one alone."""
    place = read_log_run_position(log.path.parent)
    if place is None:
        return LoggedRun([log])
    try:
        folders = logs_of_run(log.path.parent)
        if missing := [str(number) for number in missing_logs(folders) if number < place.number]:
            which = f"log {missing[0]}" if len(missing) == 1 else f"logs {', '.join(missing)}"
            begin = f"of its run, which began with {printable(place.first)},"
            advice = "put all logs of the run beside each other, as <vehicle>/<day>/<log>"
            return LoggedRun([log], f"{which} {begin} {'is' if len(missing) == 1 else 'are'} missing: {advice}")
        logs = [*(imc.Log(folder) for folder in folders[: place.number - 1]), log]
        for before, after in pairwise(logs):
            if _end(before) != _begin(after):
                return LoggedRun([log], f"{before.path} of the same run does not end where the next log begins")
    except (OSError, ValueError) as error:
        return LoggedRun([log], describe_os_error(error) if isinstance(error, OSError) else str(error))
    return LoggedRun(logs)


def _begin(log: imc.Log) -> float:
    return next((imc.header(packet).timestamp for _, packet in log.packets()), math.nan)


def _end(log: imc.Log) -> float:
    """Time at which the log ended; NaN if it did not end cleanly."""
    last = b""
    for _, packet in log.packets():
        last = packet
    if not last or imc.header(last).id != imc.LoggingControl.ID:
        return math.nan
    stopped = getattr(log.schema.decode(last), "op", None) == imc.LoggingControl.Op.STOPPED
    return imc.header(last).timestamp if stopped else math.nan
