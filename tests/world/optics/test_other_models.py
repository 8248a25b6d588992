"""Calibrations of OAK-D and of mrcal, and rational lenses of ROS."""

import json

import cv2
import numpy as np
import pytest

from world.optics import (
    ArctangentModel,
    CalibrationError,
    ExtendedUnifiedModel,
    FisheyeModel,
    OmnidirectionalModel,
    PinholeModel,
    RationalModel,
    read_calibration,
)

RATIONAL = [1.9, 1.1, 2e-4, -1e-4, 0.05, 2.3, 1.7, 0.3]
POINTS = np.array([[0.3, -0.2, 1.0], [-0.6, 0.5, 2.0], [1.0, 0.7, 1.5], [0.05, 0.9, 1.0]])
# What mrcal 2.2 of Debian projects POINTS to, by mrcal.project().
OF_MRCAL = {
    "PINHOLE": ([400, 410, 322, 238], [[442.0, 156.0], [202.0, 340.5], [588.666666667, 429.333333333], [342.0, 607.0]]),
    "STEREOGRAPHIC": (
        [120, 121, 255.5, 250],
        [
            [290.400383475, 226.539186664],
            [220.77686562, 279.177078194],
            [325.391215127, 299.331549344],
            [260.614454672, 342.827352306],
        ],
    ),
    "OPENCV4": (
        [400, 410, 322, 238, 0.1, -0.05, 1e-3, -2e-3],
        [
            [443.1626, 155.18779],
            [199.9835375, 342.180711719],
            [599.486748971, 437.748369053],
            [342.34684375, 625.724892188],
        ],
    ),
    "OPENCV5": (
        [400, 410, 322, 238, 0.1, -0.05, 1e-3, -2e-3, 0.02],
        [
            [443.1678728, 155.18418692],
            [199.975025712, 342.187982204],
            [601.035601178, 438.859670512],
            [342.561394531, 629.683354102],
        ],
    ),
    "OPENCV8": (
        [400, 410, 322, 238, *RATIONAL],
        [
            [436.314967986, 159.891878543],
            [208.515721289, 334.941782649],
            [540.926215367, 395.152867526],
            [337.855026628, 531.191491293],
        ],
    ),
    "OPENCV12": (
        [400, 410, 322, 238, 0.1, -0.05, 1e-3, -2e-3, 0.02, 0.05, 0.01, 0, 1e-3, -5e-4, 2e-3, 3e-4],
        [
            [442.411816618, 155.842727678],
            [200.980176488, 341.505457659],
            [591.092214987, 432.195125814],
            [341.79924045, 612.80878708],
        ],
    ),
}


def write(tmp_path, content, name="camera.yaml"):
    file = tmp_path / name
    file.write_text(content if isinstance(content, str) else json.dumps(content))
    return file


def cameramodel(lens, intrinsics, extra=""):
    return (
        f"# comment\n{{\n 'lensmodel': '{lens}',\n 'intrinsics': {intrinsics},\n 'imagersize': [ 640, 480,],\n{extra}}}"
    )


@pytest.mark.parametrize("lens", OF_MRCAL)
def test_a_model_of_mrcal_projects_as_mrcal_does(tmp_path, lens):
    intrinsics, pixels = OF_MRCAL[lens]
    camera = read_calibration(write(tmp_path, cameramodel(f"LENSMODEL_{lens}", intrinsics), "a.cameramodel"))
    assert camera.project(POINTS)[0] - 0.5 == pytest.approx(np.array(pixels), abs=1e-8)


def test_data_that_mrcal_optimized_are_passed_over(tmp_path):
    inputs = " 'optimization_inputs': b'P)h>@6aWAK2mk;8" + "x" * (3 << 20) + "'\n"
    text = cameramodel("LENSMODEL_OPENCV4", OF_MRCAL["OPENCV4"][0], inputs)
    assert read_calibration(write(tmp_path, text, "a.cameramodel")).width == 640


