"""The messages that a camera streams or sends on request."""

from collections.abc import Callable, Mapping, Sequence

from mavlink import Dialect, Fields, Flavor
from mavlink.translate import cameras_from_imc, from_imc
from mavlink.vehicle.camera.component import CameraComponent
from mavlink.vehicle.camera.definition import version_of

Built = Fields | Sequence[Fields] | None
Build = Callable[[CameraComponent, float], Built]


def _heartbeat(camera: CameraComponent, now: float) -> Fields:
    return cameras_from_imc.heartbeat(camera.mav_state)


def _information(camera: CameraComponent, now: float) -> Fields:
    time = from_imc.boot_ms(now, camera.model.boot)
    described = f"mftp://[;comp=1]/{camera.definition_file_name}", version_of(camera.definition)
    return cameras_from_imc.information(camera.label, camera.resolution, camera.flags, described, time)


def _settings(camera: CameraComponent, now: float) -> Fields:
    return cameras_from_imc.settings(from_imc.boot_ms(now, camera.model.boot))


def _storage(camera: CameraComponent, now: float) -> Fields:
    return cameras_from_imc.storage(*camera.pictures.usage(), from_imc.boot_ms(now, camera.model.boot))


def _capture_status(camera: CameraComponent, now: float) -> Fields:
    time, free = from_imc.boot_ms(now, camera.model.boot), camera.pictures.usage()[2]
    return cameras_from_imc.capture_status(camera.image_status, camera.image_interval, camera.taken, free, time)


def _captured(camera: CameraComponent, now: float) -> Fields | None:
    return camera.image_captured(camera.taken - 1)


def _video(camera: CameraComponent, now: float) -> Fields | None:
    return camera.video_fields() if camera.video else None


def _geo_status(camera: CameraComponent, now: float) -> Fields | None:
    found = camera.latest_detection(now)
    return cameras_from_imc.tracking_geo_status(found) if found is not None else None


def _markers(camera: CameraComponent, now: float) -> Sequence[Fields]:
    return [
        cameras_from_imc.adsb_marker(found, f"MUG {found.number}", camera.model.system, now)
        for found in camera.map_markers(now)
    ]


PICTURES: Sequence[tuple[str, float, str, Build]] = (
    ("CAMERA_SETTINGS", 0.0, "there are pictures only", _settings),
    ("STORAGE_INFORMATION", 0.0, "the disk of the logs", _storage),
    ("CAMERA_CAPTURE_STATUS", 0.0, "captures in progress, `Save Images`", _capture_status),
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


class CameraTelemetry:
    """The messages of a camera, for sessions."""

    latest_notices: Sequence[tuple[int, str]] = ()

    def __init__(self, dialect: Dialect, camera: CameraComponent) -> None:
        self.dialect = dialect
        self.system: int = camera.model.system
        self.component: int = camera.component
        self.camera = camera
        can = [*EACH, *PICTURES, *(DETECTIONS if camera.detects else ()), *(VIDEO if camera.video else ())]
        self._rates = {name: rate for name, rate, _, _ in can}
        self._builds = {name: build for name, _, _, build in can}

    def rates(self, low: bool) -> Mapping[str, float]:
        return self._rates

    def offers(self, name: str) -> bool:
        return name in self._builds

    def fields(self, name: str, flavor: Flavor, now: float, number: int = 0) -> Sequence[Fields]:
        built = self._builds[name](self.camera, now)
        return () if built is None else (built,) if isinstance(built, Mapping) else built
