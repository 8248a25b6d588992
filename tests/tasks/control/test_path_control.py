"""The protocol of path control, with hand-made vehicle states."""

import math

import pytest

import imc
from runtime import State
from runtime.testing import simulate
from support.wgs84 import displace, displacement
from tasks.control.path.pure_pursuit import PurePursuit
from tasks.control.path.vector_field import VectorField
from tests.tasks.control.multirotor import enable

Loops = imc.CLoopsMask
Flags = imc.DesiredPath.Flags
Progress = imc.PathControlState.Flags
DEPTH, ALTITUDE = imc.ZUnits.DEPTH, imc.ZUnits.ALTITUDE
LAT, LON = math.radians(41.185), math.radians(-8.7062)
VEHICLE = {"corridor_width": 1.5, "entry_angle": 15.0}


def path(north, east, *, time=0.15, ref=1, flags=0, **fields):
    lat, lon, _ = displace(LAT, LON, 0.0, north, east)
    fields = {"end_z": 3.0, "end_z_units": DEPTH, "speed": 1.4} | fields
    return imc.DesiredPath(timestamp=time, path_ref=ref, end_lat=lat, end_lon=lon, flags=flags, **fields)


def state(time, x=0.0, y=0.0, psi=0.0, speed=0.0, **fields):
    return imc.EstimatedState(
        timestamp=time,
        lat=LAT,
        lon=LON,
        x=x,
        y=y,
        psi=psi,
        u=speed,
        vx=speed * math.cos(psi),
        vy=speed * math.sin(psi),
        **fields,
    )


def still(seconds, start=0.2, **fields):
    return [state(start + 0.05 * i, **fields) for i in range(round(seconds * 20))]


def north(seconds, start=0.2, speed=1.5, x=0.0, **fields):
    """A vehicle that goes north."""
    return [state(start + 0.05 * i, x=x + 0.05 * i * speed, speed=speed, **fields) for i in range(round(seconds * 20))]


def follow(feed, cls=VectorField, **parameters):
    if cls is VectorField:
        parameters = VEHICLE | parameters
    return simulate(cls, feed=sorted(feed, key=lambda m: m.timestamp), **parameters)


def test_a_current_that_carries_a_vehicle_astern_does_not_turn_its_heading_away():
    feed = [enable(), path(100, 0), *[state(0.2 + 0.05 * i, speed=-0.3) for i in range(40)]]
    assert abs(follow(feed).of(imc.DesiredHeading)[-1].value) == pytest.approx(math.radians(60.0))


def headings(run):
    return [m.value for m in run.of(imc.DesiredHeading)]


def test_nothing_is_followed_before_the_loop_is_enabled():
    run = follow([path(100.0, 0.0), *still(1.0)])
    assert run.of(imc.DesiredHeading) == []
    assert run.task.entity.description == "idle"


def test_a_path_enables_the_loops_it_needs_and_gives_their_references():
    run = follow([enable(scope=5), path(100.0, 0.0), *still(1.0)])
    assert [(m.enable, m.mask, m.scope_ref) for m in run.of(imc.ControlLoops)] == [
        (1, Loops.YAW | Loops.SPEED | Loops.DEPTH, 5)
    ]
    assert [(m.value, m.z_units) for m in run.of(imc.DesiredZ)] == [(3.0, DEPTH)]
    assert [m.value for m in run.of(imc.DesiredSpeed)] == [pytest.approx(1.4)]
    assert len(headings(run)) == 10


def test_loops_that_the_next_path_does_not_need_are_disabled():
    first, second = path(100.0, 0.0), path(50.0, 50.0, time=0.5, ref=2, end_z_units=ALTITUDE)
    third = path(90.0, 0.0, time=0.8, ref=3, flags=Flags.NO_Z)
    run = follow([enable(), first, second, third, *still(1.0)])
    assert [(m.enable, m.mask) for m in run.of(imc.ControlLoops)] == [
        (1, Loops.YAW | Loops.SPEED | Loops.DEPTH),
        (0, Loops.DEPTH),
        (1, Loops.ALTITUDE),
        (0, Loops.ALTITUDE),
    ]
    assert len(run.of(imc.DesiredZ)) == 2


