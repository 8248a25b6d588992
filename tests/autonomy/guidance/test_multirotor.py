"""Velocity and heading of a multirotor on its path."""

import math

import pytest

import imc
from autonomy.guidance import Circle, Line, MotionLimits, MultirotorGuidance, MultirotorGuidanceGains

GAINS = MultirotorGuidanceGains(near_radius=1.5, takeoff_tolerance=0.5, landing_rate=0.5, landing_altitude=5.0)
LIMITS = MotionLimits(speed=5.0, climb=2.0, descent=1.0, acceleration=2.0, gain=0.8)
EAST = Line((0.0, 0.0, -10.0), (0.0, 100.0, -10.0))


def at(north, east, down=-10.0, **fields):
    return imc.EstimatedState(x=north, y=east, z=down, alt=-down, **fields)


def led(line=EAST, circle=None, heading=0.3, **kinds):
    guidance = MultirotorGuidance(GAINS)
    guidance.begin(line, circle, heading, **kinds)
    return guidance


def test_a_line_gives_velocity_heading_and_progress():
    guidance = led()
    assert guidance.step(at(0.0, 50.0), LIMITS) == pytest.approx((0.0, 5.0, 0.0))
    assert guidance.heading == pytest.approx(0.5 * math.pi)
    where = guidance.progress(at(-2.0, 40.0, vy=3.0))
    assert (where.x, where.y, where.left) == pytest.approx((40.0, 2.0, 60.0))
    assert (where.vx, where.course) == pytest.approx((3.0, 0.5 * math.pi))
    assert guidance.eta(where, 5.0) == pytest.approx(12.0)
    assert guidance.eta(where, 0.0) == pytest.approx(300.0)


def test_it_is_near_within_the_radius_but_not_on_the_ground_and_stays_so():
    guidance = led()
    guidance.step(at(0.0, 99.0), LIMITS, stands=True)
    assert not guidance.near
    guidance.step(at(0.0, 99.0), LIMITS)
    guidance.step(at(0.0, 90.0), LIMITS)
    assert guidance.near
    assert guidance.eta(guidance.progress(at(0.0, 90.0)), 5.0) == 0.0


def test_a_climb_keeps_its_heading_and_a_takeoff_needs_its_height():
    climb = Line((0.0, 0.0, 0.0), (0.0, 0.0, -10.0))
    guidance = led(climb, takes_off=True)
    assert guidance.step(at(0.0, 0.0, -5.0), LIMITS) == pytest.approx((0.0, 0.0, -2.0))
    guidance.step(at(0.0, 0.0, -9.2), LIMITS)
    assert (guidance.near, guidance.heading) == (False, 0.3)
    guidance.step(at(0.0, 0.0, -9.6), LIMITS)
    assert guidance.near


def test_a_landing_descends_at_its_end_slowly_near_the_ground_until_it_stands():
    guidance = led(lands=True)
    guidance.step(at(0.0, 50.0), LIMITS)
    assert not guidance.landing
    assert guidance.step(at(0.0, 100.0), LIMITS) == pytest.approx((0.0, 0.0, 1.0))
    assert guidance.step(at(0.0, 100.5, -4.0), LIMITS) == pytest.approx((0.0, -0.4, 0.5))
    assert guidance.progress(at(0.0, 100.0, -4.0)).left == 4.0
    assert (guidance.landing, guidance.near) == (True, False)
    guidance.step(at(0.0, 100.0, 0.0), LIMITS, stands=True)
    assert guidance.near


def test_a_circle_is_loitered_on_ahead():
    guidance = led(EAST, Circle(EAST.end, 20.0))
    guidance.step(at(0.0, 50.0), LIMITS)
    assert not guidance.loitering
    assert guidance.progress(at(0.0, 50.0)).left == pytest.approx(30.0)
    guidance.step(at(20.0, 100.0), LIMITS)
    assert (guidance.loitering, guidance.near) == (True, False)
    assert guidance.heading == pytest.approx(0.5 * math.pi)
    higher = led(EAST, Circle(EAST.end, 20.0))
    higher.step(at(20.0, 100.0, -13.0), LIMITS)
    assert not higher.loitering


def test_a_path_may_move_on_the_way():
    guidance = led()
    guidance.step(at(0.0, 99.0), LIMITS)
    guidance.update_path_coordinates(Line((0.0, 0.0, -20.0), (0.0, 100.0, -20.0)), None)
    assert guidance.near
    assert guidance.step(at(0.0, 50.0), LIMITS)[2] == pytest.approx(-2.0)


def test_what_is_not_a_number_is_not_hidden():
    assert math.isnan(led().step(at(math.nan, 0.0), LIMITS)[0])
