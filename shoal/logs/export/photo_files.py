"""The pictures in the folder Photos of a log, in the formats that other tools read."""

import io
import re
from collections.abc import Iterator
from pathlib import Path
from typing import NamedTuple

from shoal.logs.export.message_batches import LogSource

_PHOTO = re.compile(r"(?:(?P<camera>.+)_\d+_)?(?P<time>\d+(?:\.\d+)?)")
_FORMATS = {".png": "png", ".jpg": "jpeg", ".jpeg": "jpeg", ".qoi": "png"}
QOI = ".qoi"  # which only few tools read
END_OF_JPEG = b"\xff\xd9"
LAST = 64  # bytes of a file that some writers pad beyond its end


class Photo(NamedTuple):
    """A picture of a log: s since 1970 UTC, camera, "png" or "jpeg" as it is exported, file."""

    time: float
    camera: str
    format: str
    path: Path

    @property
    def export_suffix(self) -> str:
        return export_suffix(self.path)


def find_photos(folder: Path, start: float) -> Iterator[Photo]:
    """The pictures in a folder `Photos`, whose names end with the time: seconds since 1970, or since `start`.

    Names without a time are skipped.
    """
    for path in sorted(folder.rglob("*")):
        form = _FORMATS.get(path.suffix.lower())
        found = _PHOTO.fullmatch(path.stem)
        if form and found and path.is_file():
            time = float(found["time"])
            yield Photo(time if time > 1e9 else start + time, found["camera"] or "Camera", form, path)


def export_suffix(path: Path) -> str:
    """Suffix of the name of an exported picture."""
    ending = path.suffix.lower()
    return ".png" if ending == QOI else ending


def photo_export_bytes(source: LogSource, path: Path) -> bytes | None:
    """A picture as it is exported: as it is, or PNG of a QOI; None of one that cannot be read, which `source` notes.

    What is not decoded is checked for its header and its end, PNG also for the checksums of its parts.
    """
    from PIL import Image, UnidentifiedImageError

    try:
        data = path.read_bytes()
        with Image.open(io.BytesIO(data)) as picture:
            if path.suffix.lower() == QOI:
                packed = io.BytesIO()
                picture.save(packed, format="PNG", compress_level=1)
                return packed.getvalue()
            if picture.format == "JPEG" and END_OF_JPEG not in data[-LAST:]:
                raise ValueError("truncated")
            picture.verify()
        return data
    except UnidentifiedImageError:
        reason = "no picture"
    except (OSError, ValueError, SyntaxError, EOFError, IndexError, Image.DecompressionBombError) as error:
        reason = getattr(error, "strerror", None) or ("no picture" if path.suffix.lower() == QOI else str(error))
    source.unreadable_photos.append(f"{path.name}: {reason}")
    return None
