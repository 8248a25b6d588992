"""The cameras of a log as Kalibr, VINS-Fusion and OpenVINS describe them, from the folder Photos."""

import math
import re
from collections.abc import Callable, Mapping, Sequence
from contextlib import suppress
from itertools import pairwise
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np
import yaml

from runtime.logs import Array
from shoal.logs.export.message_batches import LogSource
from support.regular_files import read_regular_file
from world.optics import CalibrationError, CameraModel, read_calibration
from world.sensors import ImuPart

FILE = "cameras.yaml"
OPTICS = ("width", "height", "fx", "fy", "cx", "cy")  # px; the lens in CameraFrame
UNLIKE = "pictures of {} were taken with another lens or size than in cameras.yaml"
GRAVITY = 9.80665  # m/s²
SHUTTER = ("readout_time", "line_delay", "time_of", "first_row")  # of cameras.yaml, if a shutter rolls
OPENVINS = ("pinhole", "radtan"), ("pinhole", "equidistant")  # the lenses that it has; it takes any other for radtan
MODELS = {"radtan": "radial-tangential", "equidistant": "equidistant"}  # EuRoC's names by Kalibr's


class LoggedCamera(NamedTuple):
    """A camera: its model in Kalibr's terms, without its place; the pose (4, 4) of its optical frame in the body."""

    model: Mapping[str, Any]
    pose: Array
    label: str = ""


class LoggedImu(NamedTuple):
    """An IMU: its noise, and its 4x4 pose in the body."""

    part: ImuPart
    pose: Array


def read_photo_cameras(photos: Path, report: Callable[[str], object] = lambda _: None) -> dict[str, LoggedCamera]:
    """The cameras of a folder of pictures, by the name that their files begin with; those that can be used.

    `report` gets what is not used, and why; a folder without cameras.yaml has none.
    """
    path = photos / FILE
    try:
        content: Any = yaml.safe_load(read_regular_file(path).decode())
    except (FileNotFoundError, NotADirectoryError):
        return {}
    except (OSError, ValueError, yaml.YAMLError) as error:
        why = error.strerror if isinstance(error, OSError) else " ".join(str(error).split())
        report(f"no calibration of the cameras: {path} cannot be read: {why}")
        return {}
    if not isinstance(content, dict):
        report(f"no calibration of the cameras: {path} has no cameras by name")
        return {}
    found: dict[str, LoggedCamera] = {}
    for label, camera in content.items():  # pyright: ignore[reportUnknownVariableType, reportUnknownMemberType]
        try:
            pose = np.array(camera["T_BS"], float).reshape(4, 4)  # pyright: ignore[reportUnknownArgumentType]
            model = {str(name): value for name, value in camera.items() if name != "T_BS"}  # pyright: ignore[reportUnknownVariableType, reportUnknownMemberType, reportUnknownArgumentType]
        except (AttributeError, KeyError, TypeError, ValueError):
            report(f"no calibration of {label}: its entry in {path} has no T_BS of 16 numbers")
            continue
        found[re.sub(r"[^A-Za-z0-9]+", "_", str(label))] = LoggedCamera(model, pose, str(label))  # pyright: ignore[reportUnknownArgumentType]
    return found


def load_camera_models(photos: Path, cameras: Mapping[str, LoggedCamera]) -> dict[str, CameraModel]:
    """The models of these cameras of a folder of pictures; those that can be used."""
    found: dict[str, CameraModel] = {}
    for name, camera in cameras.items():
        with suppress(CalibrationError, OSError):
            found[name] = read_calibration(photos / FILE, camera.label)
    return found


def matches_optics(optics: CameraModel, logged: Sequence[float]) -> bool:
    """Whether a camera has the numbers of OPTICS that a CameraFrame contains."""
    own = [getattr(optics, name) for name in OPTICS]
    return all(math.isclose(a, b, rel_tol=1e-5, abs_tol=1e-3) for a, b in zip(logged, own, strict=True))


def photos_of_other_lenses(source: LogSource, models: Mapping[str, CameraModel]) -> frozenset[str]:
    """The files of pictures that, by their CameraFrame, another lens took than these cameras have.

    The parameters of a camera may change while a log is written; cameras.yaml has the last ones.
    """
    found = set[str]()
    frames = source.log.messages("CameraFrame") if "CameraFrame" in source.summary.by_type else ()
    for frame in frames:
        name = Path(str(getattr(frame, "file", ""))).name
        logged = [float(getattr(frame, field, math.nan)) for field in OPTICS]
        optics = models.get(name.rsplit("_", 2)[0])
        if optics is not None and all(map(math.isfinite, logged)) and not matches_optics(optics, logged):
            found.add(name)
    return frozenset(found)


def has_intrinsics(camera: LoggedCamera | None) -> bool:
    """Whether Kalibr has the model of a camera."""
    return camera is not None and "intrinsics" in camera.model


