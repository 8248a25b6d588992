"""Pictures of a log at its present time: those in its folder Photos, and those that are messages."""

import asyncio
import io
from bisect import bisect_right
from collections.abc import Mapping
from pathlib import Path
from typing import Any

import imc
from shoal.console.cameras.camera_picture import CameraPicture, PictureLens
from shoal.console.cameras.detection_marks import DETECTION, STATE, Mark, RecentDetections, picture_marks
from shoal.console.cameras.live_pictures import CameraView, LivePictures, picture_view
from shoal.console.logs.log_link import LogLink
from shoal.logs.export import (
    LoggedCamera,
    MapOrigin,
    Photo,
    SystemDetections,
    find_photos,
    first_origin,
    load_camera_models,
    read_photo_cameras,
)
from shoal.network import Network, NetworkSystem
from support.file_errors import describe_os_error
from support.picture_headers import read_picture_header
from support.regular_files import read_regular_file
from support.terminal_text import printable

PHOTOS = "Photos"
LARGEST = 64 << 20  # bytes of a file that is read at all
LARGEST_AS_IT_IS = 4 << 20  # bytes of a picture that goes to the page unchanged
LONGEST_SIDE, QUALITY = 1600, 90  # px and % of a JPEG that stands for a larger picture
NAMED = "photos:"
FORMATS = "JPEG", "PNG", "QOI"  # others have readers that start programs
MOST_KEPT = 16  # pictures that were read


class _PhotoSeries:
    """The pictures of one camera in the order of time."""

    def __init__(self, photos: list[Photo], lens: PictureLens | None) -> None:
        self.photos: list[Photo] = sorted(photos, key=lambda photo: photo.time)
        self.times: list[float] = [photo.time for photo in self.photos]
        self.lens: PictureLens | None = lens


class LoggedPictures(LivePictures):
    """The last picture of each camera up to the present time of a log. Photos belong to who wrote the log."""

    def __init__(self, network: Network, player: LogLink) -> None:
        super().__init__(network)
        self._player = player
        player.on_jump(self.forget_pictures)
        self._reading = asyncio.Lock()
        self._series: Mapping[str, _PhotoSeries] | None = None
        self._detections: dict[int, SystemDetections | None] = {}
        self._shown: dict[Path, CameraPicture | str] = {}  # with the reason why one cannot be shown

    async def describe(self, system: NetworkSystem, live: str = "") -> dict[str, Any]:
        found = await super().describe(system, live)
        is_owner = system.name == self._player.system_name(self._player.states.owner)
        series: Mapping[str, _PhotoSeries] = await self._photos() if is_owner else {}
        await self._read_detections(system)
        cameras: list[CameraView] = [await self._photo_view(system, name, each) for name, each in series.items()]
        cameras += [camera for camera in found["cameras"] if camera["number"] is not None]
        return {"note": "" if cameras else self.no_camera_text(system), "cameras": cameras}

    def no_camera_text(self, system: NetworkSystem) -> str:
        return f"the log has no picture of {printable(system.name)}"

    async def picture(self, system: NetworkSystem, camera: str, number: int) -> tuple[str, bytes] | None:
        if not camera.startswith(NAMED):
            return await super().picture(system, camera, number)
        series = (await self._photos()).get(camera.removeprefix(NAMED))
        if series is None or number >= len(series.photos):
            return None
        found = await self._read(series.photos[number], series.lens)
        return found.header.format, found.data

    def marks(self, system: NetworkSystem, vehicle: RecentDetections, picture: CameraPicture) -> list[Mark]:
        detections = self._detections.get(system.id or 0)
        return [] if detections is None else picture_marks(picture, detections, system.label)

    def age(self, system: NetworkSystem, picture: CameraPicture) -> float:
        return self._player.now - picture.time

    async def _photo_view(self, system: NetworkSystem, name: str, series: _PhotoSeries) -> CameraView:
        label = series.lens.camera.label if series.lens is not None else name
        view: CameraView = {"camera": NAMED + name, "label": printable(label), "trouble": ""}
        number = bisect_right(series.times, self._player.now) - 1
        nothing: CameraView = {**view, "number": None, "age": None, "marks": []}
        if number < 0:
            return nothing
        try:
            picture = await self._read(series.photos[number], series.lens)
        except ValueError as error:
            return {**nothing, "trouble": printable(str(error))}
        marks = self.marks(system, RecentDetections(), picture)
        return {**view, "number": number, **picture_view(picture, self.age(system, picture), marks)}

    async def _photos(self) -> Mapping[str, _PhotoSeries]:
        async with self._reading:
            if self._series is None:
                folders = [path if path.is_dir() else path.parent for path in self._player.logs]
                self._series = await asyncio.to_thread(_find_series, folders, self._player.states.start)
            return self._series

    async def _read(self, photo: Photo, lens: PictureLens | None) -> CameraPicture:
        """A picture as it goes to the page; the last ones are kept. Raises ValueError with the reason."""
        async with self._reading:
            found = self._shown.get(photo.path)
            if found is None:
                try:
                    found = await asyncio.to_thread(_read_photo, photo, lens)
                except ValueError as error:
                    found = str(error)
                if len(self._shown) >= MOST_KEPT:
                    self._shown.clear()
                self._shown[photo.path] = found
        if isinstance(found, str):
            raise ValueError(found)
        return found

    async def _read_detections(self, system: NetworkSystem) -> None:
        number = system.id or 0
        async with self._reading:
            if number not in self._detections:
                self._detections[number] = await asyncio.to_thread(_find_detections, self._player.states.path, number)


