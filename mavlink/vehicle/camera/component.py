"""A camera of the vehicle: a component of its own, with its pictures and detections."""

import math
from collections import deque
from collections.abc import Iterable
from functools import cached_property
from typing import Any, NamedTuple

import imc
from mavlink import CRITICAL, STANDBY, Fields
from mavlink.translate import cameras_from_imc, from_imc
from mavlink.vehicle.camera.definition import definition
from mavlink.vehicle.interfaces import CameraView, PictureStore, VehiclePort
from mavlink.vehicle.model import SAVE_IMAGES, VehicleModel
from mavlink.vehicle.parameters import ExtendedParameter, ExtendedParameterTable
from mavlink.vehicle.session import Session
from support import wgs84

State = imc.EntityState.State
DETECTION_RATE = "Detection Rate"  # the option by which a camera detects objects
TAKEN, TAKE, STOP = "Picture", "Take Pictures", "Stop Pictures"  # topics of Event
REMEMBERED = 1000  # pictures
ACTIVE = 2.0  # s for which a detection is shown
PATIENCE = 0.25  # s until a setting counts as refused
LASTING = 60.0  # s for which an object is marked on the map
MOST_OBJECTS = 64
LONGEST_ADDRESS = 159  # bytes of VIDEO_STREAM_INFORMATION


class PendingChange(NamedTuple):
    """A parameter that was asked to have a value; after `until` that has failed."""

    parameter: ExtendedParameter
    value: str
    until: float


