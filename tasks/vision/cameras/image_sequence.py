"""Pictures and videos on disk, with their times; reading blocks, so it belongs into a worker."""

import importlib
import math
import re
from collections.abc import Iterator
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

Image = NDArray[np.uint8]

ENDINGS = (".png", ".jpg", ".jpeg", ".qoi", ".bmp", ".tif", ".tiff", ".ppm", ".pgm")
PHOTO = re.compile(r"(?P<camera>.+)_(?P<number>\d{6,})_(?P<time>-?\d+\.\d+)")
STAMP = re.compile(r"\d+(\.\d+)?")
HEADS = {  # files that identify a folder of EuRoC, or a table of TUM
    "sensor.yaml": re.compile(r"^comment:\s*[\"']?(.*?)[\"']?\s*$", re.MULTILINE),
    "rgb": re.compile(r"^# color images of (.*?)\s*$", re.MULTILINE),
}
NANO = 1e12  # numbers beyond that are ns
LAST = 1e12  # s since 1970, beyond which a time is none
MOST_PIXELS = 1 << 26  # of a picture
MOST_REPORTED = 10  # bad lines that are named


class TimedImage(NamedTuple):
    """A picture by its number in the footage: its time (s), and RGBA, or None and what is wrong with it."""

    number: int
    time: float
    image: Image | None
    error: str


class ImageSequence:
    """Pictures of a folder (EuRoC, TUM, `Photos` of a log, names that are times) or of a video, in order of time.

    `camera` chooses one of several in a folder. It is opened with the first picture that is taken.
    """

    def __init__(self, source: Path, camera: str = ""):
        self.source = source
        self.problems: list[str] = []
        self._camera = camera
        self._pictures: list[tuple[float, Path]] | None = None
        self._video: Any = None  # its last reference frees it; to release it while a worker reads it would be a crash
        self._next = 0  # of the video

    def read(self, number: int, earliest: float = -math.inf) -> TimedImage | str | None:
        """Picture `number` (from 0), or the first one after it that is not before `earliest` (s since 1970).

        None at the end. A text is the reason why the source cannot be read.
        """
        try:
            if self._pictures is None and self._video is None:
                self._open()
            return self._of_video(number) if self._pictures is None else self._of_folder(number, earliest)
        except (OSError, ValueError) as error:
            return f"{self.source}: {getattr(error, 'strerror', None) or error}"

    def _open(self) -> None:
        if self.source.is_dir():
            self._pictures = self._listed(find_pictures_folder(self.source, self._camera))
            return
        with self.source.open("rb"):  # for the reason of the system, if it cannot be
            pass
        video = open_video(str(self.source))
        if video is None:
            raise ValueError("OpenCV cannot read this video")
        self._video, self._next = video, 0

    def _listed(self, folder: Path) -> list[tuple[float, Path]]:
        if (folder / "data.csv").is_file():
            rows = self._rows(folder / "data.csv", ",", folder / "data")
        elif (folder / "rgb.txt").is_file():
            rows = self._rows(find_tum_table(folder, self._camera)[0], None, folder)
        else:
            rows = self._named(folder)
        found = sorted(rows, key=lambda row: row[0])
        if not found:
            raise ValueError("no pictures with times" + (f" of {self._camera}" if self._camera else ""))
        return found

    def _rows(self, table: Path, separator: str | None, folder: Path) -> Iterator[tuple[float, Path]]:
        """The rows of a table: a time, in s or ns, and a file."""
        for number, line in enumerate(table.read_text("utf-8", "replace").splitlines(), start=1):
            if not line.strip() or line.lstrip().startswith("#"):
                continue
            words = [word.strip() for word in line.split(separator)]
            if len(words) < 2 or not words[1] or not is_time(words[0]):
                self._note(f"{table.name}, line {number}: {line[:60]!r} is not a time and a file")
            elif not is_inside(folder, words[1]):
                self._note(f"{table.name}, line {number}: {words[1][:60]!r} is no file in the folder")
            else:
                yield parse_timestamp_seconds(words[0]), folder / words[1]

    def _named(self, folder: Path) -> Iterator[tuple[float, Path]]:
        """Pictures whose names contain their times, and perhaps their camera."""
        wanted = safe_file_name(self._camera)
        cameras: set[str] = set()
        for path in sorted(folder.iterdir()):
            if path.suffix.lower() not in ENDINGS:
                continue
            photo = PHOTO.fullmatch(path.stem)
            if photo is not None and abs(float(photo["time"])) <= LAST:
                if wanted in ("", photo["camera"]):
                    cameras.add(photo["camera"])
                    yield float(photo["time"]), path
            elif is_time(path.stem):
                yield parse_timestamp_seconds(path.stem), path
            else:
                self._note(f"{path.name}: the name is no time")
        if len(cameras) > 1:
            raise ValueError(f"pictures of several cameras: {', '.join(sorted(cameras))}; choose one")

    def _note(self, problem: str) -> None:
        self.problems.append(problem)

    def _of_folder(self, number: int, earliest: float) -> TimedImage | None:
        assert self._pictures is not None
        while number < len(self._pictures) and self._pictures[number][0] < earliest:
            number += 1
        if number >= len(self._pictures):
            return None
        time, path = self._pictures[number]
        image, error = read_picture(path)
        return TimedImage(number, time, image, error)

    def _of_video(self, number: int) -> TimedImage | None:
        cv2 = importlib.import_module("cv2")
        while self._next < number:
            if not self._video.grab():
                return None
            self._next += 1
        rate = self._video.get(cv2.CAP_PROP_FPS)
        done, picture = self._video.read()
        if not done:
            return None
        self._next += 1
        time = self._video.get(cv2.CAP_PROP_POS_MSEC) / 1e3
        if number and not time > 0.0:  # not all containers have times
            if not 0.0 < rate < math.inf:
                raise ValueError("the video has neither times nor a rate")
            time = number / rate
        return TimedImage(number, time, bgr_to_rgba(picture), "")


