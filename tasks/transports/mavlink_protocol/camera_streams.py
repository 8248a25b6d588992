"""The messages that a camera streams or sends on request."""

from collections.abc import Callable, Mapping, Sequence
from typing import TYPE_CHECKING

from mavlink import Fields, Flavor
from mavlink.translate import cameras_from_imc, from_imc
from tasks.transports.mavlink_protocol.camera_definition import version_of
from tasks.transports.mavlink_protocol.streams import Built, Stream
from tasks.transports.mavlink_protocol.system import MavlinkSystem

if TYPE_CHECKING:
    from tasks.transports.mavlink_protocol.cameras import Camera

Build = Callable[["Camera", MavlinkSystem, float], Built]


def _heartbeat(camera: "Camera", system: MavlinkSystem, now: float) -> Fields:
    return cameras_from_imc.heartbeat(camera.status)


def _information(camera: "Camera", system: MavlinkSystem, now: float) -> Fields:
    time = from_imc.boot_ms(now, system.boot)
    described = f"mftp://[;comp=1]/{camera.definition_file}", version_of(camera.definition)
    return cameras_from_imc.information(camera.label, camera.resolution, camera.flags, described, time)


def _settings(camera: "Camera", system: MavlinkSystem, now: float) -> Fields:
    return cameras_from_imc.settings(from_imc.boot_ms(now, system.boot))


def _storage(camera: "Camera", system: MavlinkSystem, now: float) -> Fields:
    return cameras_from_imc.storage(*camera.disk, from_imc.boot_ms(now, system.boot))


def _capture_status(camera: "Camera", system: MavlinkSystem, now: float) -> Fields:
    time, free = from_imc.boot_ms(now, system.boot), camera.disk[2]
    return cameras_from_imc.capture_status(camera.image_status, camera.image_interval, camera.taken, free, time)


def _captured(camera: "Camera", system: MavlinkSystem, now: float) -> Fields | None:
    return camera.captured(camera.taken - 1, system.boot)


def _video(camera: "Camera", system: MavlinkSystem, now: float) -> Fields | None:
    return camera.video_fields() if camera.video else None


def _geo_status(camera: "Camera", system: MavlinkSystem, now: float) -> Fields | None:
    found = camera.tracked(now)
    return cameras_from_imc.geo_status(found) if found is not None else None


def _markers(camera: "Camera", system: MavlinkSystem, now: float) -> Sequence[Fields]:
    return [cameras_from_imc.marker(found, f"MUG {found.number}", system.system, now) for found in camera.marked(now)]


PICTURES: Sequence[tuple[str, float, str, Build]] = (
    ("CAMERA_SETTINGS", 0.0, "there are pictures only", _settings),
    ("STORAGE_INFORMATION", 0.0, "the disk of the logs", _storage),
    ("CAMERA_CAPTURE_STATUS", 0.0, "what was asked for, `Save Images`", _capture_status),
    ("CAMERA_IMAGE_CAPTURED", 0.0, "Event `Picture`", _captured),
)
DETECTIONS: Sequence[tuple[str, float, str, Build]] = (
    ("CAMERA_TRACKING_GEO_STATUS", 2.0, "EstimatedMugState, for 2 s", _geo_status),
    ("ADSB_VEHICLE", 1.0, "EstimatedMugState, for 60 s, with `Detection Markers`", _markers),
)
VIDEO: Sequence[tuple[str, float, str, Build]] = (
    ("VIDEO_STREAM_INFORMATION", 0.0, "`Video Streams`", _video),
    ("VIDEO_STREAM_STATUS", 0.0, "`Video Streams`", _video),
)
EACH: Sequence[tuple[str, float, str, Build]] = (
    ("HEARTBEAT", 1.0, "state of the entity", _heartbeat),
    ("CAMERA_INFORMATION", 0.0, "parameters of the task", _information),
)
ALL = (*EACH, *PICTURES, *DETECTIONS, *VIDEO)


def camera_streams(camera: "Camera") -> Mapping[str, Stream]:
    """What a camera says, by name of the message."""

    def stream(name: str, rate: float, sources: str, build: Build) -> Stream:
        def made(system: MavlinkSystem, flavour: Flavor, now: float) -> Built:
            return build(camera, system, now)

        return Stream(name, rate, 0, sources, made)

    can = [*EACH, *PICTURES, *(DETECTIONS if camera.detects else ()), *(VIDEO if camera.video else ())]
    return {name: stream(name, rate, sources, build) for name, rate, sources, build in can}
