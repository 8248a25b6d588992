"""A rectangular fence is the area of OperationalLimits; anything else is refused."""

import contextlib
import math

import pytest
from hypothesis import given
from hypothesis import strategies as st
from mission_samples import GARBAGE, LAT, LON, NAN, X, Y, fence_corner, packed

import imc
from autonomy.plans import PlanBounds, PlanGraph, PlanNode, area_violations
from mavlink.missions import BadItem, MissionCommand, MissionResult, fence_items, limits_with_fence
from support.wgs84 import displace, displacement

R = MissionResult
AREA = imc.OpLimitsMask.AREA


def polygon(*offsets):
    """A fence with corners north and east (m) of home."""
    places = [displace(LAT, LON, 0.0, north, east) for north, east in offsets]
    return [fence_corner(*(round(math.degrees(angle) * 1e7) for angle in place[:2])) for place in places]


def refusal(items):
    with pytest.raises(BadItem) as caught:
        limits_with_fence(items)
    return caught.value.seq, caught.value.result, str(caught.value)


def test_a_rectangle_is_an_area():
    limits = limits_with_fence(
        polygon((-50, -20), (150, -20), (150, 20), (-50, 20)), imc.OperationalLimits(mask=1, max_depth=9)
    )
    north, east, _ = displacement(LAT, LON, 0.0, limits.lat, limits.lon, 0.0)
    assert (north, east) == pytest.approx((50.0, 0.0), abs=0.02)
    assert (limits.length, limits.width) == pytest.approx((200.0, 40.0), abs=0.03)
    assert limits.orientation == pytest.approx(0.0, abs=1e-3)
    assert (limits.mask, limits.max_depth) == (1 | AREA, 9.0)


def test_a_plan_stays_inside_the_same_rectangle():
    """Turned by 30° and drawn counterclockwise."""
    c, s = math.cos(math.radians(30)), math.sin(math.radians(30))
    corners = [(-50, 20), (150, 20), (150, -20), (-50, -20)]
    limits = limits_with_fence(polygon(*((c * x - s * y, s * x + c * y) for x, y in corners)))
    for x, y, inside in ((149, 19, True), (-49, -19, True), (151, 0, False), (0, 21, False), (-51, 0, False)):
        lat, lon, _ = displace(LAT, LON, 0.0, c * x - s * y, s * x + c * y)
        graph = PlanGraph(imc.PlanSpecification(), {"m": PlanNode("m", imc.Goto(lat=lat, lon=lon), (), ())}, "m")
        assert (not list(area_violations(graph, PlanBounds(limits)))) is inside


@given(
    lat=st.floats(-1.4, 1.4),
    lon=st.floats(-3.1, 3.1),
    orientation=st.floats(-3, 3, width=32),
    length=st.floats(5, 3000, width=32),
    width=st.floats(5, 3000, width=32),
)
def test_an_area_comes_back(lat, lon, orientation, length, width):
    limits = imc.OperationalLimits(
        mask=AREA | 2, lat=lat, lon=lon, orientation=orientation, length=length, width=width, min_altitude=3.0
    )
    items = fence_items(limits)
    again = limits_with_fence(items, limits.replace(mask=2, lat=0.0, lon=0.0))
    assert (again.mask, again.min_altitude) == (AREA | 2, 3.0)
    north, east, _ = displacement(lat, lon, 0.0, again.lat, again.lon, 0.0)
    assert math.hypot(north, east) < 0.02
    assert (again.length, again.width) == pytest.approx((length, width), abs=0.03)
    assert abs(math.remainder(again.orientation - orientation, math.tau)) * length < 0.05
    for one, other in zip(fence_items(again), items, strict=True):  # to the rounding of items
        assert abs(one.x - other.x) <= 2
        assert abs(one.y - other.y) * math.cos(lat) <= 2


def test_no_fence_is_no_area():
    limits = imc.OperationalLimits(mask=AREA | 1, max_depth=9, lat=LAT, length=100.0, width=100.0)
    assert limits_with_fence([], limits) == imc.OperationalLimits(mask=1, max_depth=9)
    assert limits_with_fence([]) == imc.OperationalLimits()
    assert fence_items(imc.OperationalLimits(mask=1)) == []
    assert fence_items(limits.replace(length=NAN)) == []
    assert fence_items(limits.replace(width=0.0)) == []


def test_a_box_of_meridians_is_a_rectangle():
    """What a console draws, 3 km wide."""
    box = [fence_corner(x, y) for x, y in ((X, Y), (X + 270_000, Y), (X + 270_000, Y + 357_000), (X, Y + 357_000))]
    assert limits_with_fence(box).length == pytest.approx(2999, abs=5)
    assert packed(fence_items(limits_with_fence(box))) != packed(box)  # but no exact one


