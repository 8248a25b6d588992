"""Headings along tracks and around circles, by both laws."""

import math

import pytest

import imc
from autonomy.guidance import (
    PurePursuitGains,
    PurePursuitLaw,
    Track,
    TrackGuidance,
    TrackGuidanceGains,
    VectorFieldGains,
    VectorFieldLaw,
    progress,
)

FIELD = VectorFieldLaw(VectorFieldGains(corridor_width=5.0, entry_angle=math.radians(15.0)))
PURSUIT = PurePursuitLaw(PurePursuitGains(lookahead=5.0))
NORTH = Track((0.0, 0.0), (100.0, 0.0))


def moving(north, east, psi=0.0, speed=1.0, course=None):
    course = psi if course is None else course
    vx, vy = speed * math.cos(course), speed * math.sin(course)
    return imc.EstimatedState(x=north, y=east, psi=psi, u=speed, vx=vx, vy=vy)


def guide(track, law=FIELD, **gains):
    guidance = TrackGuidance(TrackGuidanceGains(**gains), law)
    guidance.begin(track)
    return guidance


def test_the_field_leads_along_its_track_and_in_at_the_entry_angle():
    def at(y):
        return FIELD.line_course(progress(NORTH, (50.0, y), 1.0, 0.0, 0.0), 0.0)

    assert at(0.0) == 0.0
    assert math.degrees(at(5.0)) == pytest.approx(-15.0)
    assert math.degrees(at(-5.0)) == pytest.approx(15.0)
    assert -0.5 * math.pi < at(1e9) < math.radians(-89.0)


@pytest.mark.parametrize("law", [FIELD, PURSUIT])
@pytest.mark.parametrize("side", [1, -1])
def test_a_circle_is_gone_around_on_its_side(law, side):
    south_of_center = law.circle_course(0.0, 20.0, 20.0, side)
    ahead = 0.5 * 5.0 / 20.0 if law is PURSUIT else 0.0  # a chord is half as steep as its arc
    assert math.remainder(south_of_center - side * (-0.5 * math.pi + ahead), 2.0 * math.pi) == pytest.approx(0.0)
    inward = math.remainder(law.circle_course(0.0, 40.0, 20.0, side), 2.0 * math.pi)
    assert abs(inward) < 0.5 * math.pi


def test_pursuit_steers_to_the_end():
    where = progress(NORTH, (50.0, 50.0), 1.0, 0.0, 0.0)
    assert PURSUIT.line_course(where, 0.0) == pytest.approx(math.radians(-45.0))


def test_on_its_track_a_vehicle_steers_its_bearing_and_counts_the_time():
    guidance = guide(NORTH)
    assert guidance.step(moving(50.0, 0.0)) == 0.0
    assert (guidance.eta, guidance.near) == (pytest.approx(45.0), False)
    assert (guidance.where.left, guidance.where.y) == (50.0, 0.0)


def test_drift_is_corrected_up_to_a_limit_and_not_at_a_standstill():
    assert guide(NORTH).step(moving(50.0, 0.0, 0.0, 1.0, 0.2)) == pytest.approx(-0.2)
    assert guide(NORTH).step(moving(50.0, 0.0, 0.0, 1.0, 2.0)) == pytest.approx(-math.radians(60.0))
    assert guide(NORTH).step(moving(50.0, 0.0, 0.0, 0.1, 2.0)) == 0.0
    assert guide(NORTH, controls_course=False).step(moving(50.0, 0.0, 0.0, 1.0, 0.2)) == 0.0


def test_headings_are_wrapped():
    south = guide(Track((0.0, 0.0), (-100.0, -1e-9)))
    heading = south.step(moving(-50.0, 1.0, -math.pi))
    assert -math.pi <= heading < math.pi
    assert math.cos(heading) < -0.9


def test_a_line_ends_near_its_end_and_a_circle_begins_at_its_tangent():
    guidance = guide(NORTH)
    guidance.step(moving(96.0, 0.0))
    assert (guidance.near, guidance.loitering) == (True, False)
    circle = guide(Track((0.0, 0.0), (100.0, 0.0), 20.0))
    circle.step(moving(50.0, 0.0))
    assert (circle.near, circle.loitering) == (False, False)
    circle.step(moving(99.0, -20.0))
    assert (circle.near, circle.loitering) == (False, True)
    assert circle.step(moving(100.0, -20.0)) == pytest.approx(0.0)


def test_past_the_end_it_steers_back():
    guidance = guide(NORTH, arrival_time=-100.0)
    assert abs(guidance.step(moving(110.0, 0.0))) == pytest.approx(math.pi)


def test_a_track_may_move_on_the_way():
    guidance = guide(NORTH)
    guidance.step(moving(96.0, 0.0))
    guidance.update_track_coordinates(Track((0.0, 10.0), (100.0, 10.0)))
    guidance.step(moving(50.0, 10.0))
    assert guidance.near
    assert guidance.where.y == pytest.approx(0.0)


def test_what_is_not_a_number_is_not_hidden():
    assert math.isnan(guide(NORTH).step(moving(math.nan, 0.0)))
