"""The folder of a log that is being written, in DUNE's layout."""

import errno
import os
import shutil
from collections.abc import Iterable, Mapping
from contextlib import suppress
from datetime import UTC, datetime
from pathlib import Path

import imc
from imc.lsf import COMPRESSIONS, LsfWriter
from runtime.logs import RUN_FILE, encode_log_run_position
from support.atomic_files import sync_path
from support.file_errors import add_path_to_errors

TEXT = "Output.txt"


class LogRemovedError(FileNotFoundError):
    """Raised when the folder of a log that is being written was removed."""


class LogFolder:
    """One log: Data.lsf and Output.txt, beside the files for its readers and the number of the log in the run.

    It can be written to at once; `make` makes the folder, and until that succeeds everything waits in memory. The
    folder is `root`/`name`, with _2, _3 ... appended if it exists already. `number` counts the logs of the run.
    """

    def __init__(self, root: Path, name: str, number: int, compression: str, files: Mapping[str, bytes]):
        self.path = root / name
        self.made = False
        self.data: LsfWriter = LsfWriter(None, compression)
        self.text: LsfWriter = LsfWriter(None, "none")
        self._unsynced: list[Path] = []
        self._number = number
        self._files = dict(files)
        self._suffix = COMPRESSIONS[compression].suffix if compression != "none" else ""

    @property
    def name(self) -> str:
        """<day>/<folder>."""
        return f"{self.path.parent.name}/{self.path.name}"

    @property
    def unwritten_bytes(self) -> int:
        """Bytes that the disk has not accepted yet."""
        return self.data.waiting + self.text.waiting + sum(map(len, self._files.values()))  # integers

    @property
    def removed(self) -> bool:
        """Whether somebody removed the folder."""
        return self.made and not self.data.is_file_in_place()

    def make(self, first: str) -> None:
        """Make the folder; `first` is the name of the run's first log, empty in the first one itself.

        Raises OSError, and then leaves nothing behind.
        """
        path, parents = _new_folder(self.path)
        place = encode_log_run_position(first or f"{path.parent.name}/{path.name}", self._number)
        try:
            with add_path_to_errors(path):
                for name, content in self._files.items():
                    (path / name).write_bytes(content)
                (path / RUN_FILE).write_bytes(place)
            self.text.open(path / TEXT)
            self.data.open(path / f"Data.lsf{self._suffix}")
        except OSError:
            self.close_without_flush()
            shutil.rmtree(path, ignore_errors=True)
            raise
        self.path: Path = path
        self.made: bool = True
        self._unsynced = [*(path / name for name in (*self._files, RUN_FILE, TEXT)), path, *parents]
        self._files.clear()

    def flush(self) -> None:
        """Hand everything to the operating system. Raises OSError; LogRemovedError if the folder was removed."""
        if self.removed:
            raise LogRemovedError(errno.ENOENT, "the log was removed", str(self.path))
        self.data.flush()
        self.text.flush()

    def take_unsynced(self) -> list[Path]:
        """The files beside Data.lsf and the folders with new names that are not yet synced; empty from then on."""
        taken, self._unsynced = self._unsynced, []
        return taken

    def close_without_flush(self) -> None:
        """Close both files without a flush."""
        self.data.close_without_flush()
        self.text.close_without_flush()


def _new_folder(path: Path) -> tuple[Path, list[Path]]:
    """Make the folder of a log; returns it and the folders with new names, from the inside out."""
    parents = [path.parent]
    while not parents[-1].is_dir():
        parents.append(parents[-1].parent)
    path.parent.mkdir(parents=True, exist_ok=True)
    number, name = 1, path.name
    while True:
        try:
            path.mkdir()
            return path, parents
        except FileExistsError:
            number += 1
            path = path.with_name(f"{name}_{number}")


def sync_and_close(file: int, beside: Iterable[Path]) -> OSError | None:
    """Put a file on the disk, close this descriptor of it, and sync the paths `beside` it that still exist.

    Returns the first error.
    """
    try:
        os.fsync(file)
        for path in beside:
            with suppress(FileNotFoundError):
                sync_path(path)
        return None
    except OSError as error:
        return error
    finally:
        os.close(file)


def log_line(entry: imc.LogBookEntry) -> bytes:
    """A line of Output.txt."""
    kind = next((kind.name for kind in imc.LogBookEntry.Type if kind == entry.type), str(entry.type))
    line = f"{utc_text(entry.timestamp)} {kind:8} [{entry.context}] {' '.join(entry.text.split())}\n"
    return line.encode(errors="surrogateescape")


def utc_text(time: float) -> str:
    """A time (s since 1970 UTC) as text."""
    try:
        return datetime.fromtimestamp(time, UTC).isoformat(timespec="milliseconds").replace("+00:00", "Z")
    except (ValueError, OverflowError, OSError):
        return f"{time:g}"