@pytest.mark.parametrize(
    ("text", "words"),
    [
        (
            cameramodel("LENSMODEL_CAHVOR", [400] * 9),
            "lensmodel LENSMODEL_CAHVOR is not supported; LENSMODEL_PINHOLE, ",
        ),
        (
            cameramodel("LENSMODEL_SPLINED_STEREOGRAPHIC_order=3_Nx=30", [1]),
            "SPLINED_STEREOGRAPHIC_order=3_Nx=30 is not",
        ),
        (cameramodel("LENSMODEL_OPENCV8", [400] * 8), "intrinsics of LENSMODEL_OPENCV8 are not 12 numbers"),
        (cameramodel("LENSMODEL_PINHOLE", ["wide", 1, 1, 1]), "camera_matrix is no list of numbers"),
        ("{ 'lensmodel': 'LENSMODEL_PINHOLE', ", "no camera model of mrcal"),
        ("{ 'lensmodel': __import__('os').getpid() }", "no camera model of mrcal"),
        ("{" * 5000 + "'lensmodel'", "no camera model of mrcal"),
        ("['lensmodel']", "no camera model of mrcal: no named values"),
        ("{'lensmodel': 'LENSMODEL_PINHOLE'}", "intrinsics is missing"),
    ],
)
def test_bad_models_of_mrcal_are_refused_with_the_reason(tmp_path, text, words):
    file = write(tmp_path, text, "a.cameramodel")
    with pytest.raises(CalibrationError) as caught:
        read_calibration(file)
    assert str(caught.value).startswith(f"{file}: ")
    assert words in str(caught.value)


OAK = {
    "batchName": "",
    "boardName": "OAK-D",
    "version": 7,
    "cameraData": [
        [
            0,
            {
                "cameraType": 0,
                "distortionCoeff": [*RATIONAL, 0.0, 0.0, 0.0, 0.0, 0.01, -0.02],
                "width": 1920,
                "height": 1080,
                "intrinsicMatrix": [[1479.0, 0.0, 950.7], [0.0, 1477.6, 530.7], [0.0, 0.0, 1.0]],
                "lensPosition": 135,
                "specHfovDeg": 68.8,
            },
        ],
        [
            2,
            {
                "cameraType": 1,
                "distortionCoeff": [0.01, -0.002, 0.0, 0.0, *[0.0] * 10],
                "width": 1280,
                "height": 800,
                "intrinsicMatrix": [[560.0, 0.0, 640.0], [0.0, 560.0, 400.0], [0.0, 0.0, 1.0]],
            },
        ],
        [
            3,
            {
                "cameraType": 0,
                "distortionCoeff": [],
                "width": 1280,
                "height": 800,
                "intrinsicMatrix": [[1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]],
            },
        ],
    ],
}


def test_cameras_of_an_oak_see_as_opencv_does(tmp_path):
    file = write(tmp_path, OAK, "oak.json")
    color = read_calibration(file)
    assert isinstance(color, RationalModel)
    assert color == read_calibration(file, "CAM_A") == read_calibration(file, "rgb")
    about = OAK["cameraData"][0][1]
    k, d = np.array(about["intrinsicMatrix"]), np.array(about["distortionCoeff"])
    theirs, _ = cv2.projectPoints(POINTS[:, None], np.zeros(3), np.zeros(3), k, d)
    assert color.project(POINTS)[0] == pytest.approx(theirs[:, 0] + 0.5, abs=1e-6)
    wide = read_calibration(file, "right")
    assert isinstance(wide, FisheyeModel)
    assert wide.lens.kannala_brandt_coefficients == (0.01, -0.002, 0.0, 0.0)


