"""Logs as data sets in the layout of TUM's RGB-D benchmark."""

from pathlib import Path

import numpy as np

from imc.lsf import ReportProgress
from runtime.logs import Array
from shoal.logs.export.camera_calibration import FILE as CAMERAS
from shoal.logs.export.message_batches import LogSource
from shoal.logs.export.photo_files import photo_export_bytes
from shoal.logs.export.vio_samples import PoseTrack, read_recording

BILLION = 1_000_000_000


def export_tum_rgbd(source: LogSource, folder: Path, progress: ReportProgress = lambda _: None) -> int:
    """Write groundtruth.txt, estimate.txt, accelerometer.txt, gyroscope.txt, and rgb.txt with rgb/; returns the rows.

    Poses are those of the vehicle (forward, right, down) in east, north, up; quaternions end with w. Of several IMUs or
    cameras, all but the first have a number in their file names. Copies cameras.yaml of the pictures. Raises OSError.
    """
    recording = read_recording(source, progress)
    cameras = source.log.path.parent / "Photos" / CAMERAS
    if recording.photos and cameras.is_file():
        (folder / CAMERAS).write_bytes(cameras.read_bytes())
    written = 0
    for name, track in (("groundtruth", recording.truth), ("estimate", recording.estimate)):
        if track is not None:
            heading = "# timestamp tx ty tz qx qy qz qw; east, north, up of the vehicle (forward, right, down)"
            written += _write(folder / f"{name}.txt", heading, track.times, _poses(track))
    for number, samples in enumerate(recording.imus):
        about = f"of {samples.label}: forward, right, down"
        heading = f"# timestamp ax ay az (m/s^2) {about}"
        written += _write(folder / f"accelerometer{number or ''}.txt", heading, samples.times, samples.forces)
        heading = f"# timestamp wx wy wz (rad/s) {about}"
        written += _write(folder / f"gyroscope{number or ''}.txt", heading, samples.times, samples.rates)
    for number, (camera, photos) in enumerate(sorted(recording.photos.items())):
        place = f"rgb{number or ''}"
        (folder / place).mkdir()
        lines = [f"# color images of {camera}", "# file: the log's folder Photos", "# timestamp filename"]
        for photo in photos:
            if (data := photo_export_bytes(source, photo.path)) is None:
                continue
            name = f"{place}/{photo.time:.6f}{photo.export_suffix}"
            (folder / name).write_bytes(data)
            lines.append(f"{photo.time:.6f} {name}")
            written += 1
        (folder / f"{place}.txt").write_text("\n".join(lines) + "\n")
    return written


def _poses(track: PoseTrack) -> Array:
    return np.concatenate((track.places, track.attitudes[:, 1:], track.attitudes[:, :1]), axis=1)


def _write(path: Path, heading: str, times: Array, values: Array) -> int:
    with path.open("w", encoding="utf-8") as file:
        file.write(heading + "\n")
        for time, row in zip(times.tolist(), values.tolist(), strict=True):
            file.write(f"{time // BILLION}.{time % BILLION:09d} {' '.join(map(repr, row))}\n")
    return len(times)
