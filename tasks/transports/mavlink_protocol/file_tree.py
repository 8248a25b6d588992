"""What ground stations can read: files in memory and folders of the disk, and nothing outside of them."""

import errno
import os
import re
import stat
from collections.abc import Callable, Generator, Iterable, Mapping, Sequence
from contextlib import contextmanager
from dataclasses import dataclass
from itertools import islice
from pathlib import Path

MOST_ENTRIES = 5000  # of one folder
LARGEST = 0xFFFFFFFF  # bytes of a file that MAVLink's offsets reach
FOLDER = os.O_RDONLY | os.O_DIRECTORY
HIDDEN = b"@"
URI = re.compile(rb"(?:mftp://)?(?:\[;comp=\d*\])?", re.IGNORECASE)


@dataclass(frozen=True, slots=True)
class Entry:
    """A file or folder; `changed` is in s since 1970, 0 if unknown."""

    name: bytes
    is_folder: bool = False
    size: int = 0
    changed: int = 0


class OpenFile:
    """A file as long as it was when it was opened: stations take more than the length they were told for an error.

    `source` is its content, or a descriptor, which is closed by `close`. A file that is removed meanwhile can still be
    read, one that is truncated ends earlier.
    """

    def __init__(self, source: bytes | int):
        self._source = source
        self.size = min(len(source) if isinstance(source, bytes) else os.fstat(source).st_size, LARGEST)

    def read(self, offset: int, count: int) -> bytes:
        """At most `count` bytes; none at the end. Raises OSError."""
        count = min(count, self.size - offset)
        if count <= 0:
            return b""
        if isinstance(self._source, bytes):
            return self._source[offset : offset + count]
        return os.pread(self._source, count, offset)

    def close(self) -> None:
        if isinstance(self._source, int):
            os.close(self._source)
        self._source = b""


class FileTree:
    """`files` are made when they are opened, by path; `folders` are folders of the disk, by name.

    Names in the root that begin with @ are not listed. Below the folders, only folders and regular files exist: no
    links, so that nothing leads out, and neither pipes nor devices. A path is cut at its first NUL, may begin with
    mftp:// and [;comp=1], or one of them, as MAVSDK leaves it, and is the same with or without a leading slash.
    """

    def __init__(self, files: Mapping[str, Callable[[], bytes]], folders: Mapping[str, Path]):
        self._files = {name.encode(): make for name, make in files.items()}
        self._folders = {name.encode(): path for name, path in folders.items()}

    def open(self, path: bytes) -> OpenFile:
        """Raises OSError."""
        parts = _parts(path)
        make = self._files.get(b"/".join(parts))
        if make is not None:
            return OpenFile(make())
        with self._folder(parts[:-1]) as folder:
            return OpenFile(_regular_file(folder, parts[-1]))

    def names(self, path: bytes) -> list[tuple[bytes, bool]]:
        """Names of what is in a folder, sorted, and whether each is a folder itself. Raises OSError."""
        parts = _parts(path)
        if not parts:
            folders = [name for name, place in self._folders.items() if place.is_dir()]
            found = [*((name, False) for name in self._files), *((name, True) for name in folders)]
            return sorted(item for item in found if not item[0].startswith(HIDDEN))
        with self._folder(parts) as folder, os.scandir(folder) as items:
            found = [(os.fsencode(item.name), _is_folder(item)) for item in islice(items, MOST_ENTRIES)]
        return sorted((name, is_folder) for name, is_folder in found if is_folder is not None)

    def entries(self, path: bytes, names: Iterable[bytes]) -> Generator[Entry | None]:
        """What is in a folder by these names; None if it was removed. Raises OSError."""
        parts = _parts(path)
        if not parts:
            yield from (self._entry(name) for name in names)
            return
        with self._folder(parts) as folder:
            yield from (_entry(folder, name) for name in names)

    def _entry(self, name: bytes) -> Entry:
        make = self._files.get(name)
        return Entry(name, is_folder=True) if make is None else Entry(name, size=len(make()))

    @contextmanager
    def _folder(self, parts: Sequence[bytes]) -> Generator[int]:
        """The descriptor of a folder, reached step by step, so that nobody can put a link into the way meanwhile."""
        place = self._folders.get(parts[0]) if parts else None
        if place is None:
            raise _missing()
        folder = os.open(place, FOLDER)
        try:
            for part in parts[1:]:
                below = os.open(part, FOLDER | os.O_NOFOLLOW, dir_fd=folder)
                os.close(folder)
                folder = below
            yield folder
        finally:
            os.close(folder)


def _parts(path: bytes) -> list[bytes]:
    """The names in a path. Raises FileNotFoundError if one of them leads up."""
    plain = path.partition(b"\0")[0]
    scheme = URI.match(plain)
    parts = [part for part in plain[scheme.end() if scheme else 0 :].split(b"/") if part not in (b"", b".")]
    if b".." in parts:
        raise _missing()
    return parts


def _is_folder(item: os.DirEntry[str]) -> bool | None:
    """None for what is neither a folder nor a file."""
    if item.is_dir(follow_symlinks=False):
        return True
    return False if item.is_file(follow_symlinks=False) else None


def _entry(folder: int, name: bytes) -> Entry | None:
    try:
        status = os.stat(name, dir_fd=folder, follow_symlinks=False)
    except OSError:
        return None
    changed = max(0, int(status.st_mtime))
    if stat.S_ISDIR(status.st_mode):
        return Entry(name, is_folder=True, changed=changed)
    return Entry(name, size=status.st_size, changed=changed) if stat.S_ISREG(status.st_mode) else None


def _regular_file(folder: int, name: bytes) -> int:
    """The descriptor of a file. What is something else is not even opened: that alone can set a device going."""
    if not stat.S_ISREG(os.stat(name, dir_fd=folder, follow_symlinks=False).st_mode):
        raise _missing()
    file = os.open(name, os.O_RDONLY | os.O_NOFOLLOW | os.O_NONBLOCK, dir_fd=folder)  # a pipe would keep us waiting
    if not stat.S_ISREG(os.fstat(file).st_mode):  # it was replaced meanwhile
        os.close(file)
        raise _missing()
    return file


def _missing() -> FileNotFoundError:
    return FileNotFoundError(errno.ENOENT, os.strerror(errno.ENOENT))
