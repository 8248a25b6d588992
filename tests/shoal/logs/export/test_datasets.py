"""Data sets for visual-inertial navigation of a simulated LAUV: their parts fit each other, and the log."""

import csv
import itertools
import math

import cv2
import numpy as np
import pytest
import yaml
from evo.core import metrics, sync
from evo.tools import file_interface

import imc
from runtime.logs import summarize
from shoal.logs.export import LogSource
from shoal.logs.export.euroc import export_euroc
from shoal.logs.export.tum_rgbd import export_tum_rgbd
from shoal.logs.export.vio_samples import quaternions
from shoal.missions import prepare
from support.rotations import rotation
from tests.outside import ALONE
from world.optics import read_calibration

OPTIONS = [
    *("Vision.FisheyeCamera:Size=64", "Vision.FisheyeCamera:Face Size=32", "Simulators.IMU/AHRS:Generate Noise=false"),
    *("Simulators.IMU/AHRS:Device Position=0.5, 0, 0.1", "Simulators.IMU/AHRS:Device Orientation=0, 0, 90"),
]
OPTIONS += [f"Vision.Camera/{side}:{size}" for side in ("Left", "Right") for size in ("Width=96", "Height=72")]
SECONDS = 30.0
UP = np.array([0.0, 0.0, 9.80665])


@pytest.fixture(scope="module")
def source(tmp_path_factory):
    folder = tmp_path_factory.mktemp("run")
    modes = ["Simulation", "Camera", "Stereo"]
    made = prepare(
        "lauv-noptilus-1", modes=modes, overrides=[*OPTIONS, *ALONE], log_root=folder, state_folder=folder / "db"
    )
    made.vehicle.start()
    made.vehicle.run(SECONDS)
    made.vehicle.close()
    log = imc.Log(max(folder.rglob("Data.lsf.gz"), key=lambda path: path.stat().st_size).parent)
    return LogSource(log, summarize(log))


def numbers(path):
    rows = [row for row in csv.reader(path.read_text().splitlines()) if not row[0].startswith("#")]
    return np.array([int(row[0]) for row in rows]), np.array([row[1:] for row in rows], float)


def matrices(attitudes):
    """Rotation matrices of quaternions w, x, y, z."""
    w, x, y, z = attitudes.T
    rows = [
        [1 - 2 * (y * y + z * z), 2 * (x * y - w * z), 2 * (x * z + w * y)],
        [2 * (x * y + w * z), 1 - 2 * (x * x + z * z), 2 * (y * z - w * x)],
        [2 * (x * z - w * y), 2 * (y * z + w * x), 1 - 2 * (x * x + y * y)],
    ]
    return np.moveaxis(np.array(rows), -1, 0)


@pytest.mark.heavy
def test_the_parts_of_a_euroc_data_set_fit_each_other(source, tmp_path):
    """The forces, turned to the world by the truth, less gravity, add up to the velocity of the place of the IMU."""
    export_euroc(source, tmp_path)
    times, truth = numbers(tmp_path / "mav0/state_groundtruth_estimate0/data.csv")
    samples, measured = numbers(tmp_path / "mav0/imu0/data.csv")
    pose = np.array(yaml.safe_load((tmp_path / "mav0/imu0/sensor.yaml").read_text())["T_BS"]["data"]).reshape(4, 4)
    assert pose[:3, 3] == pytest.approx([0.5, 0.0, 0.1])
    common, ours, theirs = np.intersect1d(times, samples, return_indices=True)
    assert len(common) > 0.9 * len(samples) > 1000
    body = matrices(truth[ours, 3:7])
    at_sensor = truth[ours, :3] + body @ pose[:3, 3]
    seconds = (common - common[0]) * 1e-9
    velocity = np.gradient(at_sensor, seconds, axis=0)
    middle = 0.5 * (body[1:] + body[:-1])
    pushes = np.einsum("nij,jk,nk->ni", middle, pose[:3, :3], measured[theirs, 3:][1:]) - UP
    gained = np.cumsum(pushes * np.diff(seconds)[:, None], axis=0)
    error = velocity[1:-1] - velocity[1] - (gained[:-1] - gained[0])
    assert np.abs(error).max() < 0.01
    assert np.ptp(velocity - np.gradient(truth[ours, :3], seconds, axis=0), axis=0).max() > 0.04, "the lever arm counts"
    assert np.gradient(truth[:, :3], times * 1e-9, axis=0)[5:-5] == pytest.approx(truth[5:-5, 7:10], abs=0.02)
    assert np.isnan(truth[:, 10:]).all()


