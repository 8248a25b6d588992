"""Camera messages to all ground stations: pictures, detections, settings."""

import math
from collections.abc import Callable, Iterable, Iterator, Sequence

import imc
from mavlink import statustext
from mavlink.vehicle.camera.component import TAKEN, CameraComponent, PendingChange
from mavlink.vehicle.camera.service import acknowledge_parameter, send_image_captured, send_parameter
from mavlink.vehicle.model import VehicleModel
from mavlink.vehicle.session import Session
from support import wgs84
from support.log_limit import ReportLimit

CHANGED, FAILED = 0, 2  # PARAM_ACK
DETECTION_PERIOD = 5.0  # s between lines on the same object


class CameraBroadcast:
    """Passes on what cameras report, to the stations in `sessions()`."""

    def __init__(
        self,
        model: VehicleModel,
        cameras: Sequence[CameraComponent],
        sessions: Callable[[], Iterable[Session]],
        send_statustext: Callable[[int, str], object],
    ):
        self._model = model
        self._cameras = cameras
        self._sessions = sessions
        self._send_statustext = send_statustext
        self._detected = ReportLimit(DETECTION_PERIOD)

    def update(self, message: imc.Event | imc.EstimatedMugState | imc.EntityParameters, label: str, now: float) -> None:
        """Take a message of the entity with this label."""
        match message:
            case imc.EntityParameters():
                self._send_parameters(message)
            case imc.EstimatedMugState():
                self._send_detection(message, now)
                for camera in self._called(label):
                    camera.add_detection(message, now)
            case imc.Event(topic=topic) if topic == TAKEN:
                for camera in self._called(label):
                    index = camera.add_picture(message)
                    if index is not None:
                        for part in self._views(camera):
                            send_image_captured(part, camera, index)
            case _:
                pass

    def expire_parameter_changes(self, now: float) -> None:
        """Answer who has asked for a setting that the vehicle does not change."""
        for camera in self._cameras:
            self._answer(camera, lambda asked: asked.until <= now)

    def _send_detection(self, mug: imc.EstimatedMugState, now: float) -> None:
        """Send one line per MUG, repeated after DETECTION_PERIOD s."""
        if self._detected.is_due(mug.id, now):
            self._send_statustext(statustext.NOTICE, f"DETECT MUG {mug.id} " + self._place(mug.x, mug.y))

    def _place(self, north: float, east: float) -> str:
        """Latitude and longitude (degrees) of a point at an offset (m) from the vehicle; the offset if unknown."""
        found = self._model.state_and_position()
        if found is None or not (math.isfinite(north) and math.isfinite(east)):
            return f"{north:.1f} m north, {east:.1f} m east"
        lat, lon, _ = wgs84.displace(found[1].lat, found[1].lon, 0.0, north, east, 0.0)
        return f"{math.degrees(lat):.6f},{math.degrees(lon):.6f}"

    def _send_parameters(self, reply: imc.EntityParameters) -> None:
        names = {item.name for item in reply.params if isinstance(item, imc.EntityParameter)}
        for camera in self._called(reply.name):
            self._answer(camera, lambda asked: asked.parameter.declaration.name in names)
            for parameter in camera.changed_parameters():
                for part in self._views(camera):
                    send_parameter(part, camera, parameter)

    def _answer(self, camera: CameraComponent, which: Callable[[PendingChange], bool]) -> None:
        """Report to those who have requested settings whether they apply."""
        for key, asked in [item for item in camera.pending.items() if which(item[1])]:
            del camera.pending[key]
            acknowledge_parameter(key[0], asked.parameter, CHANGED if asked.parameter.text == asked.value else FAILED)

    def _called(self, label: str) -> Iterator[CameraComponent]:
        return (camera for camera in self._cameras if camera.label == label)

    def _views(self, camera: CameraComponent) -> Iterator[Session]:
        """The conversations of a camera."""
        return (
            part
            for session in self._sessions()
            for part in session.cameras
            if part.source.component == camera.component
        )
