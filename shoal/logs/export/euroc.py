"""Logs as data sets in the layout of EuRoC's (ASL), with the noise of their IMUs as Kalibr has it."""

import math
from collections.abc import Mapping
from pathlib import Path
from typing import Any

import numpy as np
import yaml

from imc.lsf import ReportProgress
from runtime.logs import Array
from runtime.profile import default_label, read_sections
from shoal.logs.export.camera_calibration import (
    LoggedCamera,
    LoggedImu,
    euroc_matrix,
    euroc_sensor,
    has_intrinsics,
    noise_densities,
    read_photo_cameras,
    write_calibration,
)
from shoal.logs.export.message_batches import LogSource
from shoal.logs.export.photo_files import Photo, photo_export_bytes
from shoal.logs.export.vio_samples import ImuSamples, PoseTrack, read_recording
from support.rotations import rotation
from tasks.simulators.imu import ARTICLE_INTERVAL, IMU, part_from_options
from world.sensors import vins_parameters

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


def export_euroc(source: LogSource, folder: Path, progress: ReportProgress = lambda _: None) -> int:
    """Write mav0/imu0.., cam0.., state_groundtruth_estimate0 and state_estimate0, and calibration/; returns the rows.

    calibration/ has the noise of each IMU, and of the cameras that Photos/cameras.yaml describes a camchain of Kalibr
    and configurations of VINS-Fusion and OpenVINS with the first IMU. An IMU whose noise the log's Config.ini does not
    say has a sensor.yaml without densities, and no Kalibr file. The biases of the truth are not known, and nan. Raises
    OSError.
    """
    recording = read_recording(source, progress)
    units = _units(source.log.path.parent / "Config.ini")
    written = 0
    for number, samples in enumerate(recording.imus):
        written += _write_unit(folder, number, samples, units.get(samples.label))
    for name, track in (("state_groundtruth_estimate0", recording.truth), ("state_estimate0", recording.estimate)):
        if track is not None:
            written += _write_track(folder / "mav0" / name, track)
    known, chain = read_photo_cameras(source.log.path.parent / "Photos"), list[LoggedCamera]()
    # Those without intrinsics come last: readers number the cameras of a camchain without gaps.
    ordered = sorted(recording.photos.items(), key=lambda each: (not has_intrinsics(known.get(each[0])), each[0]))
    for number, (camera, photos) in enumerate(ordered):
        written += _write_pictures(source, folder / "mav0" / f"cam{number}", photos, known.get(camera))
        chain += [known[camera]] if camera in known else []
    first = recording.imus[0] if recording.imus else None
    unit = None if first is None else units.get(first.label)
    write_calibration(folder / "calibration", chain, unit, 0.0 if first is None else _rate(first.times))
    return written


def _write_unit(folder: Path, number: int, samples: ImuSamples, unit: LoggedImu | None) -> int:
    place = folder / "mav0" / f"imu{number}"
    rate = _rate(samples.times)
    about: dict[str, Any] = {
        "sensor_type": "imu",
        "comment": f"{samples.label}: {FRAMES}",
        "T_BS": euroc_matrix(np.eye(4) if unit is None else unit.pose),
        "rate_hz": rate,
    }
    if unit is not None:
        noise = noise_densities(unit.part)
        about |= noise
        calibration = folder / "calibration"
        _write_yaml(calibration / f"imu{number}.yaml", {**noise, "rostopic": f"/imu{number}", "update_rate": rate})
        block = vins_parameters(unit.part.gyroscope.density, unit.part.accelerometer.density, ARTICLE_INTERVAL)
        heading = f"# Per sample of {ARTICLE_INTERVAL} s, as in articles on AirSim: VINS itself expects the densities"
        (calibration / f"imu{number}_per_sample.yaml").write_text(f"{heading} of imu{number}.yaml\n{block}\n")
    _write_yaml(place / "sensor.yaml", about)
    _write_table(place / "data.csv", IMU_HEADING, samples.times, samples.rates, samples.forces)
    return len(samples.times)


def _write_track(place: Path, track: PoseTrack) -> int:
    about = {"sensor_type": "visual-inertial", "comment": FRAMES, "T_BS": euroc_matrix(np.eye(4))}
    _write_yaml(place / "sensor.yaml", about)
    unknown = np.full((len(track.times), 6), math.nan)
    _write_table(
        place / "data.csv", TRUTH_HEADING, track.times, track.places, track.attitudes, track.velocities, unknown
    )
    return len(track.times)


def _write_pictures(source: LogSource, place: Path, photos: list[Photo], known: LoggedCamera | None) -> int:
    (place / "data").mkdir(parents=True)
    lines = ["#timestamp [ns],filename"]
    times = list[int]()
    for photo in photos:
        if (data := photo_export_bytes(source, photo.path)) is None:
            continue
        times.append(round(photo.time * 1e6) * 1000)
        name = f"{times[-1]}{photo.export_suffix}"
        (place / "data" / name).write_bytes(data)
        lines.append(f"{times[-1]},{name}")
    (place / "data.csv").write_text("\n".join(lines) + "\n")
    about = {"sensor_type": "camera", "comment": photos[0].camera, "rate_hz": _rate(np.array(times))}
    _write_yaml(place / "sensor.yaml", {**about, **({} if known is None else euroc_sensor(known))})
    return len(times)


def _rate(times: Array) -> float:
    """The usual rate of samples, Hz."""
    return round(1e9 / float(np.median(np.diff(times))), 3) if len(times) > 1 else 0.0


def _units(configuration: Path) -> dict[str, LoggedImu]:
    """The simulated IMUs of a configuration by entity; none for one that cannot be read."""
    found: dict[str, LoggedImu] = {}
    try:
        sections = read_sections(configuration)
    except (OSError, ValueError):
        return found
    for section, options in sections.items():
        if section.partition("/")[0] != "Simulators.IMU":
            continue
        label = options.get("Entity Label") or default_label(section)
        try:
            found[label] = LoggedImu(part_from_options(options), _pose(options))
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
