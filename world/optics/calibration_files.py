"""Reads calibrations as other programs write them: Kalibr, OpenCV, ROS, EuRoC, WoodScape, DepthAI, mrcal and others."""

import json
import math
import re
from collections.abc import Callable, Mapping, Sequence
from pathlib import Path
from typing import Any

import numpy as np

from support.foreign_json import load_json
from world.optics.airsim_settings import AirSimCamera, airsim_cameras, is_airsim_settings
from world.optics.arctangent_lens import ArctangentModel
from world.optics.brown_conrady import PinholeModel
from world.optics.camera_model import CalibrationError, CameraModel
from world.optics.depthai_calibration import OLDER_NAMES, depthai_cameras, depthai_terms, is_depthai_calibration
from world.optics.double_sphere import DoubleSphereModel
from world.optics.fisheye import FisheyeModel, kannala_brandt_lens
from world.optics.mrcal_models import LARGEST_FILE as LARGEST_CAMERAMODEL
from world.optics.mrcal_models import is_cameramodel, parse_cameramodel
from world.optics.polynomial_lens import Lens
from world.optics.rational_lens import RationalModel
from world.optics.slam_configurations import kalibr_terms
from world.optics.unit_sphere import ExtendedUnifiedModel, OmnidirectionalModel

LARGEST_FILE = 1 << 20
MOST_PIXELS = 1 << 20  # of a side
OPENCV = re.compile(r"^%YAML:1\.0|!!opencv-matrix", re.MULTILINE)
RADTAN = ("radtan", "radial-tangential", "plumb_bob", "rational_polynomial", "pinhole", "")
EQUIDISTANT = ("equidistant", "fisheye", "kannala_brandt", "kannalabrandt")
COUNTS = (0, 4, 5, 8, 12, 14)  # of the coefficients that OpenCV has; those from the sixth on are the rational model's
MATRICES = ("camera_matrix", "Camera_Matrix", "K", "intrinsicMatrix")
DISTORTIONS = ("distortion_coefficients", "Distortion_Coefficients", "D", "distortionCoeff")
OMNIDIRECTIONAL = ("omni", "omnidir")
KEY = re.compile(r"""(\s*)["']?([^"':]*[^"':\s])["']?\s*:""")  # of a line of YAML or JSON
STEPS = 4000  # of the angle, to find where a lens ends

CAMERA_FIELDS = {"intrinsic", "intrinsics", "airsim", "depthai", "camera_matrix", "Camera_Matrix", "K", "image_width"}
FORMATS = (
    "camchain of Kalibr, cameras.yaml of a log, FileStorage of OpenCV, camera_info of ROS, sensor.yaml of EuRoC, "
    "JSON of WoodScape, configurations of VINS-Fusion (camodocal) and ORB-SLAM3, calibration JSON of DepthAI (OAK-D), "
    ".cameramodel of mrcal, settings.json of AirSim"
)

Values = Mapping[str, Any]
Plane = tuple[float, float, float, float]
"""Focal lengths and principal point, px."""


class CalibrationFieldError(CalibrationError):
    """A field of a calibration is missing, or wrong."""

    def __init__(self, field: str, why: str):
        super().__init__(f"{field} {why}")
        self.field = field


def read_calibration(path: str | Path, camera: str = "") -> CameraModel:
    """The camera of a calibration file; `camera` names one of several, by default the first.

    Read are a camchain of Kalibr, the cameras.yaml of a log, a FileStorage (YAML) of OpenCV, a camera_info of ROS, a
    sensor.yaml of EuRoC, the JSON of WoodScape, the configurations of VINS-Fusion and ORB-SLAM3 (`camera` is Camera1 or
    Camera2), DepthAI's calibration (`camera` is CAM_A to CAM_H, or rgb, left, right), a .cameramodel of mrcal, and
    AirSim's settings.json. YAML needs PyYAML. Fisheye lenses end at the corner of the picture, or before they fold.
    Raises CalibrationError with the file, the line, and the field that it lacks or contradicts, OSError,
    ModuleNotFoundError.
    """
    return _read(Path(path), camera)[1]


def calibration_file_to_json(path: str | Path, camera: str = "") -> str:
    """Convert the camera of a calibration file to JSON for `parse_calibration`. Raises like `read_calibration`."""
    return json.dumps(_read(Path(path), camera)[0], default=str)


