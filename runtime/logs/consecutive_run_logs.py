"""Logs of one run of a vehicle: each log contains its number in the run."""

import re
from collections import Counter
from pathlib import Path

import msgspec

RUN_FILE = "Run.json"
LARGEST = 4096  # bytes
_NAME = re.compile(r"\d{8}/[^/\\\x00]{1,250}")


class RunPosition(msgspec.Struct, frozen=True):
    """The place of a log in its run: the first log of the run, as <day>/<folder>, and its number, from 1."""

    first: str
    number: int


def encode_log_run_position(first: str, number: int) -> bytes:
    """The content of RUN_FILE."""
    return msgspec.json.encode(RunPosition(first, number)) + b"\n"


def resolve_log_folder(published: Path, current: Path | None) -> Path:
    """The folder of the log that a virtual run calls `published`: that of the `current` log may end in _2, _3 ...

    The run does not publish this end, since it must not depend on which folders exist.
    """
    if current is not None and current.parent == published.parent:
        name, _, number = current.name.rpartition("_")
        if name == published.name and number.isdecimal():
            return current
    return published


def read_log_run_position(folder: Path) -> RunPosition | None:
    """The place of a log in its run; None if the folder has none, or an invalid one."""
    try:
        if not (folder / RUN_FILE).is_file():  # a pipe would be waited for
            return None
        with (folder / RUN_FILE).open("rb") as file:
            found = msgspec.json.decode(file.read(LARGEST), type=RunPosition)
    except (OSError, msgspec.DecodeError):
        return None
    return found if _NAME.fullmatch(found.first) and found.number > 0 else None


def logs_of_run(folder: Path) -> list[Path]:
    """The folders of all logs of the run that a log belongs to, in order; a log without that is alone.

    They are looked for in the vehicle's folder, beside it; elsewhere it is alone. Raises ValueError if two logs claim
    the same number.
    """
    folder = folder.absolute()
    own = read_log_run_position(folder)
    if own is None:
        return [folder]
    begin = own.first.partition("/")[0]
    days = sorted(day for day in folder.parent.parent.glob("[0-9]*") if day.name >= begin and day.is_dir())
    found = [(place.number, log) for day in days for log in sorted(day.iterdir()) if (place := _same_run(log, own))]
    if own.number not in [number for number, _ in found]:
        found.append((own.number, folder))  # copied to where no vehicle's logs are
    repeated = next((number for number, count in Counter(number for number, _ in found).items() if count > 1), None)
    if repeated is not None:
        names = ", ".join(str(log) for number, log in found if number == repeated)
        raise ValueError(f"log {repeated} of the run exists several times: {names}")
    return [log for _, log in sorted(found)]


def missing_logs(logs: list[Path]) -> list[int]:
    """The numbers of the logs that are missing before or between these logs of a run."""
    numbers = [place.number for log in logs if (place := read_log_run_position(log))]
    return sorted(set(range(1, max(numbers, default=0))) - set(numbers))


def _same_run(log: Path, own: RunPosition) -> RunPosition | None:
    place = read_log_run_position(log)
    return place if place is not None and place.first == own.first else None