def _extras(camera: LoggedCamera) -> dict[str, Any]:
    """Values that readers ignore: the error of a fitted lens (px), and the readout time of a rolling shutter (s)."""
    return {name: camera.model[name] for name in ("fit_rms_px", *SHUTTER) if name in camera.model}


def euroc_sensor(camera: LoggedCamera) -> dict[str, Any]:
    """Entry of a camera in EuRoC's sensor.yaml; without a model if Kalibr lacks it."""
    model = camera.model
    found: dict[str, Any] = {"T_BS": euroc_matrix(camera.pose)}
    if "intrinsics" not in model:
        return {**found, "no_intrinsics": model.get("not_in_kalibr", ""), **_extras(camera)}
    return {
        **found,
        "resolution": model["resolution"],
        "camera_model": model["camera_model"],
        "intrinsics": model["intrinsics"],
        "distortion_model": MODELS.get(model["distortion_model"], model["distortion_model"]),
        "distortion_coefficients": model["distortion_coeffs"],
        **_extras(camera),
    }


def euroc_matrix(pose: Array) -> dict[str, Any]:
    """A matrix as EuRoC writes it."""
    return {"rows": 4, "cols": 4, "data": pose.ravel().tolist()}


def write_calibration(folder: Path, cameras: Sequence[LoggedCamera], unit: LoggedImu | None, rate: float) -> None:
    """Write camchain.yaml, and with an IMU of a known noise and a `rate` (Hz) vins/ and openvins/. Raises OSError.

    Only what the models of the cameras allow is written: Kalibr's for camchain and OpenVINS, VINS-Fusion's for vins/.
    A simulated IMU measures the mean over the interval that ends at its stamp: it is half an interval late.
    """
    known = [camera for camera in cameras if has_intrinsics(camera)]
    if not known:
        return
    late = 0.5 / rate if rate > 0.0 else 0.0
    numbered = dict(enumerate(known))
    chain = _chain(numbered, None if unit is None else unit.pose, late)
    folder.mkdir(parents=True, exist_ok=True)
    _write(folder / "camchain.yaml", chain)
    if unit is None:
        return
    if lenses := {number: camera for number, camera in numbered.items() if _lens(camera) in OPENVINS}:
        _write_openvins(folder / "openvins", _chain(lenses, unit.pose, late), unit, rate)
    # VINS-Fusion takes one camera, or two of one size, and refuses any other number.
    usable = [(number, camera) for number, camera in numbered.items() if _camodocal(camera)]
    alike = [pair for pair in pairwise(usable) if pair[0][1].model["resolution"] == pair[1][1].model["resolution"]]
    if usable:
        _write_vins(folder / "vins", dict(alike[0] if alike else usable[:1]), unit, late, len(known))


def _lens(camera: LoggedCamera) -> tuple[str, str]:
    return camera.model["camera_model"], camera.model["distortion_model"]


def _chain(cameras: Mapping[int, LoggedCamera], imu: Array | None, late: float) -> dict[str, Any]:
    """Camchain of cameras by their number in the data set."""
    chain: dict[str, Any] = {}
    before: LoggedCamera | None = None
    for place, (number, camera) in enumerate(cameras.items()):
        model = {name: camera.model[name] for name in ("camera_model", "intrinsics", "distortion_model")}
        entry: dict[str, Any] = {
            **model,
            "distortion_coeffs": camera.model["distortion_coeffs"],
            "resolution": camera.model["resolution"],
            "rostopic": f"/cam{number}/image_raw",
            "cam_overlaps": [other for other in range(len(cameras)) if other != place],
            **_extras(camera),
        }
        if imu is not None:
            entry |= {"T_cam_imu": (np.linalg.inv(camera.pose) @ imu).tolist(), "timeshift_cam_imu": late}
        if before is not None:
            entry["T_cn_cnm1"] = (np.linalg.inv(camera.pose) @ before.pose).tolist()
        chain[f"cam{place}"] = entry
        before = camera
    return chain


def _write_openvins(folder: Path, chain: dict[str, Any], unit: LoggedImu, rate: float) -> None:
    folder.mkdir(exist_ok=True)
    imu: dict[str, Any] = {
        "T_i_b": np.eye(4).tolist(),
        **noise_densities(unit.part),
        **{name: np.eye(3).tolist() for name in ("Tw", "R_IMUtoGYRO", "Ta", "R_IMUtoACC")},
        "Tg": np.zeros((3, 3)).tolist(),
        "model": "calibrated",
        "rostopic": "/imu0",
        "time_offset": 0.0,
        "update_rate": rate,
    }
    estimator = {
        "use_stereo": len(chain) > 1,
        "max_cameras": len(chain),
        "calib_cam_extrinsics": False,
        "calib_cam_intrinsics": False,
        "calib_cam_timeoffset": False,
        "gravity_mag": GRAVITY,
        "relative_config_imu": "kalibr_imu_chain.yaml",
        "relative_config_imucam": "kalibr_imucam_chain.yaml",
    }
    for name, content in (
        ("kalibr_imu_chain", {"imu0": imu}),
        ("kalibr_imucam_chain", chain),
        ("estimator_config", estimator),
    ):
        _write(folder / f"{name}.yaml", content, "%YAML:1.0\n\n")


