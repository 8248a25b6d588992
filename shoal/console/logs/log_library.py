"""The logs that the page lists, and their files. A request names a log by a key, so that it reaches no other file."""

import hashlib
import math
import os
import stat
from collections.abc import Iterable
from dataclasses import dataclass
from pathlib import Path
from typing import BinaryIO, NamedTuple

from imc.lsf import find_log, log_file_names
from runtime.logs import SystemNames
from shoal.logs.inspect import LogOverview, log_overview
from support.file_errors import describe_os_error
from support.file_names import file_name_of
from support.terminal_text import printable

MOST_LOGS = 300
MOST_FILES = 40  # of a log
MOST_FOLDERS = 20_000
KEY = 16  # characters


class LogLibraryError(Exception):
    """A log or a file that cannot be given; the text is for the user."""


class LogDownload(NamedTuple):
    """A file of a log that is open, its size in bytes when it was opened, and a name for a copy of it."""

    file: BinaryIO
    size: int
    copy_name: str


@dataclass(frozen=True)
class _Log:
    path: Path
    overview: LogOverview
    files: dict[str, int]


class LogLibrary:
    """The newest logs below `folder`, or the logs `paths` (files, or folders with one log each).

    Calls read the disk: they are for a thread. A log that is listed is found by its key until the next list.
    """

    def __init__(self, folder: Path, paths: Iterable[Path] = ()) -> None:
        self._folder, self._paths = folder, tuple(paths)
        self._logs: dict[str, _Log] = {}
        self._seen: dict[Path, tuple[tuple[int, int], LogOverview]] = {}

    @property
    def is_fixed(self) -> bool:
        """Whether its logs are named, and are no folder's."""
        return bool(self._paths)

    def rows(self) -> list[dict[str, object]]:
        """The logs, the newest first: key, name, system, start (s since 1970 UTC), seconds, bytes, problem, files.

        Times are null if they are unknown. Raises LogLibraryError if the folder cannot be read.
        """
        names, found, rows = SystemNames(), dict[str, _Log](), list[dict[str, object]]()
        for path in self._find():
            log = self._read(path, names)
            if log is None:
                continue
            key = hashlib.sha256(os.fsencode(path)).hexdigest()[:KEY]
            found[key] = log
            rows.append(self._row(key, log))
        self._logs = found
        self._seen = {log.path: self._seen[log.path] for log in found.values()}
        return rows

    def path(self, key: str) -> Path:
        """The file of a log. Raises LogLibraryError if it is not listed."""
        return self._log(key).path

    def name(self, key: str) -> str:
        """The name of a log for people. Raises LogLibraryError if it is not listed."""
        return self._name(self.path(key))

    def open(self, key: str, name: str) -> LogDownload:
        """A file of a log. Raises LogLibraryError."""
        log = self._log(key)
        path = log.path
        if name not in log.files:
            raise LogLibraryError(f"this log has no file {printable(name)!r}")
        try:
            place = os.open(path.parent / name, os.O_RDONLY | getattr(os, "O_NOFOLLOW", 0) | os.O_NONBLOCK)
        except OSError as error:
            raise LogLibraryError(printable(f"{name}: {error.strerror}")) from None
        state = os.fstat(place)
        if not stat.S_ISREG(state.st_mode):
            os.close(place)
            raise LogLibraryError(f"{printable(name)} is not a file")
        return LogDownload(os.fdopen(place, "rb"), state.st_size, file_name_of(f"{self._name(path)}_{name}"))

    def _log(self, key: str) -> _Log:
        log = self._logs.get(key)  # another thread may list the logs anew
        if log is None:
            raise LogLibraryError("this log is not in the list any more: refresh it")
        return log

    def _find(self) -> list[Path]:
        """The files of the logs, the newest first, by their names, which are dates and times."""
        if self._paths:
            return list(map(_log_at, self._paths))
        if not self._folder.is_dir():
            return []
        found: list[Path] = []
        errors: list[OSError] = []
        for number, (place, folders, files) in enumerate(os.walk(self._folder, onerror=errors.append)):
            if number >= MOST_FOLDERS:
                break
            folders.sort(reverse=True)
            found += [Path(place, name) for name in log_file_names(files)]
        if errors and not found:
            raise LogLibraryError(printable(describe_os_error(errors[0])))
        return sorted(found, key=lambda path: path.parent.parts[-2:], reverse=True)[:MOST_LOGS]

    def _read(self, path: Path, names: SystemNames) -> _Log | None:
        """A log as it is now; None if it has vanished, or is a link to elsewhere."""
        try:
            state = path.lstat()
            if not stat.S_ISREG(state.st_mode):
                return None
            files = _files_beside(path)
        except OSError:
            return None
        version = state.st_size, state.st_mtime_ns
        known = self._seen.get(path)
        overview = known[1] if known is not None and known[0] == version else log_overview(path, names)
        self._seen[path] = version, overview
        return _Log(path, overview, files)

    def _row(self, key: str, log: _Log) -> dict[str, object]:
        start, end = log.overview.start, log.overview.end
        return {
            "key": key,
            "name": printable(self._name(log.path)),
            "system": printable(log.overview.system),
            "start": start if math.isfinite(start) else None,
            "seconds": round(end - start, 1) if math.isfinite(end - start) else None,
            "bytes": sum(log.files.values()),  # integers
            "problem": printable(log.overview.problem),
            "files": [{"name": name, "bytes": size} for name, size in log.files.items()],
        }

    def _name(self, path: Path) -> str:
        place = path.parent if path.name.startswith("Data.lsf") else path
        if self._paths or not place.is_relative_to(self._folder):
            return place.name
        return str(place.relative_to(self._folder))


def _log_at(path: Path) -> Path:
    """The file of a log, or the path itself if it has vanished."""
    try:
        return find_log(path)
    except OSError:
        return path


def _files_beside(path: Path) -> dict[str, int]:
    """Sizes of the regular files of a log by name; only its own file if the folder is not that of one log."""
    if not path.name.startswith("Data.lsf"):
        return {path.name: path.stat().st_size}
    with os.scandir(path.parent) as entries:
        found = sorted((e.name, e.stat().st_size) for e in entries if e.is_file(follow_symlinks=False))
    return dict(found[:MOST_FILES])
