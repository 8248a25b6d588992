"""Files that ground stations can read: files in memory, and folders of the vehicle below the same root."""

import errno
import os
import re
from collections.abc import Callable, Generator, Iterable, Mapping

from mavlink.vehicle.interfaces import FileEntry, FileStore, OpenFile

LARGEST_FILE = 0xFFFFFFFF  # bytes that MAVLink's offsets reach
HIDDEN = b"@"
URI = re.compile(rb"(?:mftp://)?(?:\[;comp=\d*\])?", re.IGNORECASE)


class MemoryFile:
    """An open file with a content."""

    def __init__(self, content: bytes):
        self._content = content
        self.size: int = min(len(content), LARGEST_FILE)

    def read(self, offset: int, count: int) -> bytes:
        """Bytes from an offset on, at most `count`; none at the end."""
        return self._content[offset : offset + max(0, min(count, self.size - offset))]

    def close(self) -> None:
        self._content = b""


class VirtualFiles:
    """`files` are made when they are opened, by path; `store` has folders of the vehicle.

    Names in the root that begin with @ are not listed. A path is cut at its first NUL, may begin with mftp:// and
    [;comp=1], or one of them, as MAVSDK leaves it, and is the same with or without a leading slash.
    """

    def __init__(self, files: Mapping[str, Callable[[], bytes]], store: FileStore):
        self._files = {name.encode(): make for name, make in files.items()}
        self._store = store

    def open(self, path: bytes) -> OpenFile:
        """Raises OSError."""
        parts = _parts(path)
        make = self._files.get(b"/".join(parts))
        return self._store.open(parts) if make is None else MemoryFile(make())

    def list_entry_names(self, path: bytes) -> list[tuple[bytes, bool]]:
        """Names of what is in a folder, sorted, and whether each is a folder itself. Raises OSError."""
        parts = _parts(path)
        if parts:
            return self._store.list_entry_names(parts)
        found = [*((name, False) for name in self._files), *((name, True) for name in self._store.roots())]
        return sorted(item for item in found if not item[0].startswith(HIDDEN))

    def entries(self, path: bytes, names: Iterable[bytes]) -> Generator[FileEntry | None]:
        """Entries of a folder by these names; None if it was removed. Raises OSError."""
        parts = _parts(path)
        if parts:
            yield from self._store.entries(parts, names)
        else:
            yield from (self._entry(name) for name in names)

    def _entry(self, name: bytes) -> FileEntry:
        make = self._files.get(name)
        return FileEntry(name, is_folder=True) if make is None else FileEntry(name, size=len(make()))


def no_such_file() -> FileNotFoundError:
    """The error of a path that does not exist."""
    return FileNotFoundError(errno.ENOENT, os.strerror(errno.ENOENT))


def _parts(path: bytes) -> list[bytes]:
    """The names in a path. Raises FileNotFoundError if one of them leads up."""
    plain = path.partition(b"\0")[0]
    scheme = URI.match(plain)
    parts = [part for part in plain[scheme.end() if scheme else 0 :].split(b"/") if part not in (b"", b".")]
    if b".." in parts:
        raise no_such_file()
    return parts
