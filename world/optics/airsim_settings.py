"""The cameras of AirSim's settings.json."""

import math
from collections.abc import Mapping
from typing import Any, NamedTuple

from support.foreign_json import load_json
from world.optics.brown_conrady import PinholeModel
from world.optics.camera_model import CalibrationError

SCENE = 0  # ImageType of the pictures; -1 is the viewer's
LARGEST = 1 << 16  # px of a side
DEFAULTS: Mapping[str, float] = {"Width": 256.0, "Height": 144.0, "FOV_Degrees": 90.0}  # AirSim's

Values = Mapping[str, Any]


class AirSimCamera(NamedTuple):
    """Size (px), and the field of view (rad) of the longer side, as Unreal has it."""

    width: int
    height: int
    fov: float

    @property
    def model(self) -> PinholeModel:
        f = 0.5 * max(self.width, self.height) / math.tan(0.5 * self.fov)
        return PinholeModel(self.width, self.height, f, f, 0.5 * self.width, 0.5 * self.height)


def parse_airsim_settings(text: str, vehicle: str = "") -> dict[str, AirSimCamera]:
    """The cameras of a settings.json by name, as `airsim_cameras`. Raises CalibrationError."""
    try:
        values = load_json(text)
    except ValueError as error:
        raise CalibrationError(f"no JSON: {error}") from None
    return airsim_cameras(_mapping(values, "the file"), vehicle)


def is_airsim_settings(values: Values) -> bool:
    return "SettingsVersion" in values or "CameraDefaults" in values


def airsim_cameras(settings: Values, vehicle: str = "") -> dict[str, AirSimCamera]:
    """The cameras that take pictures (`ImageType` 0), by name: of one vehicle, or of all and outside of them.

    What a camera leaves out is that of `CameraDefaults`, then AirSim's own. A name that several vehicles have is the
    first one's. Raises CalibrationError with the camera and the field.
    """
    base = _capture(_mapping(settings.get("CameraDefaults", {}), "CameraDefaults"), DEFAULTS, "CameraDefaults")
    vehicles = _mapping(settings.get("Vehicles", {}), "Vehicles")
    groups = [
        _mapping(_mapping(each, str(name)).get("Cameras", {}), f"Cameras of {name}")
        for name, each in vehicles.items()
        if vehicle in ("", name)
    ]
    groups.append(_mapping(settings.get("ExternalCameras", {}), "ExternalCameras"))
    found: dict[str, AirSimCamera] = {}
    for group in groups:
        for name, camera in group.items():
            numbers = _capture(_mapping(camera, str(name)), base, str(name))
            found.setdefault(
                str(name),
                AirSimCamera(int(numbers["Width"]), int(numbers["Height"]), math.radians(numbers["FOV_Degrees"])),
            )
    return found


def _capture(camera: Values, base: Mapping[str, float], name: str) -> dict[str, float]:
    listed = camera.get("CaptureSettings", [])
    if not isinstance(listed, list):
        raise CalibrationError(f"{name}: CaptureSettings is no list")
    found = dict(base)
    for each in listed:  # pyright: ignore[reportUnknownVariableType]
        setting = _mapping(each, f"{name}: CaptureSettings")
        if setting.get("ImageType", SCENE) == SCENE:
            found |= {field: _number(setting, field, name) for field in DEFAULTS if field in setting}
    for field in ("Width", "Height"):
        if not (1 <= found[field] <= LARGEST and found[field] == int(found[field])):
            raise CalibrationError(f"{name}: {field} is {found[field]:g}, not a number of pixels")
    if not 0.0 < found["FOV_Degrees"] < 180.0:
        raise CalibrationError(f"{name}: FOV_Degrees is {found['FOV_Degrees']:g}, not within 0 to 180")
    return found


def _number(setting: Values, field: str, name: str) -> float:
    value = setting[field]
    if isinstance(value, bool) or not isinstance(value, int | float) or not math.isfinite(value):
        raise CalibrationError(f"{name}: {field} is no number: {value!r}")
    return float(value)


def _mapping(value: Any, what: str) -> Values:
    if not isinstance(value, dict):
        raise CalibrationError(f"{what} has no named values")
    return value  # pyright: ignore[reportUnknownVariableType]
