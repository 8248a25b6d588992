"""The cameras of a vehicle: each is a component of its own, with its pictures and detections."""

import math
import shutil
from collections import deque
from collections.abc import Callable, Iterable, Mapping
from functools import cached_property
from pathlib import Path
from typing import TYPE_CHECKING, Any, NamedTuple

import imc
from mavlink import CRITICAL, STANDBY, Fields
from mavlink.translate import cameras_from_imc, from_imc
from runtime import Task
from runtime.task import State
from support import wgs84
from tasks.transports.mavlink_protocol.camera_definition import definition
from tasks.transports.mavlink_protocol.camera_streams import camera_streams
from tasks.transports.mavlink_protocol.settings import Setting, SettingsTable
from tasks.transports.mavlink_protocol.streams import Stream
from tasks.transports.mavlink_protocol.system import PICTURES, MavlinkSystem

if TYPE_CHECKING:
    from tasks.transports.mavlink_protocol.session import Session

DETECTIONS = "Detection Rate"  # the option by which a camera detects objects
TAKEN, TAKE, STOP = "Picture", "Take Pictures", "Stop Pictures"  # topics of Event
REMEMBERED = 1000  # pictures
ACTIVE = 2.0  # s for which a detection is shown
PATIENCE = 0.25  # s until a setting counts as refused
LASTING = 60.0  # s for which an object is marked on the map
MOST_OBJECTS = 64
LONGEST_ADDRESS = 159  # bytes of VIDEO_STREAM_INFORMATION


class Asked(NamedTuple):
    """A setting that was asked to have a value; after `until` that has failed."""

    setting: Setting
    value: str
    until: float


