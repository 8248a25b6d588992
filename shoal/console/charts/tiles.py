"""Map tiles from MBTiles and PMTiles files in a folder."""

import mmap
import sqlite3
from collections.abc import Callable
from pathlib import Path
from typing import Any

from shoal.console.charts.overlay_files import OverlayFiles
from support.file_errors import describe_os_error
from support.regular_files import check_regular_file, open_regular_file

ReadTile = Callable[[int, int, int], bytes | None]  # zoom, column, row from the north
MOST_TILE = 4 << 20  # bytes
MOST_REASONS = 100
DEEPEST = 24  # zoom level
KINDS = {
    b"\x89PNG\r\n\x1a\n": "image/png",
    b"\xff\xd8\xff": "image/jpeg",
    b"RIFF": "image/webp",
}
"""Media types by the first bytes: pictures only, since the page draws no vector tiles."""


class TileSets:
    """The tile files of a folder, by their names without suffix, and its overlays, which are read later.

    zooms: the least and the largest zoom level of each.
    """

    def __init__(self, folder: Path | None) -> None:
        self.overlays: OverlayFiles = OverlayFiles(folder)
        self._unusable: list[str] = []
        self._unread: dict[tuple[str, str], int] = {}  # file and reason: number of requests
        self.zooms: dict[str, tuple[int, int]] = {}
        self._sets: dict[str, ReadTile] = {}
        try:
            paths = sorted(folder.iterdir()) if folder is not None else []
        except OSError as error:
            self._unusable.append(f"no map tiles: {describe_os_error(error)}")
            return
        for path in paths:
            if path.suffix not in (".mbtiles", ".pmtiles"):
                continue
            try:
                opened = _open_mbtiles(path) if path.suffix == ".mbtiles" else _open_pmtiles(path)
                self._sets[path.stem], self.zooms[path.stem] = opened
            except OSError as error:
                self._unusable.append(describe_os_error(error, path))
            except sqlite3.Error as error:
                self._unusable.append(f"{path}: {error}")
            except Exception:  # PMTiles' reader raises whatever a wrong byte leads to
                self._unusable.append(f"{path}: is no {path.suffix} file with tiles, or is damaged")

    @property
    def troubles(self) -> list[str]:
        """A sentence for each file that cannot be read, and for each reason for which tiles of a file cannot."""
        unread = [f"{name}: {count} times no tile could be read: {why}" for (name, why), count in self._unread.items()]
        return self._unusable + unread

    def tile(self, name: str, zoom: int, column: int, row: int) -> tuple[bytes, str] | None:
        """A tile and its media type, rows from the north; None if there is none, or it is no picture."""
        read = self._sets.get(name)
        if read is None or not (0 <= zoom <= DEEPEST and 0 <= column < 1 << zoom and 0 <= row < 1 << zoom):
            return None
        try:
            data = read(zoom, column, row)
        except Exception as error:  # as above
            trouble = name, str(error) if isinstance(error, sqlite3.Error) else "the file is damaged"
            if trouble in self._unread or len(self._unread) < MOST_REASONS:
                self._unread[trouble] = self._unread.get(trouble, 0) + 1
            return None
        kind = next((kind for start, kind in KINDS.items() if data and data.startswith(start)), None)
        return None if not data or kind is None or len(data) > MOST_TILE else (data, kind)


def _open_mbtiles(path: Path) -> tuple[ReadTile, tuple[int, int]]:
    check_regular_file(path)
    database = sqlite3.connect(f"{path.resolve().as_uri()}?mode=ro&immutable=1", uri=True, check_same_thread=False)
    least, largest = database.execute("SELECT min(zoom_level), max(zoom_level) FROM tiles").fetchone()
    if least is None:
        raise ValueError("no tiles")

    def read(zoom: int, column: int, row: int) -> bytes | None:
        place = zoom, column, (1 << zoom) - 1 - row  # MBTiles counts rows from the south
        found: Any = database.execute(
            "SELECT tile_data FROM tiles WHERE zoom_level = ? AND tile_column = ? AND tile_row = ?", place
        ).fetchone()
        return found[0] if found is not None and isinstance(found[0], bytes) else None

    return read, (int(least), int(largest))


def _open_pmtiles(path: Path) -> tuple[ReadTile, tuple[int, int]]:
    from pmtiles.reader import Reader  # only where a file needs it

    with open_regular_file(path) as file:
        data = mmap.mmap(file.fileno(), 0, access=mmap.ACCESS_READ)

    def read_bytes(offset: int, length: int) -> bytes:
        return data[offset : offset + length]

    reader: Any = Reader(read_bytes)
    header = reader.header()

    def read(zoom: int, column: int, row: int) -> bytes | None:
        found: bytes | None = reader.get(zoom, column, row)
        return found

    return read, (int(header["min_zoom"]), int(header["max_zoom"]))
