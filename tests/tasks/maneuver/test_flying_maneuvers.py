"""The maneuvers of aircraft, each alone: the desired paths, and when they are done."""

import math

import pytest
from flying import CCU, changes

import imc
from runtime.testing import simulate
from support import wgs84
from tasks.maneuver.land import Land
from tasks.maneuver.loiter import Loiter
from tasks.maneuver.station_keeping import StationKeeping
from tasks.maneuver.takeoff import Takeoff

Flags, Reached = imc.DesiredPath.Flags, imc.PathControlState.Flags
Phase = imc.ManeuverControlState.State
UP = imc.ZUnits.ALTITUDE
THERE = {"lat": 0.72, "lon": -0.15, "z": 20.0, "z_units": UP, "speed": 4.0}


def path(time, flags=0, eta=7, ref=1):
    return imc.PathControlState(timestamp=time, path_ref=ref, flags=flags, eta=eta)


def here(time):
    return imc.EstimatedState(timestamp=time, lat=0.71, lon=-0.16, x=100.0)


def there(time, north=0.0):
    lat, lon, _ = wgs84.displace(THERE["lat"], THERE["lon"], 0.0, north, 0.0)
    return imc.EstimatedState(timestamp=time, lat=lat, lon=lon)


def execute(cls, maneuver, *feed, seconds=30.0, **parameters):
    feed = [maneuver.replace(timestamp=1.0), *sorted(feed, key=lambda m: m.timestamp)]
    return simulate(cls, feed, seconds=seconds, **parameters)


def done(run):
    """When it was done (s), infinity if it was not."""
    found = [m.timestamp for m in run.of(imc.ManeuverControlState) if m.state == Phase.DONE]
    return found[0] - run.vehicle.start_time if found else math.inf


def test_a_takeoff_is_a_path_straight_up():
    run = execute(Takeoff, imc.Takeoff(**THERE), path(2.0), path(8.0, Reached.NEAR))
    (desired,) = run.of(imc.DesiredPath)
    assert (desired.flags, desired.end_z, desired.end_z_units, desired.speed) == (Flags.TAKEOFF, 20.0, UP, 4.0)
    assert [(m.enable, m.mask) for m in run.of(imc.ControlLoops)] == [(0, 0xFFFFFFFF), (1, imc.CLoopsMask.PATH)]
    assert done(run) == pytest.approx(8.0)


def test_a_landing_leads_to_its_position():
    run = execute(Land, imc.Land(**THERE), here(2.0), path(3.0), there(8.0), path(9.0, Reached.NEAR))
    (desired,) = run.of(imc.DesiredPath)
    assert (desired.flags, desired.end_lat, desired.end_lon, desired.end_z) == (Flags.LAND, 0.72, -0.15, 20.0)
    assert done(run) == pytest.approx(9.0)


def last_info(run):
    """The last report of an error; empty if there is none."""
    return next((m.info for m in reversed(run.of(imc.ManeuverControlState)) if m.state == Phase.ERROR), "")


def test_a_landing_elsewhere_fails_and_says_how_far():
    run = execute(Land, imc.Land(**THERE), here(2.0), path(3.0), there(8.0, 44.0), path(9.0, Reached.NEAR))
    assert done(run) == math.inf
    assert last_info(run) == "landed 44 m from the position"


def test_a_landing_without_a_position_is_straight_down():
    run = execute(Land, imc.Land(z=20.0, z_units=UP, speed=4.0), here(2.0), path(3.0))
    (desired,) = run.of(imc.DesiredPath)
    assert (desired.flags, desired.end_z_units) == (Flags.LAND, imc.ZUnits.NONE)
    north, _, _ = wgs84.displacement(0.71, -0.16, 0.0, desired.end_lat, desired.end_lon, 0.0)
    assert north == pytest.approx(100.0, abs=0.01)
    assert done(run) == math.inf


HOVERING = [
    (StationKeeping, imc.StationKeeping(**THERE, duration=10)),
    (Loiter, imc.Loiter(**THERE, duration=10, type=imc.Loiter.Type.HOVER)),
]


@pytest.mark.parametrize(("cls", "maneuver"), HOVERING)
def test_what_hovers_does_so_for_its_time_from_the_arrival(cls, maneuver):
    near = [path(float(second), Reached.NEAR) for second in range(5, 30)]
    run = execute(cls, maneuver, here(1.5), path(2.0), there(5.0), *near, hovers=True)
    (desired,) = run.of(imc.DesiredPath)
    assert (desired.flags, desired.lradius, desired.end_z) == (Flags.DIRECT, 0.0, 20.0)
    assert done(run) == pytest.approx(15.0)
    assert changes(m.eta for m in run.of(imc.ManeuverControlState))[1:4] == [17, 10, 9]
    assert imc.CLoopsMask.PATH in [m.mask for m in run.of(imc.ControlLoops) if m.enable]


@pytest.mark.parametrize(("cls", "maneuver"), HOVERING)
def test_what_is_driven_off_its_point_fails_and_says_how_far(cls, maneuver):
    near = [path(float(second), Reached.NEAR) for second in range(5, 10)]
    off = [path(float(second)) for second in range(10, 30)]
    run = execute(cls, maneuver, here(1.5), path(2.0), there(5.0), *near, there(12.0, 30.0), *off, hovers=True)
    assert done(run) == math.inf
    assert last_info(run) == "30 m from the point at the end"


@pytest.mark.parametrize(("cls", "maneuver"), HOVERING)
def test_what_hovers_for_ever_does(cls, maneuver):
    near = [path(float(second), Reached.NEAR) for second in range(5, 30)]
    assert done(execute(cls, maneuver.replace(duration=0), *near, hovers=True)) == math.inf


@pytest.mark.parametrize(("cls", "maneuver", "end"), [(*HOVERING[0], 12.0), (*HOVERING[1], 15.0)])
def test_maneuver_done_ends_keeping_station_and_no_loiter(cls, maneuver, end):
    near = [path(float(second), Reached.NEAR) for second in range(5, 30)]
    run = execute(cls, maneuver, *near, imc.ManeuverDone(timestamp=12.0, src=CCU), hovers=True)
    assert done(run) == pytest.approx(end)


def test_what_cannot_hover_circles():
    run = execute(Loiter, HOVERING[1][1], here(1.5))
    assert run.of(imc.DesiredPath)[0].lradius == 10.0
