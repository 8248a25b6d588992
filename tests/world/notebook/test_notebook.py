"""quadsim's notebook with its own names, and what its camera did not do."""

import json
import re
from pathlib import Path

import numpy as np
import pytest

from world.notebook import Camera, Quadrotor, Sensor, SensorManager, rot3d
from world.optics import FisheyeModel, preset_lens

DATA = Path(__file__).parents[2] / "data" / "sensors"
TABLE, PROJECTIONS, DECIMATIONS = (
    json.loads((DATA / f"quadsim_{name}.json").read_text()) for name in ("table", "projection", "decimation")
)
PRINTED = """\
[[ 554.238  300.000]]
[[ 554.238  300.000]]
[[ 554.238  300.000]]
[[ 554.189  299.589]]
[[ 554.189  299.589]]
[[ 554.189  299.589]]
[[ 554.140  299.178]]
[[ 554.140  299.178]]
[[ 554.140  299.178]]
[[ 554.090  298.768]]
"""


def target_tick(capture, n, Ts):
    f = 0.01
    x = 10 * np.sin(2 * np.pi * f * n * Ts)
    y = 5 * np.cos(2 * np.pi * f * n * Ts)
    return np.array([[x, y, 0]]).T


def column(*numbers):
    return np.array([numbers], dtype=float).T


def quad_above():
    return Quadrotor(r=column(-30, 0, -30), v=column(0, 0, 0), Phi=column(0, 0, 0))


class Still:
    def __init__(self, points):
        self.points = np.array(points, dtype=float).T

    def tick(self, capture, n, Ts):
        return self.points


def test_the_notebook_prints_its_table(capsys):
    camera = Camera(tick=target_tick, fidelity="original")
    camera.set_transformation(R=rot3d(45, 0, 90))
    quad = quad_above()
    with np.printoptions(formatter={"float_kind": "{: 0.3f}".format}):
        for i in range(10):
            x = camera.read(quad, i, 0.01)
            print(x.T)
    assert capsys.readouterr().out == PRINTED


def test_the_table_to_nine_digits():
    camera = Camera(TABLE["fps"], TABLE["size"], TABLE["hfovd"], tick=target_tick, fidelity="original")
    turn = rot3d(*TABLE["R_args_deg"])
    camera.set_transformation(R=turn)
    np.testing.assert_allclose(turn, TABLE["rot3d_45_0_90"], atol=1e-12)
    found = [camera.read(quad_above(), n, TABLE["Ts"]).ravel() for n in range(10)]
    np.testing.assert_allclose(found, TABLE["rows"], atol=1e-8)


@pytest.mark.parametrize("case", PROJECTIONS)
def test_projections(case):
    given, turn = case["in"], rot3d(*case["in"]["mount_deg"])
    quad = Quadrotor(r=column(*given["r"]), Phi=column(*given["Phi"]))
    for fidelity in ("original", "physical"):
        camera = Camera(30, given["size"], given["hfovd"], tick=lambda *_: np.array(given["P"]), fidelity=fidelity)
        camera.set_transformation(R=turn)
        found, expected = camera.read(quad, 0, 0.01), np.array(case["px"])
        if fidelity == "physical":
            assert camera.visible.tolist() == case["visible"]
            expected = expected[:, case["visible"]]
        np.testing.assert_allclose(found, expected, rtol=1e-8, atol=1e-6)


@pytest.mark.parametrize("case", DECIMATIONS)
def test_the_original_takes_a_picture_in_every_so_many_steps(case):
    camera = Camera(case["fps"], tick=target_tick, fidelity="original")
    fresh = []
    for n in range(3 * case["every"]):
        camera.read(quad_above(), n, case["Ts"])
        fresh.append(camera.fresh)
    assert np.flatnonzero(fresh).tolist() == [0, case["every"], 2 * case["every"]]


def test_the_original_counts_only_steps_with_points_and_repeats_its_reading():
    camera = Camera(30, tick=lambda capture, n, Ts: target_tick(capture, n, Ts) if n % 2 else None, fidelity="original")
    readings = [camera.read(quad_above(), n, 0.01) for n in range(8)]
    assert [reading is None for reading in readings] == [True, False] * 4
    assert readings[1] is readings[3] is readings[5]
    assert readings[7] is not readings[5]


def test_the_original_takes_one_in_every_step_if_steps_are_long():
    camera = Camera(30, tick=target_tick, fidelity="original")
    for n in range(3):
        camera.read(quad_above(), n, 0.1)
        assert camera.fresh


def test_pictures_come_as_often_as_asked_for():
    captures = []
    camera = Camera(30, tick=lambda capture, n, Ts: captures.append(capture) or np.zeros((3, 1)))
    for n in range(1000):
        camera.read(quad_above(), n, 0.01)
        assert camera.fresh == captures[-1]
    assert sum(captures) == 300


