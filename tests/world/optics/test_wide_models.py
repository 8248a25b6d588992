"""Wide lenses: Kalibr's omni, eucm and fov, camodocal's MEI and OpenCV's omnidir."""

import numpy as np
import pytest
import yaml

from world.optics import (
    ArctangentModel,
    CalibrationError,
    ExtendedUnifiedModel,
    OmnidirectionalModel,
    PinholeModel,
    calibration_file_to_json,
    parse_calibration,
    read_calibration,
)

# What cv2.omnidir.projectPoints of opencv-contrib 5.0 projects points to.
WIDE = np.array([[0.3, -0.2, 1.0], [-0.6, 0.5, 2.0], [1.0, 0.7, 0.2], [0.05, 0.9, -0.1]])
OF_OMNIDIR = {
    2.04: (
        (1002.5, 1005.4, 637.6, 358.8),
        (-0.11, 0.45, -3e-4, -3e-4),
        [
            [732.38351604, 295.4216889],
            [543.462464947, 437.466590901],
            [1004.06667059, 616.050562836],
            [666.223116784, 876.866695789],
        ],
    ),
    0.8: (
        (400.0, 410.0, 322.0, 238.0),
        (-0.02, 0.01, 1e-3, -2e-3),
        [
            [386.715677478, 193.772431562],
            [257.404864269, 293.162948082],
            [653.332373834, 476.76712042],
            [352.444043116, 831.192316932],
        ],
    ),
}


def write(tmp_path, content):
    file = tmp_path / "camera.yaml"
    file.write_text("%YAML:1.0\n---\n" + yaml.safe_dump(content))
    return file


@pytest.mark.parametrize("xi", OF_OMNIDIR)
@pytest.mark.parametrize("form", ["kalibr", "camodocal", "opencv"])
def test_omnidirectional_cameras_see_as_opencv_does(tmp_path, xi, form):
    (fx, fy, cx, cy), d, pixels = OF_OMNIDIR[xi]
    k1, k2, p1, p2 = d
    content = {
        "kalibr": {
            "cam0": {
                "camera_model": "omni",
                "intrinsics": [xi, fx, fy, cx, cy],
                "distortion_model": "radtan",
                "distortion_coeffs": list(d),
                "resolution": [1280, 720],
            }
        },
        "camodocal": {
            "model_type": "MEI",
            "camera_name": "camera",
            "image_width": 1280,
            "image_height": 720,
            "mirror_parameters": {"xi": xi},
            "distortion_parameters": {"k1": k1, "k2": k2, "p1": p1, "p2": p2},
            "projection_parameters": {"gamma1": fx, "gamma2": fy, "u0": cx, "v0": cy},
        },
        "opencv": {
            "image_width": 1280,
            "image_height": 720,
            "camera_matrix": {"rows": 3, "cols": 3, "data": [fx, 0.0, cx, 0.0, fy, cy, 0.0, 0.0, 1.0]},
            "distortion_coefficients": {"rows": 1, "cols": 4, "data": list(d)},
            "xi": xi,
        },
    }[form]
    camera = read_calibration(write(tmp_path, content))
    assert isinstance(camera, OmnidirectionalModel)
    assert camera.project(WIDE)[0] - 0.5 == pytest.approx(np.array(pixels), abs=1e-6)
    said = camera.to_opencv()
    assert (said["model"], said["xi"], said["D"].tolist()) == ("omnidir", xi, list(d))


def test_an_omnidirectional_camera_does_not_see_through_its_sphere():
    """With xi > 1 what is farther back than acos(-1 / xi) is hidden; with xi < 1 the pinhole looks the other way."""
    for xi, angle in ((2.04, np.arccos(-1.0 / 2.04)), (0.8, np.arccos(-0.8))):
        camera = OmnidirectionalModel(4000, 4000, 300.0, 300.0, 2000.0, 2000.0, xi)
        points = [[np.sin(tilt), 0.0, np.cos(tilt)] for tilt in (angle - 0.05, angle + 0.05)]
        assert np.isfinite(camera.project(points)[0][:, 0]).tolist() == [True, False]


@pytest.mark.parametrize(
    ("entry", "model"),
    [
        (
            {"camera_model": "eucm", "intrinsics": [0.6, 1.1, 156.5, 157.5, 253.5, 256.5]},
            ExtendedUnifiedModel(512, 512, 156.5, 157.5, 254.0, 257.0, 0.6, 1.1),
        ),
        (
            {"intrinsics": [156.5, 157.5, 253.5, 256.5], "distortion_model": "fov", "distortion_coeffs": [0.93]},
            ArctangentModel(512, 512, 156.5, 157.5, 254.0, 257.0, 0.93),
        ),
        (
            {"intrinsics": [156.5, 157.5, 253.5, 256.5], "distortion_model": "fov", "distortion_coeffs": [0.0]},
            PinholeModel(512, 512, 156.5, 157.5, 254.0, 257.0),
        ),
    ],
)
def test_further_models_of_kalibr(tmp_path, entry, model):
    file = write(tmp_path, {"cam0": {"camera_model": "pinhole", "resolution": [512, 512], **entry}})
    assert read_calibration(file) == model
    assert parse_calibration(calibration_file_to_json(file)) == model
    if not isinstance(model, PinholeModel):
        said = model.to_kalibr()
        assert said["intrinsics"] == entry["intrinsics"]
        with pytest.raises(CalibrationError, match="OpenCV has no"):
            model.to_opencv()


def test_projections_are_those_of_the_articles():
    """Khomutenko and others, 2016; Devernay and Faugeras, 2001."""
    x, y, z = 0.7, -0.4, 0.3
    under = 0.6 * np.sqrt(1.1 * (x * x + y * y) + z * z) + 0.4 * z
    eucm = ExtendedUnifiedModel(512, 512, 156.5, 157.5, 254.0, 257.0, 0.6, 1.1)
    assert eucm.project([x, y, z])[0] == pytest.approx((254.0 + 156.5 * x / under, 257.0 + 157.5 * y / under))
    radius = np.hypot(x / z, y / z)
    factor = np.arctan(2.0 * radius * np.tan(0.465)) / 0.93 / radius
    fov = ArctangentModel(512, 512, 156.5, 157.5, 254.0, 257.0, 0.93)
    wanted = 254.0 + 156.5 * x / z * factor, 257.0 + 157.5 * y / z * factor
    assert fov.project([x, y, z])[0] == pytest.approx(wanted)
