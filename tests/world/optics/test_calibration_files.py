"""Calibrations of other programs, good and bad."""

import json
import math
import re

import cv2
import numpy as np
import pytest
import yaml
from hypothesis import given
from hypothesis import strategies as st

from world.optics import CalibrationError, DoubleSphereModel, FisheyeModel, PinholeModel, read_calibration

WOODSCAPE = {
    "aspect_ratio": 1.0,
    "cx_offset": 3.942,
    "cy_offset": -3.093,
    "height": 966.0,
    "k1": 339.749,
    "k2": -31.988,
    "k3": 48.275,
    "k4": -7.201,
    "model": "radial_poly",
    "poly_order": 4,
    "width": 1280.0,
}
CHAIN = {
    "cam0": {
        "camera_model": "pinhole",
        "distortion_coeffs": [-0.28340811, 0.07395907, 0.00019359, 1.76187114e-05],
        "distortion_model": "radtan",
        "intrinsics": [458.654, 457.296, 367.215, 248.375],
        "resolution": [752, 480],
        "rostopic": "/cam0",
    },
    "cam1": {
        "camera_model": "pinhole",
        "distortion_coeffs": [0.0034823894, 0.0007150348, -0.0020532361, 0.00020293673],
        "distortion_model": "equidistant",
        "intrinsics": [190.97847, 190.9733, 254.93170, 256.89744],
        "resolution": [512, 512],
    },
    "cam2": {
        "camera_model": "ds",
        "distortion_coeffs": [],
        "distortion_model": "none",
        "intrinsics": [-0.2, 0.58, 157.0, 157.1, 254.9, 256.8],
        "resolution": [512, 512],
    },
}


@pytest.fixture
def write(tmp_path):
    def put(content, name="camera.yaml"):
        path = tmp_path / name
        path.write_text(content if isinstance(content, str) else json.dumps(content))
        return path

    return put


def test_a_camchain_of_kalibr(write):
    path = write(yaml.safe_dump(CHAIN))
    first = read_calibration(path)
    assert isinstance(first, PinholeModel)
    assert (first.fx, first.cx, first.k1, first.p2) == pytest.approx((458.654, 367.715, -0.28340811, 1.76187114e-05))
    wide = read_calibration(path, "cam1")
    assert isinstance(wide, FisheyeModel)
    assert math.degrees(wide.lens.fov) > 180.0
    assert isinstance(read_calibration(path, "cam2"), DoubleSphereModel)
    for name, camera in ((name, read_calibration(path, name)) for name in CHAIN):
        said = camera.to_kalibr()
        for field in ("camera_model", "resolution", "intrinsics", "distortion_coeffs"):
            assert said[field] == (CHAIN[name][field] if field != "intrinsics" else pytest.approx(CHAIN[name][field]))


@pytest.mark.parametrize("model", ["pinhole", "fisheye"])
def test_what_opencv_has_written(model, tmp_path):
    path = str(tmp_path / "opencv.yml")
    k, d = np.array([[400.0, 0.0, 319.5], [0.0, 401.0, 239.5], [0.0, 0.0, 1.0]]), np.array([[0.1, -0.02, 1e-3, 2e-3]])
    file = cv2.FileStorage(path, cv2.FILE_STORAGE_WRITE)
    for name, value in (("image_width", 640), ("image_height", 480), ("camera_matrix", k), ("D", d), ("model", model)):
        file.write(name, value)
    file.release()
    camera = read_calibration(path)
    assert (camera.width, camera.height, camera.cx, camera.cy) == (640, 480, 320.0, 240.0)
    said = camera.to_opencv()
    assert said["model"] == model
    assert said["K"] == pytest.approx(k)
    assert said["D"][:4] == pytest.approx(d[0])