class CameraComponent:
    """A camera that takes pictures, or detects objects, or both; `component` is its number in MAVLink.

    Pictures are files in `pictures`, which stations read as the folder `logs`.
    """

    def __init__(
        self,
        component: int,
        view: CameraView,
        model: VehicleModel,
        port: VehiclePort,
        pictures: PictureStore,
    ):
        self.component = component
        self.model = model
        self.pictures = pictures
        self.video: str = view.video_url
        self.parameters: ExtendedParameterTable = ExtendedParameterTable(view.parameters)
        self.taken: int = 0
        self.interval: float = 0.0
        self.pending: dict[tuple[Session, str], PendingChange] = {}
        self._shown = {parameter.id: parameter.encoded for parameter in self.parameters}
        self._entity = view.entity
        self._port = port
        self._left = 0.0
        self._pictures: deque[cameras_from_imc.Picture] = deque(maxlen=REMEMBERED)
        self._found: dict[int, cameras_from_imc.Detection] = {}

    @property
    def label(self) -> str:
        """The label of its entity."""
        return self._entity.label

    @property
    def definition_file_name(self) -> str:
        """The name of the file that describes the settings, in the root of what stations can read."""
        return f"camera-{self.component}.xml"

    @cached_property
    def definition(self) -> bytes:
        """The content of that file."""
        return definition(self.label, self.parameters)

    @property
    def takes_pictures(self) -> bool:
        return self._value(SAVE_IMAGES) is not None

    @property
    def detects(self) -> bool:
        return self._value(DETECTION_RATE) is not None

    @property
    def saves_all(self) -> bool:
        """Whether the camera saves every image, without being asked."""
        return bool(self._value(SAVE_IMAGES))

    @property
    def trouble(self) -> str:
        """Reason why it takes no pictures; empty if it can."""
        entity = self._entity
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
    def mav_state(self) -> int:
        """MAV_STATE."""
        state = self._entity.state
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

    def video_fields(self) -> Fields:
        rate, angle = self._value("Frame Rate") or 0.0, self._value("Field of View") or 0.0
        return cameras_from_imc.video(self.label, self.video, rate, self.resolution, angle)

    def start_capture(self, count: int, interval: float) -> None:
        """Ask for `count` pictures, `interval` s apart; 0: until they are stopped."""
        self._left = count or math.inf
        self.interval = max(interval, self._period) if count != 1 else 0.0
        self._publish(TAKE, f"count={count};period={interval:.3f}")

    def stop_capture(self) -> None:
        """Ask for no more pictures, and not to save each image either."""
        self._left = self.interval = 0.0
        self._publish(STOP, "")
        if self.saves_all:
            self._port.set_parameter(self.label, SAVE_IMAGES, "false")

    def change_parameter(self, parameter: ExtendedParameter, value: str, session: Session, now: float) -> None:
        """Ask the vehicle to change a parameter; who asked is answered when it has."""
        self.pending[session, parameter.id] = PendingChange(parameter, value, now + PATIENCE)
        self._port.set_parameter(self.label, parameter.declaration.name, value)

    def changed_parameters(self) -> list[ExtendedParameter]:
        """Parameters that have changed since the last call."""
        changed = [each for each in self.parameters if each.encoded != self._shown[each.id]]
        self._shown.update({each.id: each.encoded for each in changed})
        return changed

    def _publish(self, topic: str, more: str) -> None:
        self._port.publish(imc.Event(topic=topic, data=f"camera={self.label};{more}", dst=self._port.imc_id))

    def add_picture(self, event: imc.Event) -> int | None:
        """Remember a picture; its index, None if the event lacks something."""
        given = dict(item.split("=", 1) for item in event.data.split(";") if "=" in item)
        names = ("time", "lat", "lon", "height", "depth", "roll", "pitch", "yaw")
        try:
            time, lat, lon, height, depth, *angles = (float(given[name]) for name in names)
        except (KeyError, ValueError):
            return None
        lat, lon = math.radians(lat), math.radians(lon)
        place = self.model.position_from_state(
            imc.EstimatedState(lat=lat, lon=lon, height=height, depth=depth, z=max(depth, 0.0))
        )
        roll, pitch, yaw = map(math.radians, angles)
        if place is None or not all(map(math.isfinite, (time, roll, pitch, yaw))):
            return None
        self._pictures.append(cameras_from_imc.Picture(given.get("file", ""), time, place, (roll, pitch, yaw)))
        self.taken += 1
        self._left = max(0.0, self._left - 1.0)
        return self.taken - 1

    def image_captured(self, index: int) -> Fields | None:
        """CAMERA_IMAGE_CAPTURED of a picture; None if there is none, or no longer."""
        oldest = self.taken - len(self._pictures)
        if not oldest <= index < self.taken:
            return None
        picture = self._pictures[index - oldest]
        url = f"mftp://[;comp=1]/logs/{picture.file}"
        return cameras_from_imc.image_captured(picture, index, url, from_imc.boot_ms(picture.time, self.model.boot))

    @property
    def latest_file(self) -> str:
        """Path of the last picture; empty if it is not among the pictures of the vehicle."""
        file = self._pictures[-1].file if self._pictures else ""
        return file if file and self.pictures.has(file) else ""

    def add_detection(self, mug: imc.EstimatedMugState, now: float) -> None:
        """Remember where an object is."""
        found = self.model.state_and_position()
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

    def latest_detection(self, now: float) -> cameras_from_imc.Detection | None:
        """Latest detection, while that is not long ago."""
        latest = next(reversed(self._found.values()), None)
        return latest if latest is not None and now - latest.time < ACTIVE else None

    def map_markers(self, now: float) -> Iterable[cameras_from_imc.Detection]:
        """Markers on maps."""
        return (
            [found for found in self._found.values() if now - found.time < LASTING]
            if self.model.options.detection_markers
            else []
        )

    @property
    def _period(self) -> float:
        return 1.0 / rate if (rate := self._value("Frame Rate")) else 0.0

    def _value(self, name: str) -> Any:
        """The value of an option of the camera; None if it has none of this name."""
        return self.parameters.value(name)


def takes_pictures(view: CameraView) -> bool:
    """Whether a camera has the option by which it takes pictures."""
    return any(each.declaration.name == SAVE_IMAGES for each in view.parameters)


def is_camera(options: Iterable[str]) -> bool:
    """Whether what has these options takes pictures or detects objects."""
    return bool({SAVE_IMAGES, DETECTION_RATE} & set(options))


def parse_video(text: str) -> tuple[str, str]:
    """Entity label and address of a video, such as "Fisheye Camera=rtsp://10.0.0.2:8554/down". Raises ValueError."""
    label, _, address = map(str.strip, text.partition("="))
    if not label or not address.startswith("rtsp://") or len(address.encode()) > LONGEST_ADDRESS:
        raise ValueError(f"{text!r} is not ENTITY LABEL=rtsp://ADDRESS, of {LONGEST_ADDRESS} letters at most")
    return label, address