@pytest.mark.parametrize(
    ("camera", "change", "words"),
    [
        ("CAM_D", {}, "distortionCoeff is empty: the camera has not been calibrated"),
        ("CAM_F", {}, "no camera CAM_F; there are CAM_A, CAM_C, CAM_D"),
        ("rgb", {"cameraType": 3}, "cameraType 3 is not supported; 0 (perspective) and 1 (fisheye) are"),
        ("rgb", {"intrinsicMatrix": [1.0]}, "intrinsicMatrix has 1 numbers, not 9"),
        ("rgb", {"distortionCoeff": [1.0, 2.0]}, "distortionCoeff has 2 numbers"),
        ("rgb", {"width": 0}, "image_width is 0"),
        ("rgb", {"cameraType": [1]}, "cameraType [1] is not supported"),
    ],
)
def test_bad_cameras_of_an_oak_are_refused_with_the_field(tmp_path, camera, change, words):
    content = json.loads(json.dumps(OAK))
    content["cameraData"][0][1] |= change
    file = write(tmp_path, content, "oak.json")
    with pytest.raises(CalibrationError) as caught:
        read_calibration(file, camera)
    assert words in str(caught.value)


@pytest.mark.parametrize(("entries", "words"), [([], "no cameras"), ([[0]], "entry"), ([["a", {}]], "socket 'a'")])
def test_bad_lists_of_an_oak_are_refused(tmp_path, entries, words):
    with pytest.raises(CalibrationError, match=words):
        read_calibration(write(tmp_path, {"cameraData": entries}, "oak.json"))


@pytest.mark.parametrize(
    ("make", "words"),
    [
        (lambda size: OmnidirectionalModel(*size, -0.1), "xi of at least 0"),
        (lambda size: ExtendedUnifiedModel(*size, 1.2), "alpha in"),
        (lambda size: ExtendedUnifiedModel(*size, 0.5, 0.0), "positive beta"),
        (lambda size: ArctangentModel(*size, 0.0), "not within 0 and"),
        (lambda size: RationalModel(*size, tau_x=1.6), "has no picture"),
    ],
)
def test_impossible_cameras_are_refused(make, words):
    with pytest.raises(CalibrationError, match=words):
        make((640, 480, 400.0, 400.0, 320.0, 240.0))


def test_a_rational_lens_ends_where_it_folds_or_has_a_pole():
    size = 640, 480, 400.0, 400.0, 320.0, 240.0
    folding, pole = RationalModel(*size, -0.3), RationalModel(*size, k4=-0.5)
    assert folding.fold_angle == PinholeModel(*size, -0.3).fold_angle
    assert pole.fold_angle is not None
    assert np.tan(pole.fold_angle) ** 2 == pytest.approx(2.0)
    for camera in (folding, pole):
        edge = np.tan(camera.fold_angle)
        pixels, _ = camera.project([[0.99 * edge, 0.0, 1.0], [1.01 * edge, 0.0, 1.0]])
        assert np.isfinite(pixels[:, 0]).tolist() == [True, False]


def test_a_camera_info_with_a_rational_lens_is_read(tmp_path):
    """Of an OAK-D, or of a RealSense."""
    text = (
        "image_width: 640\nimage_height: 480\ncamera_name: cam\n"
        "camera_matrix: {rows: 3, cols: 3, data: [300, 0, 320, 0, 300, 240, 0, 0, 1]}\n"
        "distortion_model: rational_polynomial\n"
        "distortion_coefficients: {rows: 1, cols: 8, data: [0.1, 0.01, 0.0, 0.0, 0.0, 0.05, 0.01, 0.0]}\n"
    )
    camera = read_calibration(write(tmp_path, text))
    assert camera == RationalModel(640, 480, 300.0, 300.0, 320.5, 240.5, 0.1, 0.01, k4=0.05, k5=0.01)
    zero = text.replace("0.05, 0.01, 0.0]", "0.0, 0.0, 0.0]")
    assert read_calibration(write(tmp_path, zero)) == PinholeModel(640, 480, 300.0, 300.0, 320.5, 240.5, 0.1, 0.01)
