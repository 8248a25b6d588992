"""Cameras of any lens, anywhere on a vehicle: where things lie in their pictures, and what is told of them."""

import json
import math

import numpy as np
import pytest
import yaml
from PIL import Image

import imc
from runtime import Frame, ParameterError
from runtime.kernel import VirtualClock
from runtime.profile import load_profile
from runtime.testing import simulate
from runtime.vehicle import build
from support.pose import Pose
from tasks.vision.camera import Camera
from tasks.vision.fisheye_camera import FisheyeCamera
from world.optics import read_calibration
from world.rendering import optical_to_body_transform

WOODSCAPE = {
    "intrinsic": {
        "model": "radial_poly",
        **{"width": 1280, "height": 966, "cx_offset": 3.942, "cy_offset": -3.093, "aspect_ratio": 1.0},
        **{"k1": 339.749, "k2": -31.988, "k3": 48.275, "k4": -7.201},
    }
}
OAK_LEFT = {
    "cameraType": 0,
    "width": 640,
    "height": 400,
    "intrinsicMatrix": [[400.0, 0.0, 322.0], [0.0, 401.0, 198.0], [0.0, 0.0, 1.0]],
    "distortionCoeff": [1.9, 1.1, 2e-4, -1e-4, 0.05, 2.3, 1.7, 0.3, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0],
}
CHAIN = {
    "cam0": {
        "camera_model": "omni",
        "intrinsics": [2.04, 1002.5, 1005.4, 637.6, 358.8],
        "distortion_model": "radtan",
        "distortion_coeffs": [-0.11, 0.45, -3e-4, -3e-4],
        "resolution": [1280, 720],
    },
    "cam1": {"camera_model": "eucm", "intrinsics": [0.6, 1.1, 200.0, 201.0, 255.5, 250.0], "resolution": [512, 512]},
    "cam2": {
        "camera_model": "pinhole",
        "intrinsics": [400.0, 400.0, 320.0, 240.0],
        "distortion_model": "fov",
        "distortion_coeffs": [0.93],
        "resolution": [640, 480],
    },
}
STEREOGRAPHIC = """
# a comment of mrcal
{
    'lensmodel':  'LENSMODEL_STEREOGRAPHIC',
    'intrinsics': [ 250, 250, 319.5, 239.5,],
    'extrinsics': [ 0, 0, 0, 0, 0, 0,],
    'imagersize': [ 640, 480,],
}
"""
CALIBRATIONS = {
    "camera.json": WOODSCAPE,
    "oak.json": {"boardName": "OAK-D", "cameraData": [[1, OAK_LEFT]]},
    "chain.yaml": CHAIN,
    "a.cameramodel": STEREOGRAPHIC,
}
CAMERAS = {
    "down": {},
    "ahead": {"mount_orientation": [0.0, -20.0, 0.0]},
    "aside, apart": {"mount_orientation": [10.0, -60.0, 70.0], "mount_position": [0.8, -0.3, 0.2]},
    "barrel": {"distortion": [-0.28, 0.07, 2e-4, 2e-5], "principal_point": [300.0, 260.5]},
    "behind a pane": {"housing": "Flat Port", "port_distance": 0.05, "field_of_view": 120.0},
    "in a dome": {"housing": "Dome", "dome_offset": 0.02, "distortion": [-0.28, 0.07]},
    "woodscape": {"calibration": "camera.json"},
    "OAK-D": {"calibration": "oak.json", "calibration_camera": "left"},
    "omni": {"calibration": "chain.yaml", "calibration_camera": "cam0"},
    "eucm": {"calibration": "chain.yaml", "calibration_camera": "cam1"},
    "fov": {"calibration": "chain.yaml", "calibration_camera": "cam2"},
    "mrcal": {"calibration": "a.cameramodel"},
}
GLIDERS = ((2.0, 0.4), (3.5, -0.8), (0.4, 1.5))


def states(seconds=1.0, **fields):
    fields = {"alt": 3.0, "depth": 2.0, "z": 2.0, **fields}
    return [imc.EstimatedState(timestamp=n / 20, **fields) for n in range(int(seconds * 20))]


def yellow(image):
    red, green, blue = np.moveaxis(image[..., :3].astype(int), -1, 0)
    return (red > 120) & (green > 90) & (blue < 80)


@pytest.mark.parametrize("name", CAMERAS)
def test_gliders_are_where_the_frame_says_that_they_are(name, tmp_path, monkeypatch):
    """By the model, the mount and the pose in the frame, without any knowledge of the renderer."""
    monkeypatch.chdir(tmp_path)
    for file, content in CALIBRATIONS.items():
        (tmp_path / file).write_text(content if isinstance(content, str) else json.dumps(content))
    run = simulate(
        Camera,
        feed=states(phi=0.1, theta=-0.05, psi=0.4),
        frame_rate=2.0,
        visibility=1000.0,
        interpolation="bilinear",
        settings={"World": {"Gliders": ", ".join(f"{north} {east}" for north, east in GLIDERS)}},
        **CAMERAS[name],
    )
    frame = run.frames[-1]
    assert frame.optics is not None
    assert frame.pose is not None
    assert frame.image.shape[:2] == (frame.optics.height, frame.optics.width)
    places = np.array([(*glider, 5.0, 1.0) for glider in GLIDERS])
    pixels, seen = frame.optics.project((places @ np.linalg.inv(frame.pose).T)[:, :3])
    shown = yellow(frame.image)
    inside = [pixel for pixel, is_seen in zip(pixels, seen, strict=True) if is_seen]
    assert inside
    for u, v in inside:
        assert shown[min(int(v), shown.shape[0] - 1), min(int(u), shown.shape[1] - 1)]
    assert frame.mount is not None
    body = Pose(0.0, 0.0, 2.0, 0.1, -0.05, 0.4).transform
    assert frame.pose == pytest.approx(body @ frame.mount)


