"""The folders of the disk that ground stations can read, and nothing outside of them."""

import os
import stat
from collections.abc import Generator, Iterable, Mapping, Sequence
from contextlib import contextmanager
from itertools import islice
from pathlib import Path

from mavlink.vehicle import FileEntry
from mavlink.vehicle.files import LARGEST_FILE, no_such_file

MOST_ENTRIES = 5000  # of one folder
FOLDER = os.O_RDONLY | os.O_DIRECTORY


class DiskFile:
    """An open file; its descriptor is closed by `close`."""

    def __init__(self, descriptor: int):
        self._descriptor = descriptor
        self.size: int = min(os.fstat(descriptor).st_size, LARGEST_FILE)

    def read(self, offset: int, count: int) -> bytes:
        """Bytes from an offset on, at most `count`; none at the end. Raises OSError."""
        count = min(count, self.size - offset)
        return os.pread(self._descriptor, count, offset) if count > 0 and self._descriptor >= 0 else b""

    def close(self) -> None:
        if self._descriptor >= 0:
            os.close(self._descriptor)
        self._descriptor = -1


class DiskFolders:
    """`folders` are folders of the disk, by name, as a FileStore."""

    def __init__(self, folders: Mapping[str, Path]):
        self._folders = {name.encode(): path for name, path in folders.items()}

    def roots(self) -> list[bytes]:
        return [name for name, place in self._folders.items() if place.is_dir()]

    def open(self, path: Sequence[bytes]) -> DiskFile:
        """Raises OSError."""
        with self._folder(path[:-1]) as folder:
            return DiskFile(_regular_file(folder, path[-1]))

    def list_entry_names(self, path: Sequence[bytes]) -> list[tuple[bytes, bool]]:
        """Names of what is in a folder, sorted, and whether each is a folder itself. Raises OSError."""
        with self._folder(path) as folder, os.scandir(folder) as items:
            found = [(os.fsencode(item.name), _is_folder(item)) for item in islice(items, MOST_ENTRIES)]
        return sorted((name, is_folder) for name, is_folder in found if is_folder is not None)

    def entries(self, path: Sequence[bytes], names: Iterable[bytes]) -> Generator[FileEntry | None]:
        """Entries of a folder by these names; None if it was removed. Raises OSError."""
        with self._folder(path) as folder:
            yield from (_entry(folder, name) for name in names)

    @contextmanager
    def _folder(self, parts: Sequence[bytes]) -> Generator[int]:
        """The descriptor of a folder, opened step by step, so that no link can be put into the path meanwhile."""
        place = self._folders.get(parts[0]) if parts else None
        if place is None:
            raise no_such_file()
        folder = os.open(place, FOLDER)
        try:
            for part in parts[1:]:
                below = os.open(part, FOLDER | os.O_NOFOLLOW, dir_fd=folder)
                os.close(folder)
                folder = below
            yield folder
        finally:
            os.close(folder)


def _is_folder(item: os.DirEntry[str]) -> bool | None:
    """Whether an item is a folder; None for what is neither a folder nor a file."""
    if item.is_dir(follow_symlinks=False):
        return True
    return False if item.is_file(follow_symlinks=False) else None


def _entry(folder: int, name: bytes) -> FileEntry | None:
    try:
        status = os.stat(name, dir_fd=folder, follow_symlinks=False)
    except OSError:
        return None
    changed = max(0, int(status.st_mtime))
    if stat.S_ISDIR(status.st_mode):
        return FileEntry(name, is_folder=True, changed=changed)
    return FileEntry(name, size=status.st_size, changed=changed) if stat.S_ISREG(status.st_mode) else None


def _regular_file(folder: int, name: bytes) -> int:
    """The descriptor of a file. What is something else is not even opened: that alone can set a device going."""
    if not stat.S_ISREG(os.stat(name, dir_fd=folder, follow_symlinks=False).st_mode):
        raise no_such_file()
    file = os.open(name, os.O_RDONLY | os.O_NOFOLLOW | os.O_NONBLOCK, dir_fd=folder)  # a pipe would keep us waiting
    if not stat.S_ISREG(os.fstat(file).st_mode):  # it was replaced meanwhile
        os.close(file)
        raise no_such_file()
    return file
