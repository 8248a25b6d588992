"""Calibrations of several cameras in data sets: their numbers, lenses that Kalibr lacks, pairs, rolling shutters."""

import shutil
import struct
from itertools import count
from pathlib import Path

import cv2
import numpy as np
import pytest
import yaml
from click.testing import CliRunner

from shoal.cli import main
from shoal.logs.export.camera_calibration import LoggedImu, euroc_sensor, read_photo_cameras, write_calibration
from shoal.logs.export.ros_camera_info import camera_info, missing_info_reason, stereo_baseline
from support.pose import Pose
from tasks.vision.cameras.camera_metadata import write_cameras
from world.optics import (
    ArctangentModel,
    DoubleSphereModel,
    ExtendedUnifiedModel,
    FlatPort,
    OmnidirectionalModel,
    PinholeModel,
    RationalModel,
    put_behind_port,
    read_calibration,
)
from world.rendering import Exposure
from world.sensors import IMU_PARTS

LOG = Path(__file__).parents[3] / "data/logs/dune-mission-cut"
PLAIN = PinholeModel(64, 48, 50.0, 50.0, 32.0, 24.0)
THICK = PinholeModel(640, 480, 500.0, 500.0, 320.0, 240.0, -0.2, 0.05, 1e-4, -1e-4, 0.01)
VGA = 640, 480, 400.0, 401.0, 322.5, 238.5
LENSES = {
    "Rational": RationalModel(*VGA, 1.9, 1.1, 2e-4, -1e-4, 0.05, 2.0, 1.2, 0.1),
    "Steep": RationalModel(*VGA[:2], 240.0, 240.0, 322.5, 238.5, 1.9, 1.1, 2e-4, -1e-4, 0.05, 4.0, 3.0, 0.3),
    "Prism": RationalModel(*VGA, 0.1, -0.05, 1e-3, -2e-3, 0.02, 0.05, 0.01, 0.0, 1e-3, -5e-4, 2e-3, 3e-4),
    "Omni": OmnidirectionalModel(*VGA, 2.04, -0.11, 0.45, -3e-4, -3e-4),
    "Eucm": ExtendedUnifiedModel(*VGA, 0.6, 1.1),
    "Fov": ArctangentModel(*VGA, 0.93),
    "Spheres": DoubleSphereModel(*VGA, -0.2, 0.58),
}
IMU = LoggedImu(IMU_PARTS["MPU-6000"], np.eye(4))


@pytest.fixture
def described(tmp_path):
    numbers = count()

    def describe(readouts=None, **cameras):
        folder = tmp_path / f"Photos{next(numbers)}"
        assert write_cameras(folder, cameras, readouts or {}) == ""
        return folder, read_photo_cameras(folder)

    return describe


def test_a_lens_with_k3_keeps_its_intrinsics_everywhere(described, tmp_path):
    folder, cameras = described(Thick=(THICK, Pose()))
    assert read_calibration(folder / "cameras.yaml", "Thick") == THICK
    sensor = euroc_sensor(cameras["Thick"])
    assert (sensor["distortion_model"], len(sensor["distortion_coefficients"])) == ("radial-tangential", 4)
    assert sensor["fit_rms_px"] < 0.5
    write_calibration(tmp_path / "out", list(cameras.values()), IMU, 100.0)
    camera = read_calibration(tmp_path / "out" / "camchain.yaml")
    pixels = np.array([[320.5, 240.5], [20.0, 30.0], [600.0, 400.0]])
    assert camera.project(THICK.unproject(pixels)[0])[0] == pytest.approx(pixels, abs=1.0)
    info = camera_info(0, "x", cameras["Thick"])
    assert struct.pack("<5d", -0.2, 0.05, 1e-4, -1e-4, 0.01) in info, "ROS has k3"


