"""Shapes that are drawn on the page become a plan as text; what is no shape is named."""

import json
import math

import pytest

from shoal.console.plans.drawn_plan import drawn_plan_text
from shoal.console.plans.plan_path import plan_path
from shoal.missions import parse_plan

POINT = {"kind": "goto", "places": [[41.0, -8.0]], "reference": "depth", "z": 2, "speed": 1, "radius": 15}
POINT |= {"seconds": 60, "spacing": 10}
DEGREE = 111_050.0  # m of latitude


def rows(north: float) -> dict:
    """100 m to the east, with the far side some meters north of the end."""
    east = 100.0 / (DEGREE * math.cos(math.radians(41.0))) - 8.0
    return POINT | {"kind": "rows", "places": [[41.0, -8.0], [41.0, east], [41.0 + north / DEGREE, east]]}


@pytest.mark.parametrize(("north", "is_right"), [(40.0, False), (-40.0, True)])
def test_rows_go_along_the_first_one_to_the_far_side(north, is_right):
    (item,) = parse_plan(drawn_plan_text("rows", [rows(north)])).maneuvers
    assert item.data.bearing == pytest.approx(math.pi / 2, abs=1e-3)
    assert item.data.length == pytest.approx(100.0, abs=0.5)
    assert item.data.width == pytest.approx(40.0, abs=0.2)
    assert bool(item.data.flags & 2) is is_right
    places = [place for leg in plan_path(parse_plan(drawn_plan_text("rows", [rows(north)]))) for place in leg["places"]]
    assert max(places)[0] - min(places)[0] == pytest.approx(40.0 / DEGREE, rel=0.3)


def test_each_shape_has_its_reference_speed_and_radius():
    loiter = POINT | {"kind": "loiter", "reference": "altitude", "speed": 0.7}
    station = POINT | {"kind": "station_keeping", "reference": "height", "seconds": 5}
    plan = parse_plan(drawn_plan_text('a "name": x', [POINT, loiter, station]))
    assert plan.plan_id == 'a "name": x'
    first, second, third = (item.data for item in plan.maneuvers)
    assert [type(each).__name__ for each in (first, second, third)] == ["Goto", "Loiter", "StationKeeping"]
    assert (second.z_units, second.speed, second.radius, second.duration) == (2, pytest.approx(0.7), 15.0, 60)
    assert (third.z_units, third.duration) == (3, 5)


def test_a_place_of_a_map_that_was_turned_around_the_earth_is_on_it():
    text = drawn_plan_text("far", [POINT | {"places": [[41.0, 352.0]]}])
    assert "lon: -8.0000000°" in text


@pytest.mark.parametrize(
    ("change", "words"),
    [
        ({"kind": "<img>"}, "shape 1 is of no known kind"),
        ({"kind": ["goto"]}, "shape 1 is of no known kind"),
        ({"reference": "z: 1}"}, "shape 1 is of no known kind or reference"),
        ({"places": [[91.0, 0.0]]}, "latitude and a longitude in degrees"),
        ({"places": [["41", None]]}, "latitude and a longitude in degrees"),
        ({"places": []}, "shape 1 has 1 place"),
        ({"z": "2}\n- abort: {"}, "its z is no number"),
        ({"speed": True}, "its speed is no number"),
    ],
)
def test_what_is_no_shape_is_named(change, words):
    with pytest.raises(ValueError, match=words):
        drawn_plan_text("bad", [POINT | change])


def test_a_plan_has_a_name_and_not_too_many_shapes():
    for name, shapes in ((None, []), ("x", {}), ("x", [7]), ("x", [POINT] * 501)):
        with pytest.raises(ValueError, match="shape"):
            drawn_plan_text(name, json.loads(json.dumps(shapes)))
