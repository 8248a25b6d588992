"""Camera files of VINS-Fusion, ORB-SLAM3, and of formats that are not known."""

import json

import numpy as np
import pytest

from world.optics import CalibrationError, FisheyeModel, PinholeModel, read_calibration

HUGE = "1" + 400 * "0"
VINS = """%YAML:1.0
---
model_type: PINHOLE
camera_name: camera
image_width: 752
image_height: 480
distortion_parameters:
   k1: -2.9e-01
   k2: 8.6e-02
   p1: 2.0e-06
   p2: 1.3e-05
projection_parameters:
   fx: 461.1
   fy: 459.7
   cx: 362.6
   cy: 248.1
"""
VINS_FISHEYE = """%YAML:1.0
---
model_type: KANNALA_BRANDT
image_width: 512
image_height: 512
projection_parameters: {k2: 0.0034, k3: 0.0007, k4: -0.002, k5: 0.0002, mu: 190.9, mv: 190.8, u0: 254.9, v0: 256.9}
"""
ORB = """%YAML:1.0
---
Camera.type: "KannalaBrandt8"
Camera1.fx: 190.97
Camera1.fy: 190.97
Camera1.cx: 254.9
Camera1.cy: 256.9
Camera1.k1: 0.003
Camera.width: 512
Camera.height: 512
"""


def read(tmp_path, text, camera=""):
    file = tmp_path / "camera.yaml"
    file.write_text(text)
    return read_calibration(file, camera)


def test_a_pinhole_of_vins_fusion(tmp_path):
    """Its first pixel has its center at (0, 0)."""
    camera = read(tmp_path, VINS)
    assert camera == PinholeModel(752, 480, 461.1, 459.7, 363.1, 248.6, -0.29, 0.086, 2e-6, 1.3e-5)


@pytest.mark.parametrize(
    ("text", "plane", "k"),
    [
        (VINS_FISHEYE, (190.9, 190.8, 255.4, 257.4), (0.0034, 0.0007, -0.002, 0.0002)),
        (ORB, (190.97, 190.97, 255.4, 257.4), (0.003, 0.0, 0.0, 0.0)),
    ],
)
def test_fisheye_lenses_of_vins_fusion_and_orb_slam(tmp_path, text, plane, k):
    camera = read(tmp_path, text)
    assert isinstance(camera, FisheyeModel)
    assert (camera.fx, camera.fy, camera.cx, camera.cy) == pytest.approx(plane)
    assert camera.lens.kannala_brandt_coefficients == k


def test_a_pinhole_of_orb_slam_in_both_spellings(tmp_path):
    text = ORB.replace("KannalaBrandt8", "PinHole") + "Camera1.p2: 0.001\n"
    new, old = read(tmp_path, text), read(tmp_path, text.replace("Camera1.", "Camera."))
    assert new == old == PinholeModel(512, 512, 190.97, 190.97, 255.4, 257.4, 0.003, p2=0.001)
    lines = [line for line in text.replace("Camera1.", "Camera2.").splitlines() if line.startswith("Camera2.")]
    second = read(tmp_path, text + "\n".join(lines) + "\n", "Camera2")
    assert np.allclose(second.intrinsic_matrix, new.intrinsic_matrix)


@pytest.mark.parametrize(
    ("text", "said"),
    [
        (VINS.replace("PINHOLE", "SCARAMUZZA"), "SCARAMUZZA is not supported; PINHOLE, KANNALA_BRANDT and MEI are"),
        (VINS.replace("   fx: 461.1\n", ""), "projection_parameters.fx is missing"),
        (VINS.replace("461.1", "wide"), "projection_parameters.fx is no number: 'wide'"),
        (ORB.replace("KannalaBrandt8", "Equirect"), "Camera.type Equirect is not supported"),
        ("lensmodel: LENSMODEL_OPENCV8\n", "no camera of a known format; read are camchain of Kalibr, .*VINS-Fusion"),
    ],
)
def test_what_cannot_be_read_is_named_and_formats_are_listed(tmp_path, text, said):
    with pytest.raises(CalibrationError, match=said):
        read(tmp_path, text)


@pytest.mark.parametrize(
    ("name", "text"),
    [
        ("a.yaml", VINS.replace("752", HUGE)),
        ("a.yaml", VINS.replace("461.1", HUGE)),
        ("a.json", json.dumps({"SettingsVersion": 1.2, "CameraDefaults": {"CaptureSettings": [{"Width": 10**400}]}})),
        ("a.json", json.dumps({"cameraData": [[0, {"width": 10**400}]]})),
        (
            "a.cameramodel",
            f"{{'lensmodel': 'LENSMODEL_PINHOLE', 'intrinsics': [{HUGE}, 9, 4, 4], 'imagersize': [9, 9]}}",
        ),
    ],
)
def test_a_number_beyond_any_float_is_refused(tmp_path, name, text):
    path = tmp_path / name
    path.write_text(text)
    with pytest.raises(CalibrationError, match=r"too large|no list of numbers"):
        read_calibration(path)
