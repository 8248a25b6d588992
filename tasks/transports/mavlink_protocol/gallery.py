"""What all ground stations learn of the cameras: pictures, detections, settings."""

import math
from collections.abc import Callable, Iterable, Iterator

import imc
from mavlink import statustext
from support import wgs84
from tasks.transports.mavlink_protocol.camera_services import acknowledge_setting, show_picture, show_setting
from tasks.transports.mavlink_protocol.cameras import TAKEN, Asked, Camera
from tasks.transports.mavlink_protocol.session import Session
from tasks.transports.mavlink_protocol.system import MavlinkSystem

CHANGED, FAILED = 0, 2  # PARAM_ACK
DETECTION_PERIOD = 5.0  # s between lines on the same object
DETECTIONS = 64


class Gallery:
    """Passes on what cameras report, to the stations in `sessions()`."""

    def __init__(self, system: MavlinkSystem, sessions: Callable[[], Iterable[Session]]):
        self._system = system
        self._sessions = sessions
        self._detected: dict[int, float] = {}

    def hear(self, message: imc.Event | imc.EstimatedMugState | imc.EntityParameters, label: str, now: float) -> None:
        """Take a message of the entity with this label."""
        match message:
            case imc.EntityParameters():
                self._show_settings(message)
            case imc.EstimatedMugState():
                self._tell_detection(message, now)
                for camera in self._called(label):
                    camera.detect(message, self._system, now)
            case imc.Event(topic=topic) if topic == TAKEN:
                for camera in self._called(label):
                    index = camera.take(message, self._system)
                    if index is not None:
                        for part in self._views(camera):
                            show_picture(part, index)
            case _:
                pass

    def look_after(self, now: float) -> None:
        """Answer who has asked for a setting that the vehicle does not change."""
        for camera in self._system.cameras:
            self._answer(camera, lambda asked: asked.until <= now)

    def _tell_detection(self, mug: imc.EstimatedMugState, now: float) -> None:
        """Send one line per MUG, repeated after DETECTION_PERIOD s."""
        if now - self._detected.get(mug.id, -DETECTION_PERIOD) < DETECTION_PERIOD:
            return
        if len(self._detected) >= DETECTIONS:
            self._detected.clear()
        self._detected[mug.id] = now
        self._system.say(statustext.NOTICE, f"DETECT MUG {mug.id} " + self._place(mug.x, mug.y))

    def _place(self, north: float, east: float) -> str:
        """Latitude and longitude (degrees) of a point at an offset (m) from the vehicle; the offset if unknown."""
        found = self._system.place()
        if found is None or not (math.isfinite(north) and math.isfinite(east)):
            return f"{north:.1f} m north, {east:.1f} m east"
        lat, lon, _ = wgs84.displace(found[1].lat, found[1].lon, 0.0, north, east, 0.0)
        return f"{math.degrees(lat):.6f},{math.degrees(lon):.6f}"

    def _show_settings(self, reply: imc.EntityParameters) -> None:
        names = {item.name for item in reply.params if isinstance(item, imc.EntityParameter)}
        for camera in self._called(reply.name):
            self._answer(camera, lambda asked: asked.setting.parameter.name in names)
            for setting in camera.changed_settings():
                for part in self._views(camera):
                    show_setting(part, setting)

    def _answer(self, camera: Camera, which: Callable[[Asked], bool]) -> None:
        """Tell who has asked for settings whether they are as wanted."""
        for key, asked in [item for item in camera.asked.items() if which(item[1])]:
            del camera.asked[key]
            acknowledge_setting(key[0], asked.setting, CHANGED if asked.setting.text == asked.value else FAILED)

    def _called(self, label: str) -> Iterator[Camera]:
        return (camera for camera in self._system.cameras if camera.label == label)

    def _views(self, camera: Camera) -> Iterator[Session]:
        """The conversations of a camera."""
        return (part for session in self._sessions() for part in session.cameras if part.camera is camera)