def test_pictures_have_their_times_as_names(source, tmp_path):
    export_euroc(source, tmp_path)
    photos = sorted((source.log.path.parent / "Photos").glob("Fisheye*.png"))
    rows = [line.split(",") for line in (tmp_path / "mav0/cam0/data.csv").read_text().splitlines()[1:]]
    assert len(rows) == len(photos) > 5
    for (time, name), photo in zip(rows, photos, strict=True):
        assert int(time) * 1e-9 == pytest.approx(float(photo.stem.rpartition("_")[2]), abs=1e-6)
        assert (tmp_path / "mav0/cam0/data" / name).read_bytes() == photo.read_bytes()


def test_each_calibration_says_the_same_of_each_camera(source, tmp_path):
    """Kalibr, EuRoC, VINS-Fusion and OpenVINS: the same pixel for a point that the IMU knows."""
    export_euroc(source, tmp_path)
    calibration = tmp_path / "calibration"
    chain = yaml.safe_load((calibration / "camchain.yaml").read_text())
    opened = yaml.safe_load((calibration / "openvins/kalibr_imucam_chain.yaml").read_text().partition("\n")[2])
    assert opened == chain
    assert [chain[f"cam{n}"]["resolution"] for n in range(3)] == [[64, 64], [96, 72], [96, 72]]
    base = np.array(chain["cam2"]["T_cn_cnm1"])
    assert base[:3, 3] == pytest.approx([-0.2, 0.0, 0.0], abs=1e-9), (
        "from the left camera, the right one is to the right"
    )
    storage = cv2.FileStorage(str(calibration / "vins/vins.yaml"), cv2.FILE_STORAGE_READ)
    assert (
        storage.getNode("acc_n").real()
        == yaml.safe_load((calibration / "imu0.yaml").read_text())["accelerometer_noise_density"]
    )
    sensor = yaml.safe_load((tmp_path / "mav0/imu0/sensor.yaml").read_text())
    late = 0.5 / sensor["rate_hz"]  # samples are means over the interval that ends at their stamp
    assert storage.getNode("td").real() == late > 0.0
    assert [chain[f"cam{n}"]["timeshift_cam_imu"] for n in range(3)] == [late] * 3
    body = sensor["T_BS"]["data"]
    body = np.array(body).reshape(4, 4)
    point = np.array([0.2, 0.1, 4.0, 1.0])
    for number in range(3):
        entry = chain[f"cam{number}"]
        camera = read_calibration(calibration / "camchain.yaml", f"cam{number}")
        seen = camera.project((np.array(entry["T_cam_imu"]) @ np.linalg.inv(body) @ point)[:3])[0]
        about = yaml.safe_load((tmp_path / f"mav0/cam{number}/sensor.yaml").read_text())
        pose = np.array(about["T_BS"]["data"]).reshape(4, 4)
        euroc = read_calibration(tmp_path / f"mav0/cam{number}/sensor.yaml")
        assert euroc.project((np.linalg.inv(pose) @ point)[:3])[0] == pytest.approx(seen, abs=1e-6)
        if number == 0:  # VINS-Fusion takes one camera, or two of one size
            assert storage.getNode("num_of_cam").real() == 2.0
            continue
        assert storage.getNode(f"image{number - 1}_topic").string() == f"/cam{number}/image_raw"
        assert storage.getNode(f"cam{number - 1}_calib").string() == f"cam{number}.yaml"
        vins = storage.getNode(f"body_T_cam{number - 1}").mat()
        there = np.linalg.inv(vins) @ np.linalg.inv(body) @ point
        assert camera.project(there[:3])[0] == pytest.approx(seen, abs=1e-6)
        own = yaml.safe_load((calibration / f"vins/cam{number}.yaml").read_text().partition("---\n")[2])
        values = own["projection_parameters"]
        wanted = [values[name] for name in (("mu", "mv", "u0", "v0") if "mu" in values else ("fx", "fy", "cx", "cy"))]
        assert wanted == entry["intrinsics"]