def parse_calibration(text: str) -> CameraModel:
    """The camera of a text of `calibration_file_to_json`. Raises CalibrationError."""
    try:
        return _model(_mapping(load_json(text), "the text"))
    except ValueError as error:
        raise CalibrationError(str(error)) from None


def _read(path: Path, camera: str) -> tuple[Values, CameraModel]:
    """Read the entry of a camera in a file, and its model."""
    with path.open("rb") as file:
        limit = LARGEST_CAMERAMODEL if path.suffix.lower() == ".cameramodel" else LARGEST_FILE
        data = file.read(limit + 1)
    text, name = data.decode("utf-8", "replace"), ""
    try:
        if len(data) > limit:
            raise CalibrationError("too large for a calibration")
        values = _parsed(text, path.suffix.lower())
        cameras = {str(name): each for name, each in values.items() if _is_camera(name, each)}
        if is_airsim_settings(values):
            cameras = {name: {"airsim": each} for name, each in airsim_cameras(values).items()}
            if not cameras:
                raise CalibrationError("no cameras in Vehicles or ExternalCameras")
        elif is_depthai_calibration(values):
            cameras = {name: {"depthai": each} for name, each in depthai_cameras(values).items()}
            camera = OLDER_NAMES.get(camera.lower(), camera)
        if cameras:
            if camera and camera not in cameras:
                raise CalibrationError(f"no camera {camera}; there are {', '.join(cameras)}")
            name = camera or next(iter(cameras))
            values = _mapping(cameras[name], name)
        elif (terms := kalibr_terms(values, camera)) is not None:
            values = terms
        elif not CAMERA_FIELDS & values.keys():
            raise CalibrationError(f"camera_matrix is missing: no camera of a known format; read are {FORMATS}")
        return values, _model(values)
    except ValueError as error:  # also of a lens
        line = _line(text, name, error.field if isinstance(error, CalibrationFieldError) else "")
        raise CalibrationError(f"{path}{f':{line}' if line else ''}: {error}") from None


def _line(text: str, camera: str, field: str) -> int:
    """The line of a field of a camera; without such a field that of the camera, and 0 if that has none."""
    found, depth = 0, -1
    for number, line in enumerate(text.splitlines(), start=1):
        if (key := KEY.match(line)) is None:
            continue
        if found and len(key[1]) <= depth:
            break
        if key[2] == field and (found or not camera):
            return number
        if camera and key[2] == camera:
            found, depth = number, len(key[1])
    return found


def _model(values: Values) -> CameraModel:
    if "airsim" in values:
        width, height, fov = _numbers(values, "airsim", 3)
        return AirSimCamera(int(width), int(height), fov).model
    if "depthai" in values:
        return _opencv(depthai_terms(_mapping(values["depthai"], "cameraData")))
    if "intrinsic" in values:
        return _woodscape(_mapping(values["intrinsic"], "intrinsic"))
    return _kalibr(values) if "intrinsics" in values or "not_in_kalibr" in values else _opencv(values)


def _parsed(text: str, suffix: str) -> Values:
    if suffix == ".cameramodel" or (suffix != ".json" and is_cameramodel(text)):
        return parse_cameramodel(text)
    if suffix == ".json":
        try:
            return _mapping(load_json(text), "the file")
        except ValueError as error:
            raise CalibrationError(f"no JSON: {error}") from None
    import yaml  # slow to import, and most runs read none

    from support.foreign_yaml import load_yaml

    try:
        return _mapping(load_yaml(OPENCV.sub("", text)), "the file")
    except (yaml.YAMLError, RecursionError) as error:
        raise CalibrationError(f"no YAML: {' '.join(str(error).split())}") from None


def _is_camera(name: object, value: object) -> bool:
    if re.fullmatch(r"cam\d+", str(name)):
        return True
    return isinstance(value, dict) and ("intrinsics" in value or {"not_in_kalibr", "opencv"} <= value.keys())  # pyright: ignore[reportUnknownMemberType]


def _mapping(value: Any, what: str) -> Values:
    if not isinstance(value, dict):
        raise CalibrationError(f"{what} has no named values")
    return value  # pyright: ignore[reportUnknownVariableType]


