"""Logs as data sets in the layout of EuRoC's (ASL), with the noise of their IMUs as Kalibr has it."""

import math
import shutil
from collections.abc import Mapping
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np
import yaml

from runtime.logs import Array
from runtime.profile import default_label, read_sections
from shoal.logs.export.batches import ReportBytes, Source
from shoal.logs.export.motion import Samples, Track, record
from shoal.logs.export.ros_standard import Photo
from tasks.simulators.imu import ARTICLE_INTERVAL, IMU, grade_of
from world.attitude import rotation
from world.sensors import Part, vins_parameters

IMU_HEADING = "#timestamp [ns]," + ",".join(
    [f"w_RS_S_{axis} [rad s^-1]" for axis in "xyz"] + [f"a_RS_S_{axis} [m s^-2]" for axis in "xyz"]
)
TRUTH_HEADING = "#timestamp," + ",".join(
    [f" p_RS_R_{axis} [m]" for axis in "xyz"]
    + [f" q_RS_{axis} []" for axis in "wxyz"]
    + [f" v_RS_R_{axis} [m s^-1]" for axis in "xyz"]
    + [f" b_w_RS_S_{axis} [rad s^-1]" for axis in "xyz"]
    + [f" b_a_RS_S_{axis} [m s^-2]" for axis in "xyz"]
)
FRAMES = "R is east, north, up; the body B is forward, right, down of the vehicle; T_BS places the sensor S in it"


class Unit(NamedTuple):
    """What the configuration of a log says of an IMU: noise, and 4x4 pose in the body."""

    part: Part
    pose: Array


def export_euroc(source: Source, folder: Path, progress: ReportBytes = lambda _: None) -> int:
    """Write mav0/imu0.., cam0.., state_groundtruth_estimate0 and state_estimate0, and calibration/; returns the rows.

    An IMU whose noise the log's Config.ini does not say has a sensor.yaml without densities, and no Kalibr file. The
    biases of the truth are not known, and nan. Raises OSError.
    """
    recording = record(source, progress)
    units = _units(source.log.path.parent / "Config.ini")
    written = 0
    for number, samples in enumerate(recording.units):
        written += _write_unit(folder, number, samples, units.get(samples.label))
    for name, track in (("state_groundtruth_estimate0", recording.truth), ("state_estimate0", recording.estimate)):
        if track is not None:
            written += _write_track(folder / "mav0" / name, track)
    for number, (camera, photos) in enumerate(sorted(recording.pictures.items())):
        written += _write_pictures(folder / "mav0" / f"cam{number}", camera, photos)
    return written


def _write_unit(folder: Path, number: int, samples: Samples, unit: Unit | None) -> int:
    place = folder / "mav0" / f"imu{number}"
    rate = _rate(samples.times)
    about: dict[str, Any] = {
        "sensor_type": "imu",
        "comment": f"{samples.label}: {FRAMES}",
        "T_BS": _matrix(np.eye(4) if unit is None else unit.pose),
        "rate_hz": rate,
    }
    if unit is not None:
        noise = _densities(unit.part)
        about |= noise
        calibration = folder / "calibration"
        _write_yaml(calibration / f"imu{number}.yaml", {**noise, "rostopic": f"/imu{number}", "update_rate": rate})
        block = vins_parameters(unit.part.gyroscope.density, unit.part.accelerometer.density, ARTICLE_INTERVAL)
        heading = f"# Per sample of {ARTICLE_INTERVAL} s, as in articles on AirSim: VINS itself expects the densities"
        (calibration / f"imu{number}_per_sample.yaml").write_text(f"{heading} of imu{number}.yaml\n{block}\n")
    _write_yaml(place / "sensor.yaml", about)
    _write_table(place / "data.csv", IMU_HEADING, samples.times, samples.rates, samples.forces)
    return len(samples.times)


def _write_track(place: Path, track: Track) -> int:
    about = {"sensor_type": "visual-inertial", "comment": FRAMES, "T_BS": _matrix(np.eye(4))}
    _write_yaml(place / "sensor.yaml", about)
    unknown = np.full((len(track.times), 6), math.nan)
    _write_table(
        place / "data.csv", TRUTH_HEADING, track.times, track.places, track.attitudes, track.velocities, unknown
    )
    return len(track.times)


def _write_pictures(place: Path, camera: str, photos: list[Photo]) -> int:
    (place / "data").mkdir(parents=True)
    lines = ["#timestamp [ns],filename"]
    times = [round(photo.time * 1e6) * 1000 for photo in photos]
    for time, photo in zip(times, photos, strict=True):
        name = f"{time}{photo.path.suffix.lower()}"
        shutil.copyfile(photo.path, place / "data" / name)
        lines.append(f"{time},{name}")
    (place / "data.csv").write_text("\n".join(lines) + "\n")
    _write_yaml(place / "sensor.yaml", {"sensor_type": "camera", "comment": camera, "rate_hz": _rate(np.array(times))})
    return len(photos)


def _densities(part: Part) -> dict[str, float]:
    return {
        "gyroscope_noise_density": part.gyroscope.density.white,
        "gyroscope_random_walk": part.gyroscope.density.walk,
        "accelerometer_noise_density": part.accelerometer.density.white,
        "accelerometer_random_walk": part.accelerometer.density.walk,
    }


def _rate(times: Array) -> float:
    """The usual rate of samples, Hz."""
    return round(1e9 / float(np.median(np.diff(times))), 3) if len(times) > 1 else 0.0


def _units(configuration: Path) -> dict[str, Unit]:
    """The simulated IMUs of a configuration by entity; none for one that cannot be read."""
    found: dict[str, Unit] = {}
    try:
        sections = read_sections(configuration)
    except (OSError, ValueError):
        return found
    for section, options in sections.items():
        if section.partition("/")[0] != "Simulators.IMU":
            continue
        label = options.get("Entity Label") or default_label(section)
        try:
            found[label] = Unit(grade_of(options), _pose(options))
        except ValueError:
            continue
    return found


def _pose(options: Mapping[str, str]) -> Array:
    place, turn = (
        IMU.parameters()[name].parse(options.get(name, "")) or [0.0] * 3
        for name in ("Device Position", "Device Orientation")
    )
    pose = np.eye(4)
    pose[:3, :3], pose[:3, 3] = rotation(*map(math.radians, turn)), place
    return pose


def _matrix(pose: Array) -> dict[str, Any]:
    return {"rows": 4, "cols": 4, "data": pose.ravel().tolist()}


def _write_yaml(path: Path, content: dict[str, Any]) -> None:
    path.parent.mkdir(parents=True, exist_ok=True)
    path.write_text(yaml.safe_dump(content, sort_keys=False, default_flow_style=None))


def _write_table(path: Path, heading: str, times: Array, *columns: Array) -> None:
    """Rows of an integer time and numbers, as short as possible without loss."""
    path.parent.mkdir(parents=True, exist_ok=True)
    rows = np.concatenate(columns, axis=1).tolist()
    with path.open("w", encoding="utf-8") as file:
        file.write(heading + "\n")
        file.writelines(f"{time},{','.join(map(repr, row))}\n" for time, row in zip(times.tolist(), rows, strict=True))