def test_all_files_number_the_cameras_alike_if_one_has_no_intrinsics(source, tmp_path):
    file = source.log.path.parent / "Photos" / "cameras.yaml"
    before = file.read_text()
    cameras = yaml.safe_load(before)
    fisheye = next(name for name in cameras if name.startswith("Fisheye"))
    cameras[fisheye] = {"T_BS": cameras[fisheye]["T_BS"], "not_in_kalibr": "a lens of its own"}
    file.write_text(yaml.safe_dump(cameras))
    try:
        export_euroc(source, tmp_path)
    finally:
        file.write_text(before)
    chain = yaml.safe_load((tmp_path / "calibration/camchain.yaml").read_text())
    assert list(chain) == ["cam0", "cam1"]
    abouts = [yaml.safe_load((tmp_path / f"mav0/cam{number}/sensor.yaml").read_text()) for number in range(3)]
    assert abouts[2]["no_intrinsics"] == "a lens of its own"
    for number in range(2):
        assert abouts[number]["intrinsics"] == chain[f"cam{number}"]["intrinsics"]
        picture = next((tmp_path / f"mav0/cam{number}/data").iterdir())
        assert list(cv2.imread(str(picture)).shape[1::-1]) == chain[f"cam{number}"]["resolution"]


def test_openvins_reads_its_files_with_opencv(source, tmp_path):
    export_euroc(source, tmp_path)
    folder = tmp_path / "calibration/openvins"
    estimator = cv2.FileStorage(str(folder / "estimator_config.yaml"), cv2.FILE_STORAGE_READ)
    assert (estimator.getNode("max_cameras").real(), estimator.getNode("gravity_mag").real()) == (3.0, 9.80665)
    cameras, imu = (
        cv2.FileStorage(str(folder / estimator.getNode(f"relative_config_{kind}").string()), cv2.FILE_STORAGE_READ)
        for kind in ("imucam", "imu")
    )
    assert listed(imu.getNode("imu0").getNode("T_i_b")) == np.eye(4).tolist()
    assert listed(imu.getNode("imu0").getNode("Ta")) == np.eye(3).tolist()
    noise = yaml.safe_load((tmp_path / "calibration/imu0.yaml").read_text())
    for name in ("gyroscope_noise_density", "accelerometer_random_walk", "update_rate"):
        assert imu.getNode("imu0").getNode(name).real() == noise[name]
    chain = yaml.safe_load((tmp_path / "calibration/camchain.yaml").read_text())
    assert list(chain) == ["cam0", "cam1", "cam2"]
    for camera, told in chain.items():
        for name in ("intrinsics", "distortion_coeffs", "resolution", "T_cam_imu"):
            assert np.array(listed(cameras.getNode(camera).getNode(name))) == pytest.approx(np.array(told[name]))
        assert cameras.getNode(camera).getNode("distortion_model").string() == told["distortion_model"]


def listed(node):
    """The numbers of a list of OpenCV's, which may be one of lists."""
    return [listed(node.at(n)) for n in range(node.size())] if node.isSeq() else node.real()


def test_kalibr_gets_densities_and_the_articles_block_is_labelled(source, tmp_path):
    export_euroc(source, tmp_path)
    noise = yaml.safe_load((tmp_path / "calibration/imu0.yaml").read_text())
    assert noise["gyroscope_noise_density"] == pytest.approx(math.radians(0.3) / 60)
    assert noise["accelerometer_random_walk"] == pytest.approx(36e-6 * 9.80665 / math.sqrt(800))
    assert noise["update_rate"] == 100.0
    heading, *block = (tmp_path / "calibration/imu0_per_sample.yaml").read_text().splitlines()
    assert "per sample" in heading.lower()
    assert block[0] == "acc_n: 1.4885e-02"