def _find_series(folders: list[Path], start: float) -> Mapping[str, _PhotoSeries]:
    photos: dict[str, list[Photo]] = {}
    lenses: dict[str, PictureLens] = {}
    for folder in (each / PHOTOS for each in folders):
        cameras: dict[str, LoggedCamera] = read_photo_cameras(folder)
        models = load_camera_models(folder, cameras)
        lenses |= {name: PictureLens(cameras[name], model) for name, model in models.items()}
        for photo in find_photos(folder, start):
            if not photo.path.is_symlink():  # which may lead out of a log of others
                photos.setdefault(photo.camera, []).append(photo)
    return {name: _PhotoSeries(found, lenses.get(name)) for name, found in sorted(photos.items())}


def _read_photo(photo: Photo, lens: PictureLens | None) -> CameraPicture:
    """Raises ValueError."""
    name = photo.path.name
    try:
        if photo.path.stat().st_size > LARGEST:
            raise ValueError(f"{name} has more than {LARGEST >> 20} MiB")
        data = read_regular_file(photo.path)
    except OSError as error:
        raise ValueError(describe_os_error(error)) from None
    try:
        if len(data) > LARGEST_AS_IT_IS or photo.path.suffix.lower() == ".qoi":
            data = _smaller(data)
        header = read_picture_header(data)
    except ValueError as error:
        raise ValueError(f"{name}: {error}") from None
    return CameraPicture(header, data, photo.time, photo.camera, lens)


def _smaller(data: bytes) -> bytes:
    """A JPEG of a picture that is large, or that browsers do not show. Raises ValueError."""
    try:
        from PIL import Image
    except ModuleNotFoundError:
        raise ValueError("needs pip install 'shoal[vision]' to be shown") from None
    try:
        with Image.open(io.BytesIO(data), formats=FORMATS) as picture:
            picture.draft("RGB", (LONGEST_SIDE, LONGEST_SIDE))
            shown, packed = picture.convert("RGB"), io.BytesIO()
            shown.thumbnail((LONGEST_SIDE, LONGEST_SIDE))
            shown.save(packed, format="JPEG", quality=QUALITY)
            return packed.getvalue()
    except (OSError, SyntaxError, EOFError, IndexError, Image.DecompressionBombError) as error:
        raise ValueError(f"damaged: {error}") from None


def _find_detections(path: Path, number: int) -> SystemDetections | None:
    """The detections of a system in a log; None without any."""
    try:
        log = imc.Log(path)
        states, found = (log.array(name, src=number) for name in (STATE, DETECTION))
    except (KeyError, ValueError, OSError):
        return None
    origin = first_origin(states) if len(states) and len(found) else None
    return None if origin is None else SystemDetections(MapOrigin(*origin), states, found)