MATRIX = {"rows": 3, "cols": 3, "data": [500.0, 0.0, 399.5, 0.0, 500.0, 299.5, 0.0, 0.0, 1.0]}
INFO = {
    "image_width": 800,
    "image_height": 600,
    "camera_matrix": MATRIX,
    "distortion_model": "plumb_bob",
    "distortion_coefficients": {"rows": 1, "cols": 5, "data": [-0.2, 0.05, 0.0, 0.0, 0.01]},
}


def test_a_camera_info_of_ros(write):
    camera = read_calibration(write(yaml.safe_dump(INFO)))
    assert (camera.fx, camera.cx, camera.k3) == (500.0, 400.0, 0.01)


def test_woodscape(write):
    camera = read_calibration(write({"intrinsic": WOODSCAPE}, "FV.json"))
    assert (camera.width, camera.height, camera.cx, camera.cy) == pytest.approx((1280, 966, 643.942, 479.907))
    assert camera.project([0.0, 0.0, 1.0])[1]
    radius = math.dist(camera.project([math.sin(1.0), 0.0, math.cos(1.0)])[0], (643.942, 479.907))
    assert radius == pytest.approx(339.749 - 31.988 + 48.275 - 7.201)


BAD = [
    ("{]", "no YAML"),
    ("[1, 2]", "no named values"),
    ("camera_name: left\nimage_width: 640\nimage_width: 320\n", "no YAML: 'image_width' occurs twice"),
    ('{"intrinsic": {"k1": 339.7, "k1": 1.0}}', "no YAML: 'k1' occurs twice"),
    ({}, "camera_matrix is missing"),
    ({"cam0": 3}, "cam0 has no named values"),
    ({"cam0": {**CHAIN["cam0"], "intrinsics": [1.0, 2.0]}}, "intrinsics has 2 numbers, not 4"),
    ({"cam0": {**CHAIN["cam0"], "intrinsics": [0.0, 457.0, 367.0, 248.0]}}, "not positive"),
    ({"cam0": {**CHAIN["cam0"], "intrinsics": "wide"}}, "no list of numbers"),
    ({"cam0": {**CHAIN["cam0"], "camera_model": "ocam"}}, "ocam is not supported"),
    ({"cam0": {**CHAIN["cam0"], "distortion_model": "division"}}, "division is not supported"),
    ({"cam0": {**CHAIN["cam1"], "distortion_coeffs": [0.1, 0.2]}}, "has 2 numbers, not 4"),
    ({"cam0": {**CHAIN["cam0"], "distortion_coeffs": [0.1, 0.2]}}, "has 2 numbers, not 0 or 4 or 5"),
    ({"cam0": {**CHAIN["cam0"], "distortion_coeffs": None}}, "is no list of numbers: None"),
    ({"cam0": {**CHAIN["cam0"], "distortion_model": "none"}}, "distortion_coeffs are given without a distortion_model"),
    ({"cam0": {**CHAIN["cam1"], "distortion_coeffs": [math.nan] * 4}}, "no camera has"),
    ({"cam0": {key: value for key, value in CHAIN["cam0"].items() if key != "resolution"}}, "resolution is missing"),
    ({"cam0": {**CHAIN["cam0"], "resolution": [math.inf, 480]}}, "resolution is inf, not a number of pixels"),
    ({"camera_matrix": [1, 0.1, 0, 0, 1, 0, 0, 0, 1]}, "is not"),
    ({**INFO, "camera_matrix": {**MATRIX, "rows": 2}}, "has 9 numbers in 2 rows and 3 columns"),
    ({key: value for key, value in INFO.items() if key != "distortion_coefficients"}, "coefficients is missing"),
    ({"intrinsic": {**WOODSCAPE, "k1": 0.0}}, "k1 is 0"),
    ({"cam0": {**CHAIN["cam0"], "intrinsics": [10**400, 457.0, 367.0, 248.0]}}, "intrinsics is no list of numbers"),
    ({**INFO, "image_width": 10**400}, "image_width is no list of numbers"),
    ({"intrinsic": {**WOODSCAPE, "width": 0.5}}, "not a number of pixels"),
    ({"intrinsic": {**WOODSCAPE, "model": "ucm"}}, "ucm is not supported"),
]