def find_pictures_folder(source: Path, camera: str) -> Path:
    """The folder of pictures within a data set or a log, or the folder itself.

    Raises ValueError if a data set has no such camera; the first one counts without a name.
    """
    for root in (source / "mav0", source):
        folders = sorted(path for path in root.glob("cam*") if re.fullmatch(r"cam\d+", path.name) and path.is_dir())
        if folders:
            named = [(path, _named_in(path / "sensor.yaml", HEADS["sensor.yaml"])) for path in folders]
            return _chosen(named, camera)[0]
    return source / "Photos" if (source / "Photos").is_dir() else source


def find_tum_table(folder: Path, camera: str) -> tuple[Path, str]:
    """The table of a camera of TUM's, and the name in it. Raises ValueError if there is no such camera."""
    tables = sorted(path for path in folder.glob("rgb*.txt") if re.fullmatch(r"rgb\d*", path.stem))
    return _chosen([(path, _named_in(path, HEADS["rgb"])) for path in tables], camera)


def _named_in(file: Path, pattern: re.Pattern[str]) -> str:
    try:
        found = pattern.search(file.read_text("utf-8", "replace"))
    except OSError:
        return ""
    return found[1] if found else ""


def _chosen(cameras: list[tuple[Path, str]], camera: str) -> tuple[Path, str]:
    """One of several by the name of its file, or the one in it; the first one without a name."""
    wanted = safe_file_name(camera)
    for path, name in cameras:
        if wanted in ("", safe_file_name(path.stem), safe_file_name(name)):
            return path, name
    there = ", ".join(path.stem + (f" ({name})" if name else "") for path, name in cameras)
    raise ValueError(f"no camera {camera}; there are {there}")


def safe_file_name(name: str) -> str:
    """The name of a camera as files of pictures have it."""
    return re.sub(r"[^A-Za-z0-9]+", "_", name)


def find_calibration(source: Path, camera: str) -> tuple[Path, str] | None:
    """The calibration that a folder of pictures has, and which of its cameras; None if there is none.

    Raises ValueError as `find_pictures_folder`, OSError.
    """
    folder = find_pictures_folder(source, camera)
    if (folder / "rgb.txt").is_file():
        camera = find_tum_table(folder, camera)[1] or camera
    if (described := folder / "cameras.yaml").is_file():
        labels: list[str] = re.findall(r"^([^\s#].*?):\s*$", described.read_text("utf-8", "replace"), re.MULTILINE)
        return described, next((label for label in labels if safe_file_name(label) == safe_file_name(camera)), camera)
    sensor = folder / "sensor.yaml"
    return (sensor, "") if sensor.is_file() and "intrinsics" in sensor.read_text("utf-8", "replace") else None


def is_time(text: str) -> bool:
    return STAMP.fullmatch(text) is not None and parse_timestamp_seconds(text) <= LAST


def is_inside(folder: Path, name: str) -> bool:
    """Whether a name of a file leads to somewhere in the folder."""
    try:
        return (folder / name).resolve().is_relative_to(folder.resolve())
    except (OSError, ValueError, RuntimeError):  # too long, a zero byte, links in a circle
        return False


def parse_timestamp_seconds(text: str) -> float:
    """A time in s or ns as s."""
    number = float(text)
    return number / 1e9 if number > NANO else number


def read_picture(path: Path) -> tuple[Image | None, str]:
    """A picture as RGBA, or None and why there is none."""
    from PIL import Image as Pillow

    try:
        with Pillow.open(path) as picture:
            width, height = picture.size
            if width * height > MOST_PIXELS:
                return None, f"{path.name}: {width} x {height} px are too many"
            if picture.mode.startswith("I;16") or picture.mode == "I":
                deep = np.asarray(picture).astype(np.int64)
                return bgr_to_rgba(np.clip(deep >> 8, 0, 0xFF).astype(np.uint8)), ""
            return np.array(picture.convert("RGBA")), ""
    except OSError as error:
        return None, f"{path.name}: {error.strerror or 'no picture'}"
    except (ValueError, SyntaxError, EOFError, Pillow.DecompressionBombError) as error:
        return None, f"{path.name}: {error}"


def open_video(address: str | int, timeout: float = 0.0) -> Any:
    """OpenCV's capture of a file, an address or a device; None if it cannot be opened.

    With a `timeout` (s), a network that falls silent ends it. Raises OSError without OpenCV.
    """
    try:
        cv2 = importlib.import_module("cv2")
    except ModuleNotFoundError:
        raise OSError("videos and cameras need pip install opencv-python-headless") from None
    if isinstance(address, str) and timeout:
        limit = round(1000 * timeout)
        words = [cv2.CAP_PROP_OPEN_TIMEOUT_MSEC, limit, cv2.CAP_PROP_READ_TIMEOUT_MSEC, limit]
        found = cv2.VideoCapture(address, cv2.CAP_FFMPEG, words)
    else:
        found = cv2.VideoCapture(address)
    return found if found.isOpened() else None


def bgr_to_rgba(picture: Any) -> Image:
    """Convert from OpenCV's blue, green, red, or from gray."""
    if picture.ndim == 2:
        picture = np.repeat(picture[..., np.newaxis], 3, axis=-1)
    image = np.full((*picture.shape[:2], 4), 255, np.uint8)
    image[..., :3] = picture[..., 2::-1]
    return image