def test_the_translation_moves_the_picture():
    points = [[-30.0, 2.0, -20.0]]
    camera = Camera(tick=Still(points).tick)
    down = rot3d(0, 0, 90)
    camera.set_transformation(t=[[0.5], [0.25], [1.0]], R=down)
    u, v = camera.read(quad_above(), 0, 0.01).ravel()
    # 10 m below the vehicle and 2 m to the right; the camera is 1 m lower, 0.25 m to the right, 0.5 m ahead
    assert u == pytest.approx(400 + camera.f_px * 1.75 / 9.0)
    assert v == pytest.approx(300 + camera.f_px * 0.5 / 9.0)


def test_what_is_not_in_the_picture_is_left_out_and_reported():
    ahead = [0.0, 0.0, 10.0]
    points = [ahead, [0.0, 0.0, -10.0], [9.0, 0.0, 10.0], [0.0, 0.0, 0.0], [np.nan, 0.0, 5.0], ahead]
    camera = Camera(tick=Still(points).tick)
    found = camera.read(Quadrotor(), 0, 0.01)
    assert found.tolist() == [[400.0, 400.0], [300.0, 300.0]]
    assert camera.visible.tolist() == [True, False, False, False, False, True]
    nothing = Camera(tick=Still(points[1:2]).tick).read(Quadrotor(), 0, 0.01)
    assert nothing.shape == (2, 0)


def test_noise_is_as_asked_for_and_the_same_for_points_beside_hidden_ones():
    def pixels(points, **options):
        return Camera(tick=Still(points).tick, pxnoise=0.5, **options).read(Quadrotor(), 0, 0.01)

    many = [[0.0, 0.0, 10.0]] * 4000
    assert np.std(pixels(many) - [[400], [300]]) == pytest.approx(0.5, rel=0.05)
    assert pixels(many).tolist() == pixels(many).tolist() != pixels(many, seed=1).tolist()
    hidden = [[0.0, 0.0, -10.0], *many[1:]]
    assert pixels(hidden).tolist() == pixels(many)[:, 1:].tolist()


def test_any_lens():
    lens = FisheyeModel(400, 300, 100.0, 100.0, 200.0, 150.0, preset_lens("equidistant", np.radians(180)))
    camera = Camera(tick=Still([[1.0, 0.0, 1.0]]).tick, optics=lens)
    np.testing.assert_allclose(camera.read(Quadrotor(), 0, 0.01).ravel(), [200 + 100 * np.pi / 4, 150])


def test_features_are_shown_together():
    camera = Camera()
    assert camera.read(Quadrotor(), 0, 0.01) is None
    camera.register_feature(Still([[0.0, 0.0, 10.0]]))
    camera.register_feature(Still([[1.0, 0.0, 10.0], [0.0, 1.0, 10.0]]))
    assert camera.read(Quadrotor(), 4, 0.01).shape == (2, 3)


@pytest.mark.parametrize(
    ("wrong", "said"),
    [
        ({"hfovd": 0}, "0° is not between"),
        ({"hfovd": 180}, "180° is not"),
        ({"hfovd": np.nan}, "nan° is not"),
        ({"size": (0, 600)}, "0 x 600 px has no pixels"),
        ({"size": (800,)}, "is not width and height"),
        ({"fps": 0}, "fps is 0"),
        ({"pxnoise": -1}, "-1 px is negative"),
        ({"fidelity": "true"}, "'true' is not one of physical, original"),
    ],
)
def test_impossible_cameras(wrong, said):
    with pytest.raises(ValueError, match=said):
        Camera(**wrong)


@pytest.mark.parametrize("turn", [np.zeros((3, 3)), np.eye(2), np.diag([1.0, 1.0, -1.0])])
def test_impossible_mounts(turn):
    with pytest.raises(ValueError, match="not a rotation"):
        Camera().set_transformation(R=turn)
    with pytest.raises(ValueError, match="t has 2 numbers"):
        Camera().set_transformation(t=[1, 2])


@pytest.mark.parametrize("shape", [(2, 2), (3,)])
def test_points_of_a_wrong_shape_are_reported(shape):
    with pytest.raises(ValueError, match=re.escape(f"shape {shape} instead of (3, N)")):
        Camera(tick=lambda capture, n, Ts: np.zeros(shape)).read(Quadrotor(), 0, 0.01)


class Broken(Sensor):
    def read(self, quad, n, Ts):
        raise RuntimeError("no power")


def test_a_packet_has_all_readings_in_order():
    manager = SensorManager()
    for sensor in (Camera(), Sensor("Radar"), Camera(name="Second", tick=target_tick)):
        manager.register(sensor)
    packet = manager.get_data_packet(quad_above(), 0, 0.01)
    assert list(packet) == ["Camera", "Radar", "Second"]
    assert packet["Camera"] is None
    assert packet["Radar"] == 0
    assert str(manager.sensors[1]) == "Radar"


def test_equal_names_and_broken_sensors_are_named():
    manager = SensorManager()
    manager.register(Broken("Radar"))
    with pytest.raises(ValueError, match="'Radar' already"):
        manager.register(Sensor("Radar"))
    with pytest.raises(RuntimeError) as caught:
        manager.get_data_packet(Quadrotor(), 7, 0.01)
    assert caught.value.__notes__ == ["sensor 'Radar', step 7"]
