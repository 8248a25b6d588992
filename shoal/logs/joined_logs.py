"""The logs of a run as one log, and the newest log below a folder."""

import errno
import math
import shutil
import tempfile
from collections.abc import Generator, Sequence
from contextlib import contextmanager
from pathlib import Path

from imc import SchemaError
from imc.lsf import SUFFIXES, Log, find_log
from runtime.logs import read_log_run_position
from support.file_errors import add_path_to_errors

SAME = ("IMC.xml.gz", "IMC.xml")
JOINED = ("Output.txt",)
FIRST = ("Config.ini",)
SHORTEST = 1.0  # s


@contextmanager
def joined_logs(logs: Sequence[Path]) -> Generator[Path]:
    """A temporary folder with consecutive logs as one, named after the first; a single log is taken as it is.

    Raises OSError, and ValueError if the logs have different definitions or compression.
    """
    if len(logs) == 1:
        yield logs[0]
        return
    parts = [find_log(log) for log in logs]
    if len({part.name for part in parts}) > 1:
        raise ValueError(f"the logs of the run differ in compression: {', '.join(map(str, parts))}")
    first = logs[0].resolve()
    with tempfile.TemporaryDirectory(prefix="shoal-") as place:
        whole = Path(place, first.parent.parent.name, first.parent.name, f"{first.name}-run")
        whole.mkdir(parents=True)
        for name in SAME:
            if len({_content(log / name) for log in logs}) > 1:
                raise ValueError(f"the logs of the run have different definitions: {', '.join(map(str, logs))}")
        with add_path_to_errors(place):
            for name in (*SAME, *FIRST):
                if (logs[0] / name).is_file():
                    shutil.copyfile(logs[0] / name, whole / name)
            # Packets follow each other without a header, and packed members do, too: files in a row are one log.
            for name in (parts[0].name, *JOINED):
                with (whole / name).open("wb") as joined:
                    for log in logs:
                        if (log / name).is_file():
                            with (log / name).open("rb") as part:
                                shutil.copyfileobj(part, joined, 1 << 20)
        yield whole


def newest_log(folder: Path) -> Path:
    """The folder of the log below `folder` that was written last.

    A log that follows others of its run and is shorter than `SHORTEST` is passed over: a run that ends with its plan
    has begun the next log just before. Raises FileNotFoundError.
    """
    found = [path for path in folder.rglob("Data.lsf*") if path.name.endswith(SUFFIXES) and path.is_file()]
    if not found:
        raise FileNotFoundError(errno.ENOENT, "there is no log below it", str(folder))
    logs = [path.parent for path in sorted(found, key=lambda path: (path.stat().st_mtime_ns, path), reverse=True)]
    return next((log for log in logs if not _is_short_rest(log)), logs[0])


def _is_short_rest(log: Path) -> bool:
    """Whether a log follows others of its run and has a message, but none `SHORTEST` after another."""
    place = read_log_run_position(log)
    if place is None or place.number == 1:
        return False
    first, last = math.inf, -math.inf
    try:
        for batch in Log(log, keep_index=False).batches():
            times = batch.times()
            first, last = min(first, times.min(initial=first)), max(last, times.max(initial=last))
            if last - first >= SHORTEST:
                return False
    except (OSError, SchemaError):  # the command that reads it reports this
        return False
    return last >= first


def _content(path: Path) -> bytes:
    return path.read_bytes() if path.is_file() else b""