def test_a_tum_data_set_says_the_same(source, tmp_path):
    rows = export_tum_rgbd(source, tmp_path)
    files = {path.stem: np.loadtxt(path) for path in tmp_path.glob("[aeg]*.txt")}
    assert sum(map(len, files.values())) + len(list(tmp_path.glob("rgb*/*"))) == rows
    states = list(source.log.messages("SimulatedState"))
    truth = files["groundtruth"]
    assert truth[:, 0] == pytest.approx([state.timestamp for state in states], abs=1e-6)
    origin = truth[0, 1:4]
    assert truth[:, 1] - origin[0] == pytest.approx([state.y - states[0].y for state in states], abs=1e-3)
    assert truth[:, 3] - origin[2] == pytest.approx([states[0].z - state.z for state in states], abs=1e-3)
    for row, state in list(zip(truth, states, strict=True))[::200]:
        ned = np.array(rotation(state.phi, state.theta, state.psi))
        assert matrices(row[None, [7, 4, 5, 6]])[0] == pytest.approx(ned[[1, 0, 2]] * [[1], [1], [-1]], abs=1e-6)
    described = (source.log.path.parent / "Photos/cameras.yaml").read_bytes()
    assert (tmp_path / "cameras.yaml").read_bytes() == described
    assert len((tmp_path / "rgb.txt").read_text().splitlines()) - 3 == len(list((tmp_path / "rgb").iterdir()))


@pytest.mark.heavy
def test_evo_reads_both_data_sets_and_finds_the_same_error(source, tmp_path):
    for name, export in (("tum", export_tum_rgbd), ("euroc", export_euroc)):
        (tmp_path / name).mkdir()
        export(source, tmp_path / name)
    files = [tmp_path / f"tum/{name}.txt" for name in ("groundtruth", "estimate")]
    tum = [file_interface.read_tum_trajectory_file(file) for file in files]
    folders = [tmp_path / f"euroc/mav0/state_{name}0/data.csv" for name in ("groundtruth_estimate", "estimate")]
    euroc = [file_interface.read_euroc_csv_trajectory(folder) for folder in folders]
    errors = []
    for pair in (tum, euroc):
        assert all(trajectory.check()[0] for trajectory in pair), [trajectory.check() for trajectory in pair]
        error = metrics.APE(metrics.PoseRelation.translation_part)
        error.process_data(sync.associate_trajectories(*pair, max_diff=0.006))
        errors.append(error.get_statistic(metrics.StatisticsType.rmse))
    states = [list(source.log.messages(kind)) for kind in ("SimulatedState", "EstimatedState")]
    length = sum(math.dist((a.x, a.y, a.z), (b.x, b.y, b.z)) for a, b in itertools.pairwise(states[0]))
    assert tum[0].path_length == pytest.approx(length, rel=1e-3)
    assert errors[0] == pytest.approx(errors[1], rel=1e-3)
    assert 0.0 < errors[0] < 5.0


def test_quaternions_turn_like_angles():
    angles = np.random.default_rng(1).uniform(-1.5, 1.5, (50, 3))
    for angle, found in zip(angles, matrices(quaternions(*angles.T)), strict=True):
        assert found == pytest.approx(np.array(rotation(*angle))[[1, 0, 2]] * [[1], [1], [-1]], abs=1e-12)


def test_what_is_not_finite_or_alone_is_left_out_and_counted(make_log, tmp_path):
    head = {"src": 0x1A, "src_ent": 7}
    messages = [imc.Announce(sys_name="lauv-noptilus-1", src=0x1A, timestamp=1.7e9)]
    for number in range(5):
        time = 1.7e9 + number
        messages.append(imc.AngularVelocity(x=0.1, **head, timestamp=time))
        messages.append(imc.Acceleration(x=math.nan if number == 2 else 1.0, **head, timestamp=time))
    messages.append(imc.Acceleration(x=9.0, **head, timestamp=1.7e9 + 9))
    log = imc.Log(make_log(list(map(imc.encode, messages))))
    source = LogSource(log, summarize(log))
    assert export_euroc(source, tmp_path) == 4
    told = {"Acceleration is not finite": 1, "entity 7 has no rates and force at the same time": 2}
    assert dict(source.skipped) == told
    assert not (tmp_path / "calibration").exists()
    assert "gyroscope_noise_density" not in (tmp_path / "mav0/imu0/sensor.yaml").read_text()
