"""The pictures of a vehicle on the disk: how full that is, and small copies of them."""

import io
import shutil
from collections.abc import Callable
from pathlib import Path
from typing import Protocol

from mavlink.vehicle import Thumbnail


class Offload(Protocol):
    """Calls a function outside of the handlers, and `then` with its result."""

    def __call__(
        self, function: Callable[..., Thumbnail], *args: object, then: Callable[[Thumbnail], object]
    ) -> None: ...


class DiskPictures:
    """The pictures below a folder, as a PictureStore."""

    def __init__(self, root: Path, offload: Offload):
        self._root = root
        self._offload = offload

    def usage(self) -> tuple[float, float, float]:
        """Total, used and free bytes where pictures are stored; 0: unknown."""
        try:
            return shutil.disk_usage(next(path for path in (self._root, *self._root.parents) if path.exists()))
        except (OSError, StopIteration):
            return 0.0, 0.0, 0.0

    def has(self, file: str) -> bool:
        path = (self._root / file).resolve()
        return path.is_file() and path.is_relative_to(self._root.resolve())

    def make_thumbnail(self, file: str, side: int, quality: int, then: Callable[[Thumbnail], object]) -> None:
        """Make a small JPEG of a picture, outside of the handlers."""
        self._offload(make_thumbnail, (self._root / file).resolve(), side, quality, then=then)


def make_thumbnail(path: Path, side: int, quality: int) -> Thumbnail:
    """A JPEG of a picture, at most `side` pixels wide and high."""
    try:
        from PIL import Image

        with Image.open(path) as picture:
            picture.thumbnail((side, side))
            made = io.BytesIO()
            picture.convert("RGB").save(made, format="JPEG", quality=quality)
            return Thumbnail(made.getvalue(), *picture.size)
    except (ImportError, OSError, ValueError):
        return Thumbnail()