def test_it_stops_when_the_loop_is_disabled():
    run = follow([enable(), path(100.0, 0.0), enable(scope=2, time=0.5, on=0), *still(2.0)])
    assert run.of(imc.ControlLoops)[-1].mask == Loops.YAW | Loops.SPEED | Loops.DEPTH
    assert run.of(imc.ControlLoops)[-1].enable == 0
    assert run.of(imc.DesiredHeading)[-1].timestamp - run.vehicle.start_time < 0.51


def test_disabling_everything_needs_no_echo():
    run = follow([enable(), path(100.0, 0.0), enable(Loops.ALL, scope=2, time=0.5, on=0), *still(2.0)])
    assert len(run.of(imc.ControlLoops)) == 1


@pytest.mark.parametrize(("y", "wanted"), [(0.0, 0.0), (1.5, -15.0), (-1.5, 15.0)])
def test_the_vector_field_leads_to_the_track(y, wanted):
    lat, lon, _ = displace(LAT, LON, 0.0, 0.0, 0.0)
    run = follow(
        [enable(), path(100.0, 0.0, flags=Flags.START, start_lat=lat, start_lon=lon), *still(1.0, x=10.0, y=y)]
    )
    assert headings(run)[-1] == pytest.approx(math.radians(wanted), abs=1e-3)


def test_the_course_is_steered_not_the_heading():
    drifting = [s.replace(vy=0.3) for s in north(1.0)]
    run = follow([enable(), path(1000.0, 0.0, flags=Flags.DIRECT), *drifting])
    assert headings(run)[0] == pytest.approx(-math.atan2(0.3, 1.5), abs=0.01)
    assert headings(follow([enable(), path(1000.0, 0.0), *drifting], course_control=False))[0] == pytest.approx(
        0.0, abs=1e-6
    )


def test_progress_is_reported_once_a_second_and_when_near():
    run = follow([enable(), path(30.0, 0.0), *north(17.0, depth=2.0)])
    found = run.of(imc.PathControlState)
    start = run.vehicle.start_time
    assert [round(m.timestamp - start) for m in found[:3]] == [0, 1, 2]
    assert found[0].x == pytest.approx(30.0, abs=0.1)
    assert found[0].z == pytest.approx(1.0)
    assert found[0].eta == 15
    near = next(m for m in found if m.flags & Progress.NEAR)
    assert near.timestamp - start == pytest.approx(0.2 + 22.5 / 1.5, abs=0.11)


def test_the_next_path_begins_where_the_last_one_ended():
    second = path(30.0, 60.0, time=16.0, ref=2)
    run = follow([enable(), path(30.0, 0.0), second, *north(17.0)])
    last = run.of(imc.PathControlState)[-1]
    lat, lon, _ = displace(LAT, LON, 0.0, 30.0, 0.0)
    assert (last.start_lat, last.start_lon) == (pytest.approx(lat, abs=1e-10), pytest.approx(lon, abs=1e-10))
    assert last.path_ref == 2


def start_of(run, ref=2):
    """North and east (m) of the start of a path."""
    found = next(m for m in run.of(imc.PathControlState) if m.path_ref == ref)
    return [round(v) + 0.0 for v in displacement(LAT, LON, 0.0, found.start_lat, found.start_lon, 0.0)[:2]]


def test_a_path_after_a_circle_begins_at_its_center():
    second = path(100.0, 0.0, time=1.0, ref=2)
    run = follow([enable(), path(0.0, 30.0, lradius=30.0), second, *still(2.0)])
    assert start_of(run) == [0.0, 30.0]


@pytest.mark.parametrize(("pause", "start"), [(0.0, 30.0), (0.9, 30.0), (1.5, 26.0)])
def test_a_path_after_other_loops_begins_where_the_last_one_ended_if_that_is_not_long_ago(pause, start):
    off, again = enable(Loops.ALL, scope=2, time=16.0, on=0), enable(Loops.PATH, scope=3, time=16.0 + pause)
    second = path(30.0, 60.0, time=16.01 + pause, ref=2)
    run = follow([enable(), path(30.0, 0.0), off, again, second, *north(18.0)])
    assert start_of(run)[0] == pytest.approx(start, abs=1)


