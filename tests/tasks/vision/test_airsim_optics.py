"""What AirSim's pictures see: by the projection of the capture that takes them, and by settings.json."""

import json
import math
from pathlib import Path

import msgspec
import pytest
import yaml

from runtime import ParameterError, State
from tests.tasks.vision.airsim_standin import VIEWER, StandIn
from tests.tasks.vision.test_airsim import apart, shot
from world.optics import CalibrationError, parse_airsim_settings, read_calibration

ONE = {"cameras": ["front_center"]}


def told(fov, width=64, height=64, **camera):
    setting = {"ImageType": 0, "Width": width, "Height": height, "FOV_Degrees": fov}
    viewer = {"ImageType": -1, "FOV_Degrees": 77}
    cameras = {"front_center": {"CaptureSettings": [setting, viewer], **camera}}
    return json.dumps({"SettingsVersion": 1.2, "Vehicles": {"auv": {"Cameras": cameras}}})


@pytest.mark.parametrize(("width", "height", "fov"), [(64, 64, 60.0), (80, 60, 100.0), (60, 80, 70.0)])
def test_the_focal_length_is_that_of_the_pictures_not_of_the_viewer(width, height, fov):
    with StandIn(width, height, fov=fov) as server:
        run = shot(server, **ONE)
        f = 0.5 * max(width, height) / math.tan(math.radians(fov) / 2)
        optics = run.frames[0].optics
        assert (optics.fx, optics.fy) == pytest.approx((f, f), rel=1e-6)
        assert apart(run.frames[0]) <= 1


def test_five_views_come_though_the_viewer_has_no_90_degrees():
    assert VIEWER < 90.0
    with StandIn() as server:
        run = shot(server)
        assert run.task.entity.state is State.NORMAL
        assert len(run.frames) == 4


def matrix(rows):
    def change(method, answer):
        if method != "simGetCameraInfo":
            return answer
        kind, number, error, result = msgspec.msgpack.decode(answer)
        result.pop("proj_mat")
        result |= {} if rows is None else {"proj_mat": {"matrix": rows}}
        return msgspec.msgpack.encode([kind, number, error, result])

    return change


@pytest.mark.parametrize("rows", [None, [[math.nan] * 4] * 4])
def test_without_a_projection_settings_json_counts(rows, tmp_path):
    with StandIn(fov=60.0) as server:
        server.fault = matrix(rows)
        assert "neither proj_mat of simGetCameraInfo nor settings.json" in shot(server, **ONE).task.entity.description
        server.told = told(60.0)
        by_server = shot(server, **ONE).frames[0].optics
        file = tmp_path / "settings.json"
        file.write_text(told(60.0))
        server.told = None
        by_file = shot(server, settings_file=str(file), **ONE).frames[0].optics
        assert by_server == by_file
        assert by_file.fx == pytest.approx(32 / math.tan(math.radians(30)))


def test_the_term_of_a_diagonal_projection_is_found_too():
    with StandIn(fov=60.0) as server:
        scale = 1 / math.tan(math.radians(30))
        server.fault = matrix([[scale, 0, 0, 0], [0, scale, 0, 0], [0, 0, 0, 1], [0, 0, 1, 0]])
        assert shot(server, **ONE).frames[0].optics.fx == pytest.approx(32 * scale)


@pytest.mark.parametrize(
    "rows",
    [[], [[1.0]], [[0.0] * 4] * 4, [[math.inf] * 4] * 4, [[1.0, 1.0, 0.0, 0.0]] * 4],
)
def test_a_projection_that_is_none_is_named(rows):
    with StandIn() as server:
        server.fault = matrix(rows)
        run = shot(server, **ONE)
        assert "front_center" in run.task.entity.description or "proj_mat is n" in run.task.entity.description
        assert (run.task.entity.state, run.frames) == (State.ERROR, [])


def test_pictures_that_are_not_as_settings_json_says_are_reported_once():
    with StandIn(fov=60.0) as server:
        server.told = told(90.0)
        run = shot(server, **ONE)
        said = [line for line in run.log if "its pictures have 60°, settings.json has 90°" in line]
        assert len(said) == 1
        assert run.frames[0].optics.fx == pytest.approx(32 / math.tan(math.radians(30)))


def test_a_wrong_settings_file_is_an_error_with_its_field(tmp_path):
    file = tmp_path / "settings.json"
    for text, said in [
        ("{", "no JSON"),
        (told(190.0), "front_center: FOV_Degrees is 190, not within 0 to 180"),
        (told(90.0).replace("front_center", "other"), "has no camera front_center; there are other"),
    ]:
        file.write_text(text)
        with pytest.raises(ParameterError, match=said), StandIn() as server:
            shot(server, settings_file=str(file), **ONE)


def test_what_a_camera_leaves_out_is_that_of_the_defaults():
    text = {
        "CameraDefaults": {"CaptureSettings": [{"Width": 320, "Height": 200}]},
        "Vehicles": {
            "a": {"Cameras": {"plain": {}, "wide": {"CaptureSettings": [{"ImageType": 0, "FOV_Degrees": 120}]}}},
            "b": {"Cameras": {"other": {}}},
        },
    }
    found = parse_airsim_settings(json.dumps(text))
    assert found["plain"] == (320, 200, pytest.approx(math.pi / 2))
    assert found["wide"] == (320, 200, pytest.approx(math.radians(120)))
    assert set(parse_airsim_settings(json.dumps(text), "b")) == {"other"}
    with pytest.raises(CalibrationError, match="Width is 0, not a number of pixels"):
        parse_airsim_settings(json.dumps({"CameraDefaults": {"CaptureSettings": [{"Width": 0}]}}))


def test_settings_json_is_a_calibration_file(tmp_path):
    file = tmp_path / "settings.json"
    file.write_text(told(90.0, 512, 512))
    model = read_calibration(file)
    assert (model.width, model.height, model.fx, model.fy, model.cx) == pytest.approx((512, 512, 256, 256, 256))
    with pytest.raises(CalibrationError, match="no camera down; there are front_center"):
        read_calibration(file, "down")


def test_each_answer_of_the_stand_in_names_what_it_follows():
    sources = yaml.safe_load((Path(__file__).parent / "airsim_standin_sources.yaml").read_text())
    answers = {name.removeprefix("do_") for name in dir(StandIn) if name.startswith("do_")}
    assert set(sources) == answers | {"protocol", "error"}
    assert all(each["source"] for each in sources.values())
