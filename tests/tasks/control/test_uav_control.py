"""The controllers of a multirotor: geometry, each task alone, and the autopilot with the simulated airframe."""

import math

import pytest

import imc
from autonomy.guidance import MotionLimits
from runtime import State
from runtime.testing import simulate
from support.wgs84 import displace
from tasks.control.uav.path import Path
from tests.tasks.control.multirotor import DISARMED, LAT, LON, Flags, Loops, Units, enable, states

PACE = MotionLimits(speed=5.0, climb=2.0, descent=1.0, acceleration=2.0, gain=0.8)


def place(north, east):
    lat, lon, _ = displace(LAT, LON, 0.0, north, east)
    return {"end_lat": lat, "end_lon": lon}


def desired(north=50.0, east=0.0, z=10.0, units=Units.ALTITUDE, speed=5.0, time=0.3, **fields):
    path = {"path_ref": 1, **place(north, east), "end_z": z, "end_z_units": units, "speed": speed}
    return imc.DesiredPath(timestamp=time, **{**path, **fields})


def lead(*feed, **parameters):
    settings = {"General": {"Absolute Maximum Altitude": "120"}}
    ordered = sorted(feed, key=lambda message: message.timestamp)
    return simulate(Path, feed=ordered, settings=settings, **parameters)


def test_nothing_is_led_before_the_loop_is_enabled():
    run = lead(desired(), *states())
    assert run.of(imc.DesiredVelocity) == []


def test_the_loops_below_are_enabled_in_the_scope_of_the_maneuver():
    run = lead(enable(scope=7), desired(), *states(), enable(scope=8, time=0.9, on=0))
    assert [(m.enable, m.mask, m.scope_ref) for m in run.of(imc.ControlLoops)] == [
        (1, Loops.VELOCITY | Loops.YAW, 7),
        (0, Loops.VELOCITY | Loops.YAW, 8),
    ]
    assert lead(enable(scope=7), enable(scope=6, time=0.15, on=0), desired(), *states()).of(imc.DesiredVelocity)


def test_velocity_is_ahead_and_to_starboard_of_the_heading():
    velocity = lead(enable(), desired(), *states(psi=math.radians(-90.0))).of(imc.DesiredVelocity)[-1]
    assert (velocity.u, velocity.v, velocity.w) == pytest.approx((0.0, 5.0, 0.0), abs=1e-6)
    heading = lead(enable(), desired(50.0, 50.0), *states()).of(imc.DesiredHeading)[-1]
    assert heading.value == pytest.approx(0.25 * math.pi)


@pytest.mark.parametrize(("units", "z"), [(Units.ALTITUDE, 20.0), (Units.HEIGHT, 110.0)])
def test_heights_are_above_the_ellipsoid_and_altitudes_above_the_ground(units, z):
    feed = [enable(), desired(0.0, z=z, units=units), *states(z=-10.0, alt=10.0, height=90.0)]
    run = lead(*feed)
    assert run.of(imc.DesiredVelocity)[-1].w == pytest.approx(-2.5)
    assert run.of(imc.PathControlState)[-1].z == pytest.approx(10.0)
    assert run.of(imc.DesiredZ)[-1].value == pytest.approx(z)


def test_without_a_height_it_keeps_its_own():
    assert lead(enable(), desired(units=Units.NONE), *states()).of(imc.DesiredVelocity)[-1].w == pytest.approx(0.0)
    assert lead(enable(), desired(flags=Flags.NO_Z), *states()).of(imc.DesiredVelocity)[-1].w == pytest.approx(0.0)