class Camera:
    """A camera that takes pictures, or detects objects, or both; `component` is its number in MAVLink.

    Pictures are files below `root`, which stations read as the folder `logs`. `video` is the address of its RTSP
    stream, empty if it has none; `marks()` whether detected objects are shown on maps.
    """

    def __init__(
        self, component: int, task: Task, root: Path, video: str = "", marks: Callable[[], bool] = lambda: False
    ):
        self.component = component
        self.video = video
        self.marks = marks
        self.settings = SettingsTable(task)
        self.taken = 0
        self.interval = 0.0
        self._shown = {setting.id: setting.encoded for setting in self.settings}
        self._task = task
        self._root = root
        self._left = 0.0
        self._pictures: deque[cameras_from_imc.Picture] = deque(maxlen=REMEMBERED)
        self._found: dict[int, cameras_from_imc.Detection] = {}
        self.asked: dict[tuple[Session, str], Asked] = {}
        self.streams: Mapping[str, Stream] = camera_streams(self)
        self.rates = {name: float(stream.rate) for name, stream in self.streams.items()}

    @property
    def label(self) -> str:
        """Of its entity."""
        return self._task.entity.label

    @property
    def definition_file(self) -> str:
        """The name of the file that describes the settings, in the root of what stations can read."""
        return f"camera-{self.component}.xml"

    @cached_property
    def definition(self) -> bytes:
        """Its content."""
        return definition(self.label, self.settings)

    @property
    def takes_pictures(self) -> bool:
        return self._value(PICTURES) is not None

    @property
    def detects(self) -> bool:
        return self._value(DETECTIONS) is not None

    @property
    def saves_all(self) -> bool:
        """Whether it saves every image, without being asked."""
        return bool(self._value(PICTURES))

    @property
    def trouble(self) -> str:
        """Why it takes no pictures; empty if it can."""
        entity = self._task.entity
        return "" if entity.state == State.NORMAL else f"{entity.label} is in {entity.state.name}: {entity.description}"

    @property
    def resolution(self) -> tuple[int, int]:
        """Width and height in px; 0: unknown."""
        side = self._value("Size") or 0
        return self._value("Horizontal Resolution") or side, self._value("Vertical Resolution") or side

    @property
    def flags(self) -> int:
        """CAMERA_CAP_FLAGS."""
        can = cameras_from_imc.CAPTURES * self.takes_pictures | cameras_from_imc.STREAMS * bool(self.video)
        return can | cameras_from_imc.DETECTS * self.detects

    @property
    def status(self) -> int:
        """MAV_STATE."""
        state = self._task.entity.state
        if state in (State.ERROR, State.FAILURE):
            return CRITICAL
        return cameras_from_imc.ACTIVE if state == State.NORMAL else STANDBY

    @property
    def image_status(self) -> int:
        if self.saves_all or self._left > 1.0:
            return cameras_from_imc.SERIES
        return cameras_from_imc.ONE if self._left else cameras_from_imc.IDLE

    @property
    def image_interval(self) -> float:
        """Seconds between the pictures of a series."""
        return self._period if self.saves_all and not self._left else self.interval

    @property
    def disk(self) -> tuple[float, float, float]:
        """Total, used and free bytes where pictures are stored; 0: unknown."""
        try:
            return shutil.disk_usage(next(path for path in (self._root, *self._root.parents) if path.exists()))
        except (OSError, StopIteration):
            return 0.0, 0.0, 0.0

    def video_fields(self) -> Fields:
        rate, angle = self._value("Frame Rate") or 0.0, self._value("Field of View") or 0.0
        return cameras_from_imc.video(self.label, self.video, rate, self.resolution, angle)

    def order(self, system: MavlinkSystem, count: int, interval: float) -> None:
        """Ask for `count` pictures, `interval` s apart; 0: until they are stopped."""
        self._left = count or math.inf
        self.interval = max(interval, self._period) if count != 1 else 0.0
        self._publish(system, TAKE, f"count={count};period={interval:.3f}")

    def stop(self, system: MavlinkSystem) -> None:
        """Ask for no more pictures, and not to save each image either."""
        self._left = self.interval = 0.0
        self._publish(system, STOP, "")
        if self.saves_all:
            self._set(system, PICTURES, "false")

    def change(self, setting: Setting, value: str, session: "Session", now: float) -> None:
        """Ask the vehicle to change a setting; who asked is answered when it has."""
        self.asked[session, setting.id] = Asked(setting, value, now + PATIENCE)
        self._set(session.autopilot, setting.parameter.name, value)

    def changed_settings(self) -> list[Setting]:
        """Settings that have changed since the last call."""
        changed = [setting for setting in self.settings if setting.encoded != self._shown[setting.id]]
        self._shown.update({setting.id: setting.encoded for setting in changed})
        return changed

    def _set(self, system: MavlinkSystem, name: str, value: str) -> None:
        wish = imc.EntityParameter(name=name, value=value)
        system.publish(imc.SetEntityParameters(name=self.label, params=(wish,), dst=system.imc_id))

    def _publish(self, system: MavlinkSystem, topic: str, more: str) -> None:
        system.publish(imc.Event(topic=topic, data=f"camera={self.label};{more}", dst=system.imc_id))

    def take(self, told: imc.Event, system: MavlinkSystem) -> int | None:
        """Remember a picture; its index, None if the event does not tell enough."""
        given = dict(item.split("=", 1) for item in told.data.split(";") if "=" in item)
        names = ("time", "lat", "lon", "height", "depth", "roll", "pitch", "yaw")
        try:
            time, lat, lon, height, depth, *angles = (float(given[name]) for name in names)
        except (KeyError, ValueError):
            return None
        lat, lon = math.radians(lat), math.radians(lon)
        place = system.position(imc.EstimatedState(lat=lat, lon=lon, height=height, depth=depth, z=max(depth, 0.0)))
        roll, pitch, yaw = map(math.radians, angles)
        if place is None or not all(map(math.isfinite, (time, roll, pitch, yaw))):
            return None
        self._pictures.append(cameras_from_imc.Picture(given.get("file", ""), time, place, (roll, pitch, yaw)))
        self.taken += 1
        self._left = max(0.0, self._left - 1.0)
        return self.taken - 1

    def captured(self, index: int, boot: float) -> Fields | None:
        """CAMERA_IMAGE_CAPTURED of a picture; None if there is none, or no longer."""
        oldest = self.taken - len(self._pictures)
        if not oldest <= index < self.taken:
            return None
        picture = self._pictures[index - oldest]
        url = f"mftp://[;comp=1]/logs/{picture.file}"
        return cameras_from_imc.image_captured(picture, index, url, from_imc.boot_ms(picture.time, boot))

    @property
    def latest_file(self) -> Path | None:
        """That of the last picture; None if there is none below the folder of the logs."""
        path = (self._root / self._pictures[-1].file).resolve() if self._pictures else self._root
        return path if path.is_file() and path.is_relative_to(self._root.resolve()) else None

    def detect(self, mug: imc.EstimatedMugState, system: MavlinkSystem, now: float) -> None:
        """Remember where an object is."""
        found = system.place()
        if found is None or not (math.isfinite(mug.x) and math.isfinite(mug.y)):
            return
        state, here = found
        try:
            lat, lon, _ = wgs84.displace(here.lat, here.lon, 0.0, mug.x, mug.y, 0.0)
        except (ArithmeticError, ValueError):
            return
        below = state.alt if 0.0 < state.alt < math.inf else math.nan
        distance = math.sqrt(mug.x**2 + mug.y**2 + below**2)
        self._found.pop(mug.id, None)
        while len(self._found) >= MOST_OBJECTS:
            del self._found[next(iter(self._found))]
        self._found[mug.id] = cameras_from_imc.Detection(mug.id, lat, lon, here.altitude - below, distance, now)

    def tracked(self, now: float) -> cameras_from_imc.Detection | None:
        """What was detected last, while that is not long ago."""
        latest = next(reversed(self._found.values()), None)
        return latest if latest is not None and now - latest.time < ACTIVE else None

    def marked(self, now: float) -> Iterable[cameras_from_imc.Detection]:
        """What is shown on maps."""
        return [found for found in self._found.values() if now - found.time < LASTING] if self.marks() else []

    @property
    def _period(self) -> float:
        return 1.0 / rate if (rate := self._value("Frame Rate")) else 0.0

    def _value(self, name: str) -> Any:
        """Of an option of the task; None if it has none of this name."""
        return self.settings.value(name)


def find_cameras(
    tasks: Iterable[Task], root: Path, videos: Mapping[str, str], marks: Callable[[], bool]
) -> list[Camera]:
    """The cameras among tasks, in the order of their labels; there are numbers for six."""
    found = [t for t in tasks if {PICTURES, DETECTIONS} & set(t.parameter_set.declarations)]
    found.sort(key=lambda task: task.entity.label)
    return [
        Camera(component, task, root, videos.get(task.entity.label, ""), marks)
        for component, task in zip(cameras_from_imc.COMPONENTS, found, strict=False)
    ]


def parse_video(text: str) -> tuple[str, str]:
    """Entity label and address of a video, such as "Fisheye Camera=rtsp://10.0.0.2:8554/down". Raises ValueError."""
    label, _, address = map(str.strip, text.partition("="))
    if not label or not address.startswith("rtsp://") or len(address.encode()) > LONGEST_ADDRESS:
        raise ValueError(f"{text!r} is not ENTITY LABEL=rtsp://ADDRESS, of {LONGEST_ADDRESS} letters at most")
    return label, address