def test_a_stereo_camera_exposes_at_one_instant_and_sees_the_disparity_of_its_base():
    left = {"mount_position": [0.0, -0.15, 0.0], "entity_label": "Left"}
    right = {"mount_position": [0.0, 0.15, 0.0], "entity_label": "Right"}
    common = {"frame_rate": 4.0, "visibility": 1000.0, "interpolation": "bilinear"}
    both = [(Camera, {**common, **left}), (Camera, {**common, **right})]
    run = simulate(both, feed=states(), settings={"World": {"Gliders": "0.2 0.1"}})
    pairs = [[f for f in run.frames if f.camera == label] for label in ("Left", "Right")]
    assert len(pairs[0]) >= 3
    for one, other in zip(*pairs, strict=True):
        assert one.time == other.time
        columns = [np.nonzero(yellow(frame.image))[1].mean() for frame in (one, other)]
        focal = 320 / math.tan(math.radians(40.0))
        assert columns[0] - columns[1] == pytest.approx(focal * 0.3 / 3.0, rel=0.03)


@pytest.mark.heavy
def test_a_log_says_what_each_picture_is_and_the_folder_what_each_camera(tmp_path):
    """On a shipped vehicle, whose navigation drifts: truth and estimate are both told, by each camera."""
    loaded = load_profile("lauv-noptilus-1")
    vehicle = build(
        loaded, loaded.parse_modes("Simulation,Camera"), clock=VirtualClock(loaded.start_time_ns), log_root=tmp_path
    ).vehicle
    options = {"entity_label": "Bow", "frame_rate": 1.0, "save_images": True, "distortion": [-0.1]}
    vehicle.add(Camera, "Vision.Camera/Bow", **options, mount_position=[1.0, 0.0, 0.1])
    frames, told = [], []
    vehicle.observe(Frame, frames.append)
    vehicle.observe(imc.CameraFrame, told.append)
    vehicle.start()
    vehicle.run(12.0)
    vehicle.close()
    assert len(frames) == len(told) > 20
    for frame, message in zip(frames, told, strict=True):
        assert (message.index, message.time, message.pose) == (frame.index, frame.time, message.Pose.TRUTH)
        assert (message.width, message.height) == (frame.optics.width, frame.optics.height)
        assert [message.x, message.y, message.z] == pytest.approx(frame.pose[:3, 3], abs=1e-4)
        w, x, y, z = message.qw, message.qx, message.qy, message.qz
        assert math.hypot(w, x, y, z) == pytest.approx(1.0)
        ahead = [2 * (x * z + w * y), 2 * (y * z - w * x), 1 - 2 * (x * x + y * y)]
        assert ahead == pytest.approx(frame.pose[:3, 2], abs=1e-5)
        assert math.isfinite(message.est_x + message.est_qw)
        assert (message.est_x, message.est_y) != (message.x, message.y)
    assert len([message for message in told if message.file]) == len(told)
    logs = [path.parent for path in (tmp_path / "lauv-noptilus-1").rglob("Data.lsf*")]
    assert all(any((log / message.file).is_file() for log in logs) for message in told)
    folder = next((log / told[-1].file).parent for log in logs if (log / told[-1].file).is_file())
    cameras = yaml.safe_load((folder / "cameras.yaml").read_text())
    assert set(cameras) == {"Bow", "Fisheye Camera"}
    for frame in frames[-2:]:
        known = read_calibration(folder / "cameras.yaml", frame.camera)
        rays = frame.optics.unproject([[100.5, 200.5], [256.5, 230.5], [300.0, 150.0]])[0]
        assert known.project(rays)[0] == pytest.approx(frame.optics.project(rays)[0], abs=1e-3)
        assert cameras[frame.camera]["T_BS"] == pytest.approx(frame.mount)


@pytest.mark.parametrize(("kind", "ending"), [("PNG", "png"), ("QOI", "qoi"), ("JPEG", "jpg")])
def test_formats_of_pictures(kind, ending, tmp_path):
    options = {"save_images": True, "image_format": kind, "log_root": tmp_path, "frame_rate": 2.0, "size": 64}
    run = simulate(FisheyeCamera, feed=states(), face_size=32, **options)
    files = sorted(tmp_path.rglob(f"*.{ending}"))
    assert files
    assert [e.topic for e in run.of(imc.Event)] == ["Picture"] * len(files)
    with Image.open(files[0]) as picture:
        shown = np.asarray(picture.convert("RGB"), int)
    apart = np.abs(shown - run.frames[0].image[..., :3])
    assert apart.mean() < 4.0 if kind == "JPEG" else not apart.any()