def test_coming_back_from_a_large_circle_is_no_divergence():
    feed = [enable(), path(0.0, 0.0, lradius=200.0), path(300.0, 0.0, time=1.0, ref=2)]
    feed += [state(0.2 + 0.05 * i, y=200.0 - 0.07 * i, psi=-math.pi / 2, speed=1.4) for i in range(1200)]
    run = follow(feed, watch_along=True, watch_cross=True)
    assert start_of(run) == [0.0, 0.0]
    assert run.task.entity.state is State.NORMAL
    away = [state(m.timestamp, y=200.0, psi=-math.pi / 2, speed=0.1) for m in feed[3:]]
    run = follow([*feed[:3], *away], watch_along=True, watch_cross=True)
    assert run.task.entity.state is State.ERROR


def test_a_path_begins_at_the_vehicle_where_it_is_direct_or_the_last_one_was_not_ended():
    for flags, time in ((Flags.DIRECT, 16.0), (0, 5.0)):
        second = path(30.0, 60.0, time=time, ref=2, flags=flags)
        run = follow([enable(), path(30.0, 0.0), second, *north(17.0)])
        first = next(m for m in run.of(imc.PathControlState) if m.path_ref == 2)
        assert first.x == pytest.approx(math.hypot(30.0 - 1.5 * (time - 0.2), 60.0), abs=0.2)


def test_no_further_path_is_an_error():
    run = follow([enable(), path(30.0, 0.0), *north(25.0)])
    assert run.task.entity.state is State.ERROR
    assert run.task.entity.description == "expected new path control reference"


def circle(radius, side, seconds, distance):
    """A vehicle on a circle around a center 100 m north."""
    for i in range(round(seconds * 20)):
        angle = side * 1.4 * i * 0.05 / distance
        yield state(
            0.2 + 0.05 * i,
            x=100.0 + distance * math.cos(angle),
            y=distance * math.sin(angle),
            psi=math.remainder(angle + side * 0.5 * math.pi, 2.0 * math.pi),
            speed=1.4,
        )


@pytest.mark.parametrize("cls", [VectorField, PurePursuit])
@pytest.mark.parametrize(("flags", "side"), [(0, 1), (Flags.CCLOCKW, -1)])
def test_a_circle_is_followed_and_closed_in_on(cls, flags, side):
    def error(distance):
        feed = [enable(), path(100.0, 0.0, lradius=20.0, flags=flags), *circle(20.0, side, 20.0, distance)]
        run = follow(feed, cls)
        assert run.of(imc.PathControlState)[-1].flags & Progress.LOITERING
        assert run.of(imc.PathControlState)[-1].y == pytest.approx(distance - 20.0, abs=0.1)
        last = run.of(imc.EstimatedState) or list(circle(20.0, side, 20.0, distance))
        return side * math.remainder(headings(run)[-1] - last[-2].psi, 2.0 * math.pi)

    assert abs(error(19.99)) < 0.3
    assert error(17.0) < error(19.99)


def test_a_circle_begins_at_its_tangent():
    run = follow([enable(), path(100.0, 0.0, lradius=20.0), *north(2.0)])
    first = run.of(imc.PathControlState)[0]
    assert not first.flags & Progress.LOITERING
    assert headings(run)[0] == pytest.approx(math.atan2(-20.0, 100.0), abs=0.01)


def test_a_circle_around_where_the_vehicle_is():
    run = follow([enable(), path(9000.0, 0.0, lradius=15.0, flags=Flags.LOITER_CURR), *still(2.0, x=7.0)])
    last = run.of(imc.PathControlState)[-1]
    assert last.flags & Progress.LOITERING
    assert last.y == pytest.approx(-15.0, abs=1e-3)