def _write_vins(folder: Path, cameras: Mapping[int, LoggedCamera], unit: LoggedImu, late: float, count: int) -> None:
    """VINS-Fusion's configuration, in which body is the IMU, whose samples are `late` (s), of one or two of `count`
    cameras, by their number in the data set.
    """
    folder.mkdir(exist_ok=True)
    width, height = next(iter(cameras.values())).model["resolution"]
    noise = noise_densities(unit.part)
    lines = ["%YAML:1.0", ""]
    if count > len(cameras):
        lines.append(f"# {len(cameras)} of {count} cameras: VINS-Fusion takes one, or two of one size")
    if rolling := [str(number) for number, camera in cameras.items() if SHUTTER[0] in camera.model]:
        lines.append(f"# The shutter of camera {', '.join(rolling)} rolls; times are those of the middle row")
    lines += ["imu: 1", f"num_of_cam: {len(cameras)}", 'imu_topic: "/imu0"']
    for place, number in enumerate(cameras):
        lines += [f'image{place}_topic: "/cam{number}/image_raw"', f'cam{place}_calib: "cam{number}.yaml"']
    lines += [f"image_width: {width}", f"image_height: {height}", "estimate_extrinsic: 0"]
    for place, camera in enumerate(cameras.values()):
        pose = (np.linalg.inv(unit.pose) @ camera.pose).ravel().tolist()
        data = ", ".join(map(repr, pose))
        lines += [f"body_T_cam{place}: !!opencv-matrix", "   rows: 4", "   cols: 4", "   dt: d", f"   data: [{data}]"]
    names = {"acc_n": "accelerometer_noise_density", "gyr_n": "gyroscope_noise_density"}
    names |= {"acc_w": "accelerometer_random_walk", "gyr_w": "gyroscope_random_walk"}
    lines += [f"{short}: {noise[name]!r}" for short, name in names.items()]
    lines += [f"g_norm: {GRAVITY}", "estimate_td: 0", f"td: {late!r}"]
    (folder / "vins.yaml").write_text("\n".join(lines) + "\n")
    for number, camera in cameras.items():
        _write(folder / f"cam{number}.yaml", _camodocal(camera), "%YAML:1.0\n---\n")


def _camodocal(camera: LoggedCamera) -> dict[str, Any]:
    """A camera as VINS-Fusion's library describes it; empty if it has no such model."""
    width, height = camera.model["resolution"]
    size = {"camera_name": "camera", "image_width": width, "image_height": height}
    kind = _lens(camera)
    if kind == ("omni", "radtan"):
        xi, fx, fy, cx, cy = camera.model["intrinsics"]
        return {
            "model_type": "MEI",
            **size,
            "mirror_parameters": {"xi": xi},
            "distortion_parameters": dict(
                zip(("k1", "k2", "p1", "p2"), camera.model["distortion_coeffs"], strict=True)
            ),
            "projection_parameters": {"gamma1": fx, "gamma2": fy, "u0": cx, "v0": cy},
        }
    if kind not in OPENVINS:
        return {}
    fx, fy, cx, cy = camera.model["intrinsics"]
    a, b, c, d = camera.model["distortion_coeffs"]
    if kind[1] == "radtan":
        return {
            "model_type": "PINHOLE",
            **size,
            "distortion_parameters": {"k1": a, "k2": b, "p1": c, "p2": d},
            "projection_parameters": {"fx": fx, "fy": fy, "cx": cx, "cy": cy},
        }
    projection = {"k2": a, "k3": b, "k4": c, "k5": d, "mu": fx, "mv": fy, "u0": cx, "v0": cy}
    return {"model_type": "KANNALA_BRANDT", **size, "projection_parameters": projection}


def noise_densities(part: ImuPart) -> dict[str, float]:
    """The noise of an IMU by the names of Kalibr."""
    return {
        "gyroscope_noise_density": part.gyroscope.density.white,
        "gyroscope_random_walk": part.gyroscope.density.equivalent_walk,
        "accelerometer_noise_density": part.accelerometer.density.white,
        "accelerometer_random_walk": part.accelerometer.density.equivalent_walk,
    }


class _Indented(yaml.SafeDumper):
    """Indents lists below their key: OpenCV, which OpenVINS reads with, rejects those in the column of the key."""

    def increase_indent(self, flow: bool = False, indentless: bool = False) -> None:
        super().increase_indent(flow, False)


def _write(path: Path, content: Mapping[str, Any], head: str = "") -> None:
    flat = not any(isinstance(value, list | dict) for value in content.values())
    style = False if flat else None
    text = yaml.dump(dict(content), Dumper=_Indented, sort_keys=False, default_flow_style=style, width=1000)  # pyright: ignore[reportUnknownMemberType]
    path.write_text(head + text)
