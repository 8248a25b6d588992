"""The logs of one run of a vehicle, which starts a new log with each plan."""

import math
from collections.abc import Iterator, Sequence
from contextlib import suppress
from pathlib import Path

import imc
from runtime.problem import ProfileError
from runtime.profile import Profile, load_profile

CONFIGURATION = "Config.ini"
IDENTITY = ("Vehicle", "Seed", "Selected", "Start Time", "Plan")


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
    """The logs of a virtual run up to this one if all are in the same folder; else this one alone.

    Each ends cleanly at the moment at which the next begins, and has the same vehicle, seed, modes, start and plan.
    """
    profile = _profile(log.path.parent)
    if profile is None:
        return LoggedRun([log])
    logs = [log]
    while _begin(logs[0]) != profile.start_time:
        before = _before(logs[0], profile)
        if before is None:
            return LoggedRun([log])
        logs.insert(0, before)
    return LoggedRun(logs)


def _before(log: imc.Log, profile: Profile) -> imc.Log | None:
    """The log in the same folder that ended when this one began, preferably one with the identical configuration."""
    here, begin = log.path.parent, _begin(log)
    earlier = [(_text(folder) == _text(here), folder) for folder in here.parent.iterdir() if folder < here]
    for _, folder in sorted(earlier, reverse=True):
        if _identity(_profile(folder)) == _identity(profile):
            with suppress(OSError, imc.SchemaError, imc.DecodeError):
                found = imc.Log(folder)
                if _end(found) == begin:
                    return found
    return None


def _text(folder: Path) -> bytes:
    try:
        return (folder / CONFIGURATION).read_bytes()
    except OSError:
        return b""


def _profile(folder: Path) -> Profile | None:
    try:
        return load_profile(folder / CONFIGURATION, strict=False) if (folder / CONFIGURATION).is_file() else None
    except ProfileError:
        return None


def _identity(profile: Profile | None) -> list[str]:
    return [] if profile is None else [profile.config.value("General", option) for option in IDENTITY]


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