@pytest.mark.parametrize(
    ("content", "note"),
    [
        (b"Left: [", "no calibration of the cameras: {} cannot be read: "),
        (b"\xff\xfe\x00", "no calibration of the cameras: {} cannot be read: "),
        (b"- Left", "no calibration of the cameras: {} has no cameras by name"),
        (b"Left: {T_BS: [1, 2]}", "no calibration of Left: its entry in {} has no T_BS of 16 numbers"),
    ],
)
@pytest.mark.parametrize("form", ["x.mcap", "x-euroc", "x-tum"])
def test_an_export_says_that_cameras_yaml_cannot_be_used(tmp_path, content, note, form):
    log = shutil.copytree(LOG, tmp_path / "log")
    (log / "Photos").mkdir()
    (log / "Photos/cameras.yaml").write_bytes(content)
    result = CliRunner().invoke(main, ["log", "export", str(log), str(tmp_path / form)])
    assert f"note: {note.format(log / 'Photos/cameras.yaml')}" in result.stderr


def test_without_pictures_nothing_is_said_of_cameras_yaml(tmp_path):
    log = shutil.copytree(LOG, tmp_path / "log")
    result = CliRunner().invoke(main, ["log", "export", str(log), str(tmp_path / "x.mcap")])
    assert (result.exit_code, "cameras.yaml" in result.stderr) == (0, False)


def test_vins_fusion_gets_two_of_four_cameras(described, tmp_path):
    _, cameras = described(**{f"C{n}": (PLAIN, Pose(y=0.1 * n)) for n in range(4)})
    write_calibration(tmp_path / "out", list(cameras.values()), IMU, 100.0)
    storage = cv2.FileStorage(str(tmp_path / "out/vins/vins.yaml"), cv2.FILE_STORAGE_READ)
    assert storage.getNode("num_of_cam").real() == 2.0
    assert storage.getNode("body_T_cam2").empty()
    assert len(yaml.safe_load((tmp_path / "out/camchain.yaml").read_text())) == 4


def test_the_right_camera_of_a_pair_has_its_baseline(described):
    places = {"Left": Pose(y=-0.1), "Right": Pose(y=0.1), "Aside": Pose(y=0.3, psi=0.1), "Up": Pose(z=1)}
    _, cameras = described(**{name: (PLAIN, place) for name, place in places.items()})
    lengths = {name: stereo_baseline(camera, cameras.values()) for name, camera in cameras.items()}
    assert lengths == {"Left": 0.0, "Right": pytest.approx(0.2), "Aside": 0.0, "Up": 0.0}
    projection = struct.pack("<4d", 50.0, 0.0, 31.5, -50.0 * lengths["Right"])
    assert projection in camera_info(0, "x", cameras["Right"], lengths["Right"])
    assert projection not in camera_info(0, "x", cameras["Left"], lengths["Left"])


@pytest.mark.parametrize(("part", "degrees_per_hour", "micro_g"), [("MPU-6000", 4.6, 36.0), ("ADIS16448", 14.5, 250.0)])
def test_noise_files_have_the_bias_stability_of_the_data_sheet(described, tmp_path, part, degrees_per_hour, micro_g):
    """In Kalibr's model the Allan deviation has its minimum at √(2 N K / √3)."""
    _, cameras = described(Front=(PLAIN, Pose()))
    write_calibration(tmp_path / "out", list(cameras.values()), LoggedImu(IMU_PARTS[part], np.eye(4)), 100.0)
    openvins = cv2.FileStorage(str(tmp_path / "out/openvins/kalibr_imu_chain.yaml"), cv2.FILE_STORAGE_READ)
    storage = openvins.getNode("imu0")
    vins = cv2.FileStorage(str(tmp_path / "out/vins/vins.yaml"), cv2.FILE_STORAGE_READ)
    for names, short, least in (
        ("gyroscope", "gyr", np.radians(degrees_per_hour) / 3600.0),
        ("accelerometer", "acc", micro_g * 9.80665e-6),
    ):
        n, k = (storage.getNode(f"{names}_{kind}").real() for kind in ("noise_density", "random_walk"))
        assert np.sqrt(2.0 * n * k / np.sqrt(3.0)) == pytest.approx(least, rel=1e-6)
        assert [vins.getNode(f"{short}_{kind}").real() for kind in "nw"] == pytest.approx([n, k])