@pytest.mark.parametrize(
    ("options", "words"),
    [
        ({"calibration": "nowhere.yaml"}, "Calibration.*nowhere.yaml"),
        ({"principal_point": [3.0]}, "Principal Point: must be two numbers"),
        ({"distortion": [math.nan]}, "k1 is nan|Distortion"),
        ({"width": 0}, "Width"),
        ({"mount_position": [1e20, 0.0, 0.0]}, "Mount Position.*-1000 to 1000"),
    ],
)
def test_impossible_cameras_are_refused(options, words):
    with pytest.raises(ValueError, match=words):
        simulate(Camera, **options)


@pytest.mark.heavy
@pytest.mark.parametrize(
    ("options", "said"),
    [
        ({"distortion": [-1.0]}, ["the lens folds 30° off its axis: the image is empty beyond"]),
        ({"distortion": [-0.4], "field_of_view": 40.0}, []),
    ],
)
def test_a_lens_that_folds_within_the_image_is_reported_with_the_angle(options, said):
    run = simulate(Camera, feed=states(), **options)
    assert [text for text in run.log if "fold" in text] == said
    assert (run.frames[0].image[0, 0, 3] == 0) == bool(said)


def test_an_image_that_is_empty_is_refused():
    with pytest.raises(ParameterError, match="Principal Point: nothing is in the image"):
        simulate(Camera, feed=states(), principal_point=[1e30, 0.0])


def test_the_mount_of_a_frame_is_that_of_the_camera():
    run = simulate(Camera, feed=states(), mount_position=[1.0, 2.0, 1.5], mount_orientation=[0.0, 0.0, 90.0])
    wanted = optical_to_body_transform(Pose(1.0, 2.0, 1.5, 0.0, 0.0, math.pi / 2))
    assert run.frames[0].mount == pytest.approx(wanted)
    assert run.frames[0].mount[:3, 2] == pytest.approx([0.0, 1.0, 0.0])


@pytest.mark.parametrize(
    ("options", "height", "warned"),
    [
        ({"mount_position": [0.0, 0.0, -2.0]}, 0.0, 1),
        ({"mount_position": [0.0, 0.0, -2.0]}, -2.0, 0),
        ({"mount_position": [0.0, 0.0, -2.0], "scene": "Sea Surface"}, 1.0, 0),
        ({"mount_position": [0.0, 0.0, -1.0]}, 0.0, 1),
        ({"mount_position": [0.0, 0.0, -0.3]}, 0.0, 0),
        ({}, 5.0, 1),
    ],
)
def test_a_camera_above_the_water_that_sees_as_under_water_says_so_once(options, height, warned):
    truth = [imc.SimulatedState(timestamp=n / 20, z=-height) for n in range(20)]
    run = simulate(
        Camera, feed=[*truth, *states(z=-height, depth=-1.0, alt=height + 9.0)], width=32, height=24, **options
    )
    assert len(run.frames) > 1
    assert sum("above the water, but Scene = Seabed" in line for line in run.log) == warned


def test_a_camera_in_the_ground_says_so():
    run = simulate(Camera, feed=states(), mount_position=[0.0, 0.0, 3.5])
    assert run.frames == []
    assert run.task.entity.description == "the camera is in the ground"


@pytest.mark.parametrize(("kind", "squares"), [("Chessboard", "6, 9"), ("AprilGrid", "3, 4")])
def test_a_board_of_the_world_is_seen_where_it_lies(kind, squares):
    options = {"Class": kind, "Position": "0.3, -0.2", "Heading": "0", "Squares": squares, "Square Size": "0.1"}
    settings = {"World": {"Gliders": "none", "Objects": "Board"}, "World/Board": options}
    common = {"feed": states(), "frame_rate": 2.0, "visibility": 1000.0, "interpolation": "bilinear"}
    seen = simulate(Camera, settings=settings, **common).frames[-1]
    bare = simulate(Camera, settings={"World": {"Gliders": "none"}}, **common).frames[-1]
    rows, columns = np.nonzero(np.abs(seen.image.astype(int) - bare.image).sum(axis=-1) > 60)
    middle = np.linalg.inv(seen.pose) @ [0.3, -0.2, 5.0, 1.0]
    (u, v), _ = seen.optics.project(middle[:3])
    assert (columns.min() + columns.max() + 1) / 2 == pytest.approx(u, abs=2.0)
    assert (rows.min() + rows.max() + 1) / 2 == pytest.approx(v, abs=2.0)


def test_an_impossible_board_is_refused_with_its_section():
    options = {"Class": "Chessboard", "Position": "0 0", "Squares": "1, 9"}
    with pytest.raises(ValueError, match=r"World/Board\] Squares 1 x 9 squares make no Chessboard"):
        simulate(Camera, settings={"World": {"Objects": "Board"}, "World/Board": options})