@pytest.mark.parametrize(("content", "words"), BAD)
def test_bad_files_are_refused_with_the_field(write, content, words):
    path = write(content)
    with pytest.raises(CalibrationError) as caught:
        read_calibration(path)
    assert str(caught.value).startswith(f"{path}: ")
    assert words in str(caught.value)


@pytest.mark.parametrize(
    ("camera", "field", "value", "line", "words"),
    [
        ("cam1", "distortion_model", "division", 9, "distortion_model division is not supported"),
        ("cam1", "resolution", None, 6, "resolution is missing"),
        ("cam0", "intrinsics", [1.0], 3, "intrinsics has 1 numbers, not 4"),
        ("cam0", "intrinsics", [-1.0, 1.0, 1.0, 1.0], 1, "focal lengths of -1 and 1 px are not positive"),
    ],
)
def test_a_bad_field_is_reported_with_its_line(write, camera, field, value, line, words):
    plain = {"camera_model": "pinhole", "intrinsics": [9.0, 9.0, 4.0, 4.0], "distortion_model": "none"}
    lines = list[str]()
    for name in ("cam0", "cam1"):
        fields = {**plain, "resolution": [9, 9]} | ({field: value} if name == camera else {})
        lines += [f"{name}:", *(f"  {key}: {json.dumps(each)}" for key, each in fields.items() if each is not None)]
    path = write("\n".join(lines))
    with pytest.raises(CalibrationError, match=re.escape(f"{path}:{line}: {words}")):
        read_calibration(path, camera)


def test_a_camera_that_is_not_in_the_file_is_named(write):
    with pytest.raises(CalibrationError, match="no camera cam7; there are cam0, cam1, cam2"):
        read_calibration(write(yaml.safe_dump(CHAIN)), "cam7")


JSON = st.recursive(
    st.none() | st.booleans() | st.floats() | st.integers() | st.text(max_size=5),
    lambda inner: st.lists(inner, max_size=5) | st.dictionaries(st.text(max_size=5), inner, max_size=3),
    max_leaves=10,
)
FIELDS = sorted({*CHAIN["cam0"], *WOODSCAPE})


@given(field=st.sampled_from(FIELDS), value=JSON, base=st.sampled_from(["cam0", "cam1", "cam2", "intrinsic"]))
def test_no_value_of_a_field_does_more_than_refuse_the_file(field, value, base, tmp_path_factory):
    content = {base: {**(CHAIN.get(base) or WOODSCAPE), field: value}}
    if base != "intrinsic":
        content = {"cam0": content[base]}
    path = tmp_path_factory.getbasetemp() / "odd.json"
    path.write_text(json.dumps(content))
    try:
        camera = read_calibration(path)
    except CalibrationError:
        return
    assert camera.width > 0


def test_a_fisheye_of_opencvs_calibration_program_is_no_pinhole(tmp_path):
    """Its `fisheye_model: 1` goes with four coefficients, and without `distortion_model`."""
    file = tmp_path / "out_camera_data.yml"
    file.write_text(
        "%YAML:1.0\n---\nimage_width: 640\nimage_height: 480\nfisheye_model: 1\n"
        "camera_matrix: !!opencv-matrix\n   rows: 3\n   cols: 3\n   dt: d\n"
        "   data: [ 300., 0., 320., 0., 300., 240., 0., 0., 1. ]\n"
        "distortion_coefficients: !!opencv-matrix\n   rows: 4\n   cols: 1\n   dt: d\n   data: [ 0.01, 0., 0., 0. ]\n"
    )
    camera = read_calibration(file)
    assert isinstance(camera, FisheyeModel)
    assert camera.lens.kannala_brandt_coefficients == (0.01, 0.0, 0.0, 0.0)