def test_files_say_that_a_shutter_rolls(described, tmp_path):
    _, cameras = described({"Rolling": 0.048}, Rolling=(PLAIN, Pose()), Still=(PLAIN, Pose()))
    write_calibration(tmp_path / "out", list(cameras.values()), IMU, 100.0)
    chain = yaml.safe_load((tmp_path / "out/camchain.yaml").read_text())
    for about in (chain["cam0"], euroc_sensor(cameras["Rolling"])):
        assert (about["readout_time"], about["time_of"]) == (0.048, "middle row")
        assert about["line_delay"] == pytest.approx(0.001)
        rows = about["first_row"] + about["line_delay"] * np.arange(48)  # as Kalibr counts from the first row
        assert rows == pytest.approx(Exposure(readout=0.048).row_times(48))
    assert "line_delay" not in chain["cam1"]
    assert "The shutter of camera 0 rolls" in (tmp_path / "out/vins/vins.yaml").read_text()


def test_a_camera_without_intrinsics_says_why(described):
    _, cameras = described(Port=(put_behind_port(PLAIN, FlatPort()), Pose()))
    assert "no port" in euroc_sensor(cameras["Port"])["no_intrinsics"]


@pytest.mark.parametrize("name", LENSES)
def test_a_log_keeps_every_lens(described, name):
    """Also those that Kalibr or OpenCV lacks, or has only a fit for."""
    folder, _ = described(**{name: (LENSES[name], Pose())})
    assert read_calibration(folder / "cameras.yaml", name) == LENSES[name]


def test_a_rational_lens_is_fitted_for_kalibr_or_its_absence_explained(described):
    _, cameras = described(**{name: (LENSES[name], Pose()) for name in ("Rational", "Steep")})
    assert cameras["Rational"].model["fit_rms_px"] < 0.5
    assert "intrinsics" not in cameras["Steep"].model
    assert "Kalibr has no rational lens, and the nearest radtan is" in euroc_sensor(cameras["Steep"])["no_intrinsics"]


def test_ros_gets_the_rational_lens_itself_and_no_lens_that_it_lacks(described):
    _, cameras = described(**{name: (LENSES[name], Pose()) for name in LENSES})
    for name in ("Rational", "Steep"):
        info = camera_info(0, "x", cameras[name])
        assert b"rational_polynomial" in info
        assert struct.pack("<8d", *LENSES[name].coefficients) in info
    for name in ("Prism", "Omni", "Eucm", "Fov", "Spheres"):
        assert camera_info(0, "x", cameras[name]) == b""
        assert missing_info_reason(cameras[name]).startswith("ROS has no ")


def test_openvins_and_vins_fusion_get_only_lenses_that_they_have(described, tmp_path):
    """OpenVINS takes a lens that it does not know for radtan."""
    _, cameras = described(Omni=(LENSES["Omni"], Pose()), Eucm=(LENSES["Eucm"], Pose()), Plain=(PLAIN, Pose(y=0.1)))
    write_calibration(tmp_path / "out", list(cameras.values()), IMU, 100.0)
    assert set(yaml.safe_load((tmp_path / "out/camchain.yaml").read_text())) == {"cam0", "cam1", "cam2"}
    text = (tmp_path / "out/openvins/kalibr_imucam_chain.yaml").read_text().removeprefix("%YAML:1.0")
    (only,) = yaml.safe_load(text).values()
    assert (only["camera_model"], only["rostopic"]) == ("pinhole", "/cam2/image_raw")
    assert "T_cn_cnm1" not in only
    assert read_calibration(tmp_path / "out/vins/cam0.yaml") == LENSES["Omni"]
    assert sorted(file.name for file in (tmp_path / "out/vins").iterdir()) == ["cam0.yaml", "vins.yaml"]
