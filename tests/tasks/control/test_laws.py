"""The parts of control without a bus: loops, control laws, fins, tracks, divergence."""

import math

import pytest
from hypothesis import given
from hypothesis import strategies as st

import imc
from autonomy.control.pid import PID
from tasks.control.auv.fins import allocate, torques
from tasks.control.auv.vertical import Bottom
from tasks.control.loops import EnabledLoops
from tasks.control.path.bottom import BottomGuard
from tasks.control.path.divergence import AlongTrack, CrossTrack, Divergence
from tasks.control.path.track import Track, progress

Mask = imc.CLoopsMask
EFFECTS = (0.25, 0.5, 0.5)
LIMIT = math.radians(25.0)


def loops(enable, mask, scope):
    return imc.ControlLoops(enable=enable, mask=mask, scope_ref=scope)


def test_loops_are_enabled_and_disabled():
    tested = EnabledLoops(Mask.YAW | Mask.DEPTH)
    assert tested.hear(loops(1, Mask.YAW | Mask.SPEED, 1))
    assert tested.mask == Mask.YAW
    assert not tested.hear(loops(1, Mask.YAW, 1))
    assert tested.hear(loops(0, Mask.ALL, 2))
    assert tested.mask == 0


def test_loops_of_an_older_scope_come_too_late():
    tested = EnabledLoops(Mask.YAW)
    assert tested.hear(loops(1, Mask.YAW, 5))
    assert not tested.hear(loops(0, Mask.ALL, 4))
    assert tested.mask == Mask.YAW


def test_the_integral_is_that_of_the_steps_before():
    law = PID((2.0, 1.0, 0.5))
    assert law.step(0.1, 1.0, 0.2) == pytest.approx(2.1)
    assert law.step(0.1, 1.0, 0.0) == pytest.approx(2.1)
    assert (law.p, law.i, law.d) == (pytest.approx(2.0), pytest.approx(0.1), 0.0)


def test_the_integral_rests_at_the_limit_and_stays_within_its_own():
    law = PID((1.0, 1.0, 0.0), limit=0.5)
    for _ in range(100):
        assert law.step(0.1, 1.0) == 0.5
    assert law.step(0.1, -0.1) == pytest.approx(-0.1)
    bounded = PID((0.0, 1.0, 0.0), integral_limit=0.2)
    for _ in range(100):
        bounded.step(0.1, 1.0)
    assert bounded.step(0.1, 1.0) == pytest.approx(0.2)


SMALL = st.floats(-0.05, 0.05)
ANY = st.floats(-10.0, 10.0)


@given(SMALL, SMALL, SMALL)
def test_small_torques_are_what_the_fins_give(k, m, n):
    assert torques(allocate((k, m, n), EFFECTS, LIMIT), EFFECTS) == pytest.approx((k, m, n), abs=1e-12)


@given(ANY, ANY, ANY, st.sampled_from([0.0, 0.8 * LIMIT]))
def test_no_fin_goes_beyond_its_limit_and_pitch_and_yaw_come_first(k, m, n, crossed):
    fins = allocate((k, m, n), EFFECTS, LIMIT, crossed)
    assert all(abs(fin) <= LIMIT + 1e-12 for fin in fins)
    _, pitch, yaw = torques(fins, EFFECTS)
    free = LIMIT - crossed
    assert pitch == pytest.approx(max(-free, min(free, m)), abs=1e-12)
    assert yaw == pytest.approx(0.0 if crossed else max(-free, min(free, n)), abs=1e-12)


def test_a_brake_crosses_the_fins_without_any_torque():
    fins = allocate((0.0, 0.0, 0.0), EFFECTS, LIMIT, 0.8 * LIMIT)
    assert {round(abs(fin), 12) for fin in fins} == {round(0.8 * LIMIT, 12)}
    assert torques(fins, EFFECTS) == pytest.approx((0.0, 0.0, 0.0), abs=1e-12)


def test_where_a_vehicle_is_on_a_track():
    track = Track((0.0, 0.0), (0.0, 100.0))
    where = progress(track, (-3.0, 40.0), 2.0, 0.5 * math.pi, 0.0)
    assert (where.x, where.y, where.left) == pytest.approx((40.0, 3.0, 60.0))
    assert (where.vx, where.vy) == pytest.approx((2.0, 0.0))
    assert where.eta(5.0, 0.1) == pytest.approx(math.hypot(60.0, 3.0) / 2.0 - 5.0)


