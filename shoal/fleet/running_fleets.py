"""Registry of the fleets of this user that run on this computer."""

import contextlib
import os
import signal
import stat
import tempfile
import time
from collections.abc import Generator
from pathlib import Path
from typing import IO

from support.user_folders import cache_folder

PATIENCE = 30.0  # s for a fleet to end


def registry_folder() -> Path:
    """Folder of the running fleets; only this user can write there. Raises PermissionError if there is none.

    In the folder for temporary files anybody may have made one of that name before: it counts only without a home.
    """
    places = [Path(tempfile.gettempdir(), f"shoal-{os.getuid()}")]
    with contextlib.suppress(RuntimeError):  # no home
        places.insert(0, cache_folder() / "fleets")
    for place in places:
        with contextlib.suppress(OSError):
            place.mkdir(mode=0o700, parents=True, exist_ok=True)
            status = place.lstat()
            if stat.S_ISDIR(status.st_mode) and status.st_uid == os.getuid() and not status.st_mode & 0o022:
                return place
    raise PermissionError(f"{places[-1]} belongs to somebody else")


@contextlib.contextmanager
def register_fleet(name: str) -> Generator[None]:
    """Note that this process runs a fleet. Raises ValueError if another one does."""
    path = registry_folder() / f"{name}.fleet"
    with path.open("a+") as file:
        if not _lock(file):
            raise ValueError(f"the fleet {name} runs already, process {_pid(path)}; end it: shoal fleet stop {name}")
        file.truncate(0)
        file.write(str(os.getpid()))
        file.flush()
        try:
            yield
        finally:  # the file stays: without it two fleets could each lock a file of this name
            file.truncate(0)


def find_running_fleets() -> dict[str, int]:
    """The names of running fleets, and their processes."""
    found: dict[str, int] = {}
    for path in sorted(registry_folder().glob("*.fleet")):
        with contextlib.suppress(OSError), path.open("a+") as file:
            if not _lock(file) and (process := _pid(path)):
                found[path.stem] = process
    return found


def stop_fleet(name: str, process: int) -> bool:
    """End a running fleet, of a process; whether it has ended within PATIENCE."""
    with contextlib.suppress(ProcessLookupError):  # it has just ended
        os.kill(process, signal.SIGTERM)
    deadline = time.monotonic() + PATIENCE
    while find_running_fleets().get(name) == process:
        if time.monotonic() > deadline:
            return False
        time.sleep(0.05)
    return True


def _lock(file: IO[str]) -> bool:
    import fcntl  # not on all systems, and only here

    try:
        fcntl.flock(file, fcntl.LOCK_EX | fcntl.LOCK_NB)
    except OSError:
        return False
    return True


def _pid(path: Path) -> int:
    text = path.read_text().strip()
    return int(text) if text.isdecimal() else 0