def _numbers(values: Values, name: str, *sizes: int) -> list[float]:
    """A list of numbers, also the `data` of a matrix."""
    if name not in values:
        raise CalibrationFieldError(name, "is missing")
    matrix: Values = values[name] if isinstance(values[name], dict) else {"data": values[name]}
    data = matrix.get("data")
    try:
        numbers = np.array(data, np.float64).ravel().tolist() if data is not None else None
    except (TypeError, ValueError, OverflowError):
        numbers = None
    if numbers is None:
        raise CalibrationFieldError(name, f"is no list of numbers: {data!r}")
    rows, columns = matrix.get("rows"), matrix.get("cols")
    if isinstance(rows, int) and isinstance(columns, int) and rows * columns != len(numbers):
        raise CalibrationFieldError(name, f"has {len(numbers)} numbers in {rows} rows and {columns} columns")
    if sizes and len(numbers) not in sizes:
        raise CalibrationFieldError(name, f"has {len(numbers)} numbers, not {' or '.join(map(str, sizes))}")
    return numbers


def _whole(values: Values, name: str) -> int:
    return _pixels(name, _numbers(values, name, 1)[0])


def _pixels(name: str, number: float) -> int:
    if not (0 < number < MOST_PIXELS and number == int(number)):
        raise CalibrationFieldError(name, f"is {number:g}, not a number of pixels")
    return int(number)


def _kalibr(values: Values) -> CameraModel:
    """A camera of a camchain, or the sensor.yaml of EuRoC."""
    width, height = (_pixels("resolution", number) for number in _numbers(values, "resolution", 2))
    kind = str(values.get("camera_model", "pinhole")).lower()
    if kind in ("ds", "double_sphere"):
        xi, alpha, *plane = _numbers(values, "intrinsics", 6)
        return DoubleSphereModel(width, height, *_half_on(plane), xi, alpha)
    if kind == "eucm":
        alpha, beta, *plane = _numbers(values, "intrinsics", 6)
        return ExtendedUnifiedModel(width, height, *_half_on(plane), alpha, beta)
    if kind not in ("pinhole", *OMNIDIRECTIONAL):
        raise CalibrationFieldError("camera_model", f"{kind} is not supported; pinhole, omni, eucm and ds are")
    is_fitted = "fit_rms_px" in values and "quartic" not in values
    if (is_fitted or "not_in_kalibr" in values) and isinstance(values.get("opencv"), dict):
        return _opencv({"image_width": width, "image_height": height, **_mapping(values["opencv"], "opencv")})
    if kind in OMNIDIRECTIONAL:
        return _omnidirectional(values, (width, height))
    plane = _half_on(_numbers(values, "intrinsics", 4))
    if "quartic" in values:
        return _quartic(_mapping(values["quartic"], "quartic"), (width, height), plane[2:])
    name, model = _kalibr_distortion(values)
    return _distorted(values, model, (width, height), plane, name) if model else PinholeModel(width, height, *plane)


def _kalibr_distortion(values: Values) -> tuple[str, str]:
    """The field of the coefficients, and the model; no model if the camera has none."""
    name = "distortion_coeffs" if "distortion_coeffs" in values else "distortion_coefficients"
    model = str(values.get("distortion_model", "none")).lower()
    if model != "none":
        return name, model
    if name in values and any(_numbers(values, name)):
        raise CalibrationFieldError(name, "are given without a distortion_model")
    return name, ""


def _omnidirectional(values: Values, size: tuple[int, int]) -> CameraModel:
    """Kalibr's omni."""
    xi, *plane = _numbers(values, "intrinsics", 5)
    name, model = _kalibr_distortion(values)
    if model and model not in RADTAN:
        raise CalibrationFieldError("distortion_model", f"{model} of an omni camera is not supported; radtan is")
    return OmnidirectionalModel(*size, *_half_on(plane), xi, *(_numbers(values, name, 4) if model else ()))


def _quartic(values: Values, size: tuple[int, int], center: Sequence[float]) -> CameraModel:
    """The lens in a log's cameras.yaml to which the others there are fitted."""
    k1, k2, k3, k4 = _numbers(values, "k", 4)
    fx, fy = _numbers(values, "focal_lengths", 2)
    return FisheyeModel(*size, fx, fy, center[0], center[1], Lens((k1, k2, k3, k4), _numbers(values, "fov", 1)[0]))