def test_a_point_that_is_passed_at_the_side_is_reached():
    where = progress(Track((0.0, 0.0), (100.0, 0.0)), (99.0, 8.0), 1.5, 0.0, 0.0)
    assert where.eta(5.0, 0.1) <= 0.0


@pytest.mark.parametrize(("side", "east"), [(1, -20.0), (-1, 20.0)])
def test_a_circle_is_approached_with_its_centre_at_the_inside(side, east):
    tangent = Track((0.0, 0.0), (100.0, 0.0), 20.0, side).tangent()
    assert tangent.end == pytest.approx((100.0, east))


def at(left=100.0, y=0.0, course=0.0):
    return progress(Track((0.0, 0.0), (200.0, 0.0)), (200.0 - left, y), 1.0, course, course)


def test_no_progress_twice_is_a_divergence():
    watch = Divergence(AlongTrack(20.0, 0.05, math.radians(2.0)), None)
    watch.restart(0.0)
    found = [watch.error(float(t), at(), 0.0, 0.0) for t in range(61)]
    assert found.index("along-track divergence error") == 40


def test_progress_and_turning_are_none():
    watch = Divergence(AlongTrack(20.0, 0.05, math.radians(2.0)), None)
    watch.restart(0.0)
    assert not any(watch.error(float(t), at(left=100.0 - 0.1 * t), 0.0, 0.0) for t in range(200))
    watch.restart(200.0)
    turning = (at(course=math.pi - math.radians(2.1) * t) for t in range(40))
    assert not any(watch.error(200.0 + t, where, 0.0, 0.0) for t, where in enumerate(turning))


def test_too_far_from_the_track_for_too_long_is_a_divergence_but_not_within_the_uncertainty():
    watch = Divergence(None, CrossTrack(25.0, 20.0))
    watch.restart(10.0)
    found = [watch.error(float(t), at(y=-30.0), 0.0, 0.0) for t in range(40)]
    assert found.index("cross-track divergence error") == 30
    watch.restart(0.0)
    assert not any(watch.error(float(t), at(y=-30.0), 0.0, 10.0) for t in range(100))


def test_a_bottom_that_rises_is_avoided_until_it_falls():
    guard = BottomGuard(2.5)
    assert not guard.watch(3.0, 3.0, 4.0)
    assert guard.watch(3.0, 3.0, 2.4)
    assert guard.active
    assert not guard.watch(3.0, 2.0, 2.5)
    assert not guard.watch(3.0, 2.0, -1.0)
    assert not guard.watch(3.0, 2.9, 2.7)
    assert guard.watch(3.0, 2.9, 3.2)
    assert not guard.active


def test_the_surface_is_never_too_deep():
    assert not BottomGuard(2.5).watch(0.0, 0.1, 1.0)


def test_the_bottom_follows_from_altitude_and_depth_and_stays_where_it_was_seen():
    bottom = Bottom([])
    assert (bottom.depth, bottom.is_known) == (math.inf, False)
    bottom.see(7.0, 3.0, 0.05)
    assert (bottom.depth, bottom.rate, bottom.is_known) == (10.0, 0.0, True)
    bottom.see(6.9, 3.0, 0.05)
    assert (bottom.depth, bottom.rate) == (pytest.approx(9.9), pytest.approx(-2.0))
    bottom.see(6.9, 4.0, 0.05)
    assert bottom.depth == pytest.approx(9.9), "the altitude is an old one"
    for unknown in (-1.0, math.nan, math.inf):
        bottom.see(unknown, 5.0, 0.05)
        assert (bottom.depth, bottom.rate, bottom.is_known) == (pytest.approx(9.9), 0.0, False)
    bottom.see(6.9, 13.1, 0.05)
    assert (bottom.depth, bottom.rate, bottom.is_known) == (20.0, 0.0, True)


def test_the_bottom_is_smoothed():
    bottom = Bottom([1.0, 2.0, 1.0])
    bottom.see(5.0, 5.0, 0.05)
    assert bottom.depth == pytest.approx(10.0)
    bottom.see(9.0, 5.0, 0.05)
    assert bottom.depth == pytest.approx(11.0)
    bottom.see(-1.0, 5.0, 0.05)
    bottom.see(15.0, 5.0, 0.05)
    assert bottom.depth == pytest.approx(20.0), "what was before it was lost does not count"