def test_altitude_and_speed_are_kept_within_the_limits_and_it_is_said():
    run = lead(enable(), desired(0.0, z=500.0), *states())
    assert run.of(imc.DesiredZ)[-1].value == pytest.approx(119.5)
    bits = imc.OpLimitsMask
    limits = imc.OperationalLimits(
        timestamp=0.05,
        mask=bits.MAX_ALT | bits.MIN_ALT | bits.MAX_SPEED,
        max_altitude=30.0,
        min_altitude=5.0,
        max_speed=2.0,
    )
    assert lead(limits, enable(), desired(0.0, z=500.0), *states()).of(imc.DesiredZ)[-1].value == pytest.approx(29.5)
    assert lead(limits, enable(), desired(0.0, z=1.0), *states()).of(imc.DesiredZ)[-1].value == pytest.approx(5.5)
    assert lead(limits, enable(), desired(), *states()).of(imc.DesiredVelocity)[-1].u == pytest.approx(2.0)
    gain = imc.EntityParameter(name="Gain", value="0.7")
    change = imc.SetEntityParameters(timestamp=0.2, name="Path", params=(gain,))
    run = lead(limits, change, enable(), desired(0.0, z=500.0), *states())
    assert run.task.gain == 0.7
    assert run.of(imc.DesiredZ)[-1].value == pytest.approx(29.5)


CEILING = imc.OperationalLimits(timestamp=0.6, mask=imc.OpLimitsMask.MAX_ALT, max_altitude=30.0)


@pytest.mark.parametrize("circle", [{}, {"lradius": 20.0}])
def test_a_limit_of_altitude_counts_at_once(circle):
    above = states(x=20.0, z=-60.0, alt=60.0)
    run = lead(enable(), desired(z=60.0, **circle), CEILING, *above)
    assert [m.value for m in run.of(imc.DesiredZ)] == pytest.approx([60.0, 29.5])
    found = [m.w for m in run.of(imc.DesiredVelocity)]
    assert (found[0], found[-1]) == pytest.approx((0.0, 1.5), abs=1e-6)
    assert run.of(imc.PathControlState)[-1].z == pytest.approx(29.5 - 60.0)
    lifted = CEILING.replace(timestamp=0.8, mask=0)
    again = lead(enable(), desired(z=60.0, **circle), CEILING, lifted, *above)
    assert again.of(imc.PathControlState)[-1].z == pytest.approx(0.0)


def test_a_limit_is_kept_on_the_whole_way():
    run = lead(enable(), desired(1000.0, z=60.0), *states(0.3, z=-60.0, alt=60.0), CEILING, *states(z=-29.5, alt=29.5))
    assert run.of(imc.DesiredVelocity)[-1].w == pytest.approx(0.0, abs=1e-6)
    kept = lead(enable(), desired(flags=Flags.NO_Z), CEILING, *states(z=-60.0, alt=60.0))
    assert kept.of(imc.DesiredVelocity)[-1].w == pytest.approx(0.0)


def test_a_path_goes_on_from_a_climb_to_a_limit_that_it_has_passed():
    climb = desired(0.0, z=60.0, flags=Flags.TAKEOFF)
    low = imc.OperationalLimits(timestamp=0.6, mask=imc.OpLimitsMask.MAX_ALT, max_altitude=5.0)
    run = lead(enable(), climb, *states(0.3, z=0.0, alt=0.0), low, *states(start=0.6, z=-10.0, alt=10.0))
    assert run.of(imc.DesiredVelocity)[-1].w == pytest.approx(1.5)
    arrived = states(start=1.6, z=-4.5, alt=4.5)
    assert reached(lead(enable(), climb, *states(0.3, z=0.0, alt=0.0), low, *arrived))[-1]


@pytest.mark.parametrize(
    ("path", "reason"),
    [
        (desired(units=Units.DEPTH), "an aerial vehicle cannot go to a depth"),
        (desired(speed_units=imc.SpeedUnits.RPM), "the speed of an aerial vehicle must be in m/s"),
        (desired(end_lat=math.nan), "the desired path has an invalid position or number"),
        (desired(end_z=math.inf), "the desired path has an invalid position or number"),
        (desired(end_lat=0.0), "the desired path is longer than 25 km"),
    ],
)
def test_paths_that_cannot_be_flown_are_errors_and_not_followed(path, reason):
    run = lead(enable(), path, *states())
    assert (run.task.entity.state, run.task.entity.description) == (State.ERROR, reason)
    assert run.of(imc.DesiredVelocity) == []