def _opencv(values: Values) -> CameraModel:
    """A FileStorage of OpenCV, or a camera_info of ROS."""
    names = [name for name in MATRICES if name in values]
    k = _numbers(values, names[0] if names else "camera_matrix", 9)
    if k[1] or k[3] or k[6:] != [0.0, 0.0, 1.0]:
        raise CalibrationFieldError(names[0], "is not [[fx, 0, cx], [0, fy, cy], [0, 0, 1]]")
    size = _whole(values, "image_width"), _whole(values, "image_height")
    names = [name for name in DISTORTIONS if name in values]
    model = str(values.get("distortion_model", values.get("model", ""))).lower()
    if values.get("fisheye_model") and not model:  # 1 or true, of OpenCV's program camera_calibration
        model = EQUIDISTANT[0]
    plane = _half_on([k[0], k[4], k[2], k[5]])
    name = names[0] if names else DISTORTIONS[0]
    if "xi" in values or model in OMNIDIRECTIONAL:
        xi = _numbers(values, "xi", 1)[0]
        return OmnidirectionalModel(*size, *plane, xi, *(_numbers(values, name, 4) if names else ()))
    return _distorted(values, model, size, plane, name) if names or model else PinholeModel(*size, *plane)


def _woodscape(values: Values) -> CameraModel:
    """Pixels per rad and its powers; the center is given from the middle of the picture."""
    if values.get("model", "radial_poly") != "radial_poly":
        raise CalibrationFieldError("model", f"{values['model']} is not supported; radial_poly is")
    width, height = _whole(values, "width"), _whole(values, "height")
    k1, k2, k3, k4 = (_numbers(values, f"k{power}", 1)[0] for power in (1, 2, 3, 4))
    aspect = _numbers(values, "aspect_ratio", 1)[0] if "aspect_ratio" in values else 1.0
    cx = 0.5 * width + _numbers(values, "cx_offset", 1)[0]
    cy = 0.5 * height + _numbers(values, "cy_offset", 1)[0]
    if not k1 > 0.0:
        raise CalibrationFieldError("k1", f"is {k1:g}: the picture of a lens grows from its axis")
    k = (1.0, k2 / k1, k3 / k1, k4 / k1)
    return _fisheye((width, height), (k1, k1 * aspect, cx, cy), lambda fov: Lens(k, fov), k)


def _distorted(values: Values, model: str, size: tuple[int, int], plane: Plane, name: str) -> CameraModel:
    """`name` is the field of the coefficients."""
    if model in EQUIDISTANT:
        k1, k2, k3, k4 = _numbers(values, name, 4)
        terms = (1.0, 0.0, k1, 0.0, k2, 0.0, k3, 0.0, k4)
        return _fisheye(size, plane, lambda fov: kannala_brandt_lens((k1, k2, k3, k4), fov), terms)
    if model == "fov":
        w = _numbers(values, name, 1)[0]
        return ArctangentModel(*size, *plane, w) if w else PinholeModel(*size, *plane)
    if model not in RADTAN:
        known = "radtan, equidistant, fov and rational_polynomial are"
        raise CalibrationFieldError("distortion_model", f"{model} is not supported; {known}")
    coefficients = _numbers(values, name, *COUNTS)
    if any(coefficients[5:]):
        return RationalModel(*size, *plane, *coefficients)
    k1, k2, p1, p2, k3 = [*coefficients[:5], *[0.0] * 5][:5]
    return PinholeModel(*size, *plane, k1, k2, p1, p2, k3)


def _half_on(plane: Sequence[float]) -> Plane:
    """Convert from the convention in which the first pixel has its center at 0, 0."""
    fx, fy, cx, cy = plane
    return fx, fy, cx + 0.5, cy + 0.5


def _fisheye(size: tuple[int, int], plane: Plane, lens: Callable[[float], Lens], k: Sequence[float]) -> FisheyeModel:
    """A fisheye model with a field of view to the farthest corner, or to just before the lens folds."""
    fx, fy, cx, cy = plane
    if not (fx > 0.0 and fy > 0.0 and all(map(math.isfinite, [*plane, *k]))):
        raise CalibrationError(f"no camera has focal lengths of {fx:g} and {fy:g} px and the lens {list(k)}")
    corners = [math.hypot((u - cx) / fx, (v - cy) / fy) for u in (0, size[0]) for v in (0, size[1])]
    phi = np.linspace(0.0, math.pi, STEPS)
    radius = np.polynomial.polynomial.polyval(phi, [0.0, *k])
    ends = np.flatnonzero((np.diff(radius) <= 0.0) | (radius[:-1] >= max(corners)))
    edge = float(phi[max(int(ends[0]) - 1, 1)]) if len(ends) and radius[ends[0]] < max(corners) else None
    if edge is None:
        edge = float(phi[int(ends[0])]) if len(ends) else math.pi
    return FisheyeModel(*size, fx, fy, cx, cy, lens(2.0 * edge))