@pytest.mark.parametrize(
    ("fields", "reason"),
    [
        ({"end_lat": math.nan}, "the desired path has an invalid position or number"),
        ({"end_lat": 2.0}, "the desired path has an invalid position or number"),
        ({"speed": math.inf}, "the desired path has an invalid position or number"),
        ({"end_lat": LAT + 0.01}, "the desired path is longer than 25 km"),
    ],
)
def test_paths_to_nowhere_are_errors_and_a_good_one_ends_them(fields, reason):
    bad = path(0.0, 0.0).replace(**fields)
    run = follow([enable(), bad, *still(1.0)])
    assert run.task.entity.description == reason
    assert run.task.entity.state is State.ERROR
    assert run.of(imc.DesiredHeading) == []
    good = follow([enable(), bad, path(100.0, 0.0, time=0.6, ref=2), *still(1.0)])
    assert good.task.entity.state is State.NORMAL


def test_a_path_that_is_refused_leaves_the_one_before_as_it_was():
    first = path(100.0, 0.0, flags=Flags.START, start_lat=LAT, start_lon=LON)
    far = path(0.0, 0.0, time=0.6, ref=2).replace(
        end_lat=LAT + 0.01, flags=Flags.START, start_lat=LAT, start_lon=LON + 0.02
    )
    alone = follow([enable(), first, *still(1.5, x=10.0, y=3.0)])
    run = follow([enable(), first, far, *still(1.5, x=10.0, y=3.0)])
    assert run.task.entity.description == "the desired path is longer than 25 km"
    assert headings(run) == headings(alone)


def test_a_vehicle_that_does_not_get_on_is_an_error():
    run = follow([enable(), path(100.0, 0.0), *still(45.0)], watch_along=True)
    assert run.task.entity.description == "along-track divergence error"


def test_a_vehicle_that_is_far_from_its_track_is_an_error_unless_it_does_not_know_where_it_is():
    track = path(900.0, 0.0, flags=Flags.START, start_lat=LAT, start_lon=LON)
    feed = [enable(), track, *north(25.0, y=30.0)]
    assert follow(feed, watch_cross=True).task.entity.description == "cross-track divergence error"
    unsure = imc.NavigationUncertainty(timestamp=0.12, x=100.0, y=36.0)
    assert follow([*feed, unsure], watch_cross=True).task.entity.state is State.NORMAL


@pytest.mark.parametrize("at", [5.2, 5.25])
def test_a_jump_of_the_position_halts_the_supervision(at):
    jump = north(25.0, start=at, x=7.5, y=30.0)
    track = path(900.0, 0.0, flags=Flags.START, start_lat=LAT, start_lon=LON)
    run = follow([enable(), track, *north(at - 0.2), *jump], watch_cross=True)
    assert run.task.entity.state is State.NORMAL


@pytest.mark.parametrize("seconds", [1.0, 1.05])
def test_the_reference_of_the_state_may_move(seconds):
    lat, lon, _ = displace(LAT, LON, 0.0, 10.0, 0.0)
    before = still(seconds, x=10.0, y=1.5)
    after = [s.replace(timestamp=s.timestamp + seconds, lat=lat, lon=lon, x=0.0) for s in before]
    track = path(100.0, 0.0, flags=Flags.START, start_lat=LAT, start_lon=LON)
    found = headings(follow([enable(), track, *before, *after]))
    assert found[-1] == pytest.approx(found[0], abs=1e-4)


def test_an_altitude_is_kept_where_the_depth_is_too_near_to_the_bottom():
    feed = [enable(), path(900.0, 0.0), *still(1.0, depth=3.0, alt=5.0), *still(1.0, start=1.2, depth=3.0, alt=2.0)]
    feed += still(1.0, start=2.2, depth=3.0, alt=6.0)
    found = [(m.value, m.z_units) for m in follow(feed, watch_bottom=True).of(imc.DesiredZ)]
    assert found == [(3.0, DEPTH), (2.5, ALTITUDE), (3.0, DEPTH)]
    assert len(follow(feed).of(imc.DesiredZ)) == 1


def test_navigation_that_falls_silent_is_an_error_of_the_path():
    run = follow([enable(), path(100, 0), *north(3.0)], seconds=8.0)
    error, *_ = [m for m in run.of(imc.EntityState) if m.state == State.ERROR]
    assert error.description == "EstimatedState is missing"
    assert 5.1 < error.timestamp - run.vehicle.start_time <= 6.2