def test_on_the_ground_only_a_takeoff_is_followed():
    rests = imc.ArmingState(timestamp=0.05, state=DISARMED)
    run = lead(rests, enable(), desired(), *states(z=0.0, alt=0.0))
    assert run.task.entity.description == "on the ground: take off first"
    run = lead(rests, enable(), desired(flags=Flags.TAKEOFF), *states(z=0.0, alt=0.0))
    velocity = run.of(imc.DesiredVelocity)[-1]
    assert (velocity.u, velocity.w) == pytest.approx((0.0, -2.5))


def reached(run):
    return [bool(m.flags & imc.PathControlState.Flags.NEAR) for m in run.of(imc.PathControlState)]


def test_it_is_near_within_the_radius_and_says_so_at_once():
    far, close = states(0.5, x=40.0), states(0.2, start=0.7, x=49.0)
    run = lead(enable(), desired(), *far, *close)
    assert reached(run) == [False, True]
    assert run.of(imc.PathControlState)[-1].timestamp == pytest.approx(run.vehicle.start_time + 0.7, abs=0.01)


def test_the_next_line_begins_where_the_last_one_ended():
    feed = [*states(0.5, x=49.0), *states(0.5, start=0.7, x=49.0)]
    run = lead(enable(), desired(), *feed, desired(50.0, 50.0, time=0.75, path_ref=2))
    assert run.of(imc.PathControlState)[-1].y == pytest.approx(1.0)
    direct = desired(50.0, 50.0, time=0.75, path_ref=2, flags=Flags.DIRECT)
    assert lead(enable(), desired(), *feed, direct).of(imc.PathControlState)[-1].y == pytest.approx(0.0, abs=1e-6)


def test_a_landing_descends_slowly_near_the_ground_and_ends_with_the_motors():
    land = desired(0.0, flags=Flags.LAND, units=Units.NONE)
    high, low = states(0.5, z=-20.0, alt=20.0), states(0.5, start=0.7, z=-3.0, alt=3.0)
    rest = imc.ArmingState(timestamp=1.3, state=DISARMED)
    run = lead(enable(), land, *high, *low, rest, *states(0.3, start=1.4, z=0.0, alt=0.0))
    found = [m.w for m in run.of(imc.DesiredVelocity)]
    assert (found[5], found[15]) == pytest.approx((1.5, 0.5))
    assert (reached(run)[0], reached(run)[-1]) == (False, True)


def test_a_circle_is_said_to_be_loitered_on():
    run = lead(enable(), desired(0.0, lradius=20.0), *states(1.0, x=20.5))
    state = run.of(imc.PathControlState)[-1]
    assert state.flags & imc.PathControlState.Flags.LOITERING
    assert (state.y, state.eta) == (pytest.approx(0.5), 0)
    velocity = run.of(imc.DesiredVelocity)[-1]
    assert velocity.v > 4.5
    counter = desired(0.0, lradius=20.0, flags=Flags.CCLOCKW)
    assert lead(enable(), counter, *states(1.0, x=20.5)).of(imc.DesiredVelocity)[-1].v < -4.5


def test_no_progress_is_an_error():
    run = lead(enable(), desired(), *states(45.0))
    assert run.task.entity.description == "along-track divergence error"
    run = lead(enable(), desired(), *states(1.0), *states(15.0, start=1.3, x=25.0, y=20.0))
    assert run.task.entity.description == "cross-track divergence error"


def test_a_takeoff_is_done_near_its_height():
    def near(z):
        low, high = states(0.5, z=0.0, alt=0.0), states(0.5, start=0.7, z=z, alt=-z, y=1.0)
        return reached(lead(enable(), desired(flags=Flags.TAKEOFF), *low, *high))[-1]

    assert not near(-9.2)
    assert near(-9.6)