SQUARE = polygon((0, 0), (100, 0), (100, 100), (0, 100))
ADVICE = "the only fence is one inclusion polygon, a rectangle"
VERTEX = "NAV_FENCE_POLYGON_VERTEX_INCLUSION"


@pytest.mark.parametrize(
    ("items", "seq", "result", "reason"),
    [
        (polygon((0, 0), (100, 0), (100, 110), (0, 100)), 3, R.INVALID,
         f"({VERTEX}): the polygon is off a rectangle by 4.0 m; {ADVICE}"),
        (polygon((0, 0), (100, 30), (100, 130), (0, 100)), 3, R.INVALID,
         f"({VERTEX}): the polygon is off a rectangle by 11.3 m; {ADVICE}"),
        (polygon((0, 0), (100, 100), (100, 0), (0, 100)), 3, R.INVALID,
         f"({VERTEX}): a fence of 100.0 m by 0.0 m is too small"),
        (SQUARE[:3], 2, R.INVALID, f"({VERTEX}): is the last of 3 corners; {ADVICE}"),
        ([*SQUARE, SQUARE[0]], 4, R.NO_SPACE, f"({VERTEX}): is corner 5; {ADVICE}"),
        ([fence_corner(X, Y, param1=5.0)], 0, R.INVALID_PARAM1, f"({VERTEX}): its polygon has 5 corners; {ADVICE}"),
        ([fence_corner(X, Y, param1=NAN)], 0, R.INVALID_PARAM1, f"({VERTEX}): its polygon has nan corners; {ADVICE}"),
        ([*SQUARE[:3], SQUARE[3]._replace(x=910_000_000)], 3, R.INVALID_PARAM5_X,
         f"({VERTEX}): latitude 910000000 is out of range; it counts 1e-7 degrees"),
        ([*SQUARE[:3], SQUARE[3]._replace(y=-1_810_000_000)], 3, R.INVALID_PARAM6_Y,
         f"({VERTEX}): longitude -1810000000 is out of range; it counts 1e-7 degrees"),
        ([SQUARE[0]._replace(frame=1)], 0, R.UNSUPPORTED_FRAME, f"({VERTEX}): frame 1 has no meaning for a fence"),
        ([fence_corner(X, Y, command=MissionCommand.NAV_FENCE_RETURN_POINT)], 0, R.UNSUPPORTED,
         "(NAV_FENCE_RETURN_POINT): the vehicle returns to no point of a fence"),
        ([fence_corner(X, Y, command=MissionCommand.NAV_FENCE_POLYGON_VERTEX_EXCLUSION)], 0, R.UNSUPPORTED,
         f"(NAV_FENCE_POLYGON_VERTEX_EXCLUSION): {ADVICE}"),
        ([fence_corner(X, Y, command=MissionCommand.NAV_FENCE_CIRCLE_INCLUSION)], 0, R.UNSUPPORTED,
         f"(NAV_FENCE_CIRCLE_INCLUSION): {ADVICE}"),
        ([fence_corner(X, Y, command=MissionCommand.NAV_RALLY_POINT, mission_type=2)], 0, R.UNSUPPORTED,
         "(NAV_RALLY_POINT): rally points are not supported"),
        ([fence_corner(X, Y, command=MissionCommand.NAV_WAYPOINT)], 0, R.UNSUPPORTED,
         "(NAV_WAYPOINT): is not part of a fence"),
        ([fence_corner(X, Y, mission_type=0)], 0, R.UNSUPPORTED, f"({VERTEX}): is not part of a fence"),
    ],
    ids=lambda value: value if isinstance(value, str) else "",
)  # fmt: skip
def test_other_fences_are_refused(items, seq, result, reason):
    assert refusal(items) == (seq, result, f"item {seq} {reason}")


@given(st.lists(GARBAGE, max_size=5), st.booleans())
def test_any_items_are_an_area_or_refused(items, fenced):
    if fenced:
        items = [
            i._replace(frame=0, command=5001, param1=4.0, mission_type=1, x=i.x % 10**9, y=i.y % 10**9) for i in items
        ]
    limits = imc.OperationalLimits()
    with contextlib.suppress(BadItem):
        limits = limits_with_fence(items)
    assert imc.decode(imc.encode(limits)) == limits


FIGURES = st.floats(width=32)


@given(st.builds(imc.OperationalLimits, mask=st.just(64), lat=FIGURES, lon=FIGURES, orientation=FIGURES,
                 length=FIGURES, width=FIGURES))  # fmt: skip
def test_any_limits_have_a_fence_or_none(limits):
    for item in fence_items(limits):
        assert max(2 * abs(item.x), abs(item.y)) <= 1_800_000_000
