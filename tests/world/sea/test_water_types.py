"""Jerlov's types of water: what a camera makes of them."""

import math
from itertools import pairwise

import numpy as np
import pytest

from world import WorldError, read_world
from world.optics import FisheyeModel, preset_lens
from world.rendering import SceneCamera, ScenePose
from world.rendering.light.scene_colors import jerlov_water
from world.sea import WATER_TYPES, jerlov_colors, water_visibility
from world.sea.water_types import TABLE


def test_table_is_complete():
    rows = [line.split() for line in TABLE.strip().splitlines()]
    assert [float(n) for n in rows[0][1:]] == [425.0 + 25.0 * n for n in range(10)]
    assert {(row[0], row[1]) for row in rows[1:]} == {(kind, what) for kind in WATER_TYPES for what in ("a", "b", "Kd")}
    assert all(len(row) == 12 and min(map(float, row[2:])) > 0 for row in rows[1:])


def test_water_gets_murkier_from_type_to_type():
    """The oceanic types lose sight in order, and so do the coastal ones; light of day goes down less and less far."""
    for kinds in (WATER_TYPES[:5], WATER_TYPES[5:]):
        assert all(water_visibility(clear) > water_visibility(murky) for clear, murky in pairwise(kinds))
        assert all(
            (jerlov_colors(clear).daylight < jerlov_colors(murky).daylight).all() for clear, murky in pairwise(kinds)
        )
    assert water_visibility("I") == pytest.approx(71.4, abs=0.1)
    assert water_visibility("9C") == pytest.approx(1.08, abs=0.01)


def test_oceans_are_blue_and_coasts_are_green_and_then_brown():
    red, green, blue = np.array([jerlov_colors(kind).glow for kind in WATER_TYPES]).T
    assert (blue[:4] > 2 * green[:4]).all()
    assert green[6] > blue[6] > red[6]  # 3C
    assert green[9] > red[9] > blue[9]  # 9C


@pytest.mark.parametrize("kind", WATER_TYPES)
def test_direct_light_and_backscatter_have_their_own_coefficients(kind):
    """Both lie between the beam attenuation at the ends of the spectrum; in blue water, red differs the most."""
    colors = jerlov_colors(kind)
    rows = {tuple(row[:2]): np.array(row[2:], float) for row in map(str.split, TABLE.strip().splitlines()[1:])}
    beam = rows[kind, "a"] + rows[kind, "b"]
    for found in (colors.direct, colors.veil):
        assert (found > beam.min()).all()
        assert (found < beam.max()).all()
    assert np.abs(colors.direct / colors.veil - 1).max() > 0.01
    assert (colors.daylight > rows[kind, "Kd"].min()).all()


def test_red_differs_most_in_the_clearest_water():
    colors = jerlov_colors("I")
    assert colors.direct[0] > 1.3 * colors.veil[0]


def test_the_medium_is_that_of_the_equation():
    """I = J exp(-bD z) + B (1 - exp(-bB z))"""
    colors, water, distance = jerlov_colors("1C"), jerlov_water("1C"), np.array([[3.0]])
    np.testing.assert_allclose(water.transmission(distance)[:, 0, 0], np.exp(-3 * colors.direct), rtol=1e-6)
    np.testing.assert_allclose(water.glow_share_by_distance(distance)[:, 0, 0], 1 - np.exp(-3 * colors.veil), rtol=1e-6)


def test_pictures_show_the_type_of_water():
    optics = FisheyeModel.from_lens(preset_lens("equidistant", math.pi), 96)
    pose = ScenePose(0.0, 0.0, 3.0, 5.0, roll=math.pi / 2)
    far = {
        kind: SceneCamera(optics, 64, water=kind).take_picture(pose)[48, 48, :3].astype(int)
        for kind in ("I", "3C", "9C")
    }
    assert far["I"][2] > 1.5 * far["I"][1] > 2 * far["I"][0]
    assert far["3C"][1] > far["3C"][2]
    assert far["9C"][0] > far["9C"][2]


def options(**given):
    texts = {name.replace("_", " "): text for name, text in given.items()}
    return lambda section, option: texts.get(option, "") if section == "World" else ""


def test_a_profile_names_the_type():
    world = read_world(options(Water_Type="IB"))
    assert (world.water_type, world.water_visibility) == ("IB", water_visibility("IB"))
    assert read_world(options()).water_visibility == 60.0


@pytest.mark.parametrize(
    ("given", "text"),
    [
        ({"Water_Type": "4C"}, r"\[World\] Water Type = 4C is not one of .*I, IA, IB"),
        ({"Water_Type": "II", "Water_Visibility": "5"}, r"\[World\] Water Visibility = 5 .*Water Type II"),
        ({"Water_Visibility": "nan"}, r"\[World\] Water Visibility = nan"),
    ],
)
def test_bad_water_is_refused(given, text):
    with pytest.raises(WorldError, match=text):
        read_world(options(**given))


def test_an_unknown_type_is_named():
    with pytest.raises(ValueError, match="'4C' is no water type of I, IA"):
        jerlov_colors("4C")
