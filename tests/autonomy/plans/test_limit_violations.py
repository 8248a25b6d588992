"""Plans that leave the area, fly too high, or fly before takeoff are refused."""

import math

import pytest
from flying import place, plan_of

import imc
from autonomy.plans.duration_energy_forecast import forecast_plan
from autonomy.plans.estimate import Powertrain, estimate_maneuver
from autonomy.plans.graph import PlanError, parse_graph
from autonomy.plans.limit_violations import PlanBounds
from autonomy.plans.preflight import Preflight

KINDS = {cls.ID for cls in (imc.Takeoff, imc.Land, imc.Goto, imc.IdleManeuver, imc.Loiter, imc.FollowPath)}
UP = imc.ZUnits.ALTITUDE
STATE = imc.EstimatedState(**place(0.0, 0.0), height=90.0, alt=0.0, depth=-1.0)
TAKEOFF, LAND, IDLE = imc.Takeoff(z=10.0, z_units=UP, speed=2.0), imc.Land(speed=2.0), imc.IdleManeuver(duration=5)


def goto(north=0.0, altitude=20.0, **fields):
    return imc.Goto(**{**place(north, 0.0), "z": altitude, "z_units": UP, "speed": 5.0, **fields})


def check(*maneuvers, options=(), kinds=KINDS, state=STATE, transitions=None, **fields):
    """Why a plan is refused, empty if it is accepted."""
    options = {"Absolute Maximum Altitude": "120", **dict(options)}
    preflight = Preflight(lambda option: options.get(option, ""), 15.0, 5000.0)
    try:
        preflight.check(plan_of(*maneuvers, transitions=transitions), kinds, state, None, 0.0, **fields)
    except PlanError as error:
        return str(error)
    return ""


@pytest.mark.parametrize(
    "maneuvers", [(TAKEOFF, goto(), LAND), (IDLE, TAKEOFF, LAND, IDLE, TAKEOFF, goto()), (IDLE,), (LAND,)]
)
def test_plans_that_take_off_first_can_be_flown(maneuvers):
    assert check(*maneuvers) == ""


@pytest.mark.parametrize(("maneuvers", "name"), [((goto(),), "m0"), ((TAKEOFF, LAND, IDLE, goto()), "m3")])
def test_what_flies_on_the_ground_is_refused(maneuvers, name):
    assert check(*maneuvers) == f"{name}: the vehicle is on the ground, a Takeoff must come first"


def test_what_is_in_the_air_need_not_take_off():
    assert check(goto(), airborne=True) == ""
    assert check(LAND, goto(), airborne=True).startswith("m1: the vehicle is on the ground")


def test_all_ways_through_a_plan_are_looked_at():
    ways = [("m0", "m1", "EstimatedState.alt > 5"), ("m0", "m2", ""), ("m1", "m2", "")]
    assert check(TAKEOFF, LAND, goto(), transitions=ways).startswith("m2: the vehicle is on the ground")
    assert check(TAKEOFF, IDLE, goto(), transitions=ways) == ""


def test_what_does_not_take_off_at_all_flies_nothing():
    assert check(goto(), kinds={imc.Goto.ID}) == ""


@pytest.mark.parametrize(
    ("maneuver", "reason"),
    [
        (goto(altitude=121.0), "an altitude of 121 m is above the limit of 120 m"),
        (goto(altitude=211.0, z_units=imc.ZUnits.HEIGHT), "an altitude of 121 m is above the limit of 120 m"),
        (goto(altitude=2.0, z_units=imc.ZUnits.DEPTH), "an aerial vehicle cannot go to a depth"),
        (goto(speed=50.0, speed_units=imc.SpeedUnits.PERCENTAGE), "the speed of an aerial vehicle must be in m/s"),
        (imc.Takeoff(speed=2.0), "a Takeoff needs an altitude or height above the ground"),
        (imc.Takeoff(speed=2.0, z=-1.0, z_units=UP), "a Takeoff needs an altitude or height above the ground"),
        (imc.Takeoff(speed=2.0, z=80.0, z_units=3), "a Takeoff needs an altitude or height above the ground"),
        (
            imc.FollowPath(**place(0, 0), z=110.0, z_units=UP, speed=5.0, points=[imc.PathPoint(x=9.0, z=20.0)]),
            "an altitude of 130 m is above the limit of 120 m",
        ),
    ],
)
def test_heights_and_speeds_that_cannot_be(maneuver, reason):
    assert check(TAKEOFF, maneuver) == f"m1: {reason}"


def test_heights_are_above_the_ellipsoid():
    assert check(TAKEOFF, goto(altitude=209.0, z_units=imc.ZUnits.HEIGHT)) == ""
    assert check(TAKEOFF, goto(altitude=900.0, z_units=imc.ZUnits.HEIGHT), state=None) == ""


@pytest.mark.parametrize("height", [84.6, 90.3, 1200.7])
def test_what_is_exactly_at_a_limit_is_allowed(height):
    state = imc.decode(imc.encode(STATE.replace(height=height)))
    highest = goto(altitude=height + 120.0, z_units=imc.ZUnits.HEIGHT, speed=1.1)
    highest = imc.decode(imc.encode(highest))
    assert check(TAKEOFF.replace(speed=1.1), highest, state=state, options={"Maximum Absolute Speed": "1.1"}) == ""
    deepest = imc.decode(imc.encode(imc.Goto(**place(0.0, 0.0), z=48.9, z_units=imc.ZUnits.DEPTH, speed=1.1)))
    limits = {"Maximum Absolute Speed": "1.1", "Absolute Maximum Depth": "49.9"}
    assert check(deepest, kinds={imc.Goto.ID}, options=limits) == ""
    deeper = deepest.replace(z=48.91)
    assert check(deeper, kinds={imc.Goto.ID}, options=limits).startswith("m0: maneuver depth beyond limits")


def test_stricter_limits_count():
    limits = imc.OperationalLimits(mask=imc.OpLimitsMask.MAX_ALT, max_altitude=15.0)
    assert check(TAKEOFF, goto(), limits=limits) == "m1: an altitude of 20 m is above the limit of 15 m"
    assert PlanBounds().max_altitude == math.inf


def fence(**fields):
    area = {"length": 200.0, "width": 40.0, **place(0.0, 0.0)}
    return imc.OperationalLimits(**{**area, "mask": imc.OpLimitsMask.AREA, **fields})


def test_a_plan_stays_inside_the_area():
    assert check(TAKEOFF, goto(99.0), limits=fence()) == ""
    assert check(TAKEOFF, goto(101.0), limits=fence()) == "m1: is outside the area of the operational limits"
    assert check(TAKEOFF, goto(99.0), limits=fence(orientation=0.5 * math.pi)).startswith("m1: is outside")
    assert check(TAKEOFF, goto(101.0), limits=fence(mask=0)) == ""
    circle = imc.Loiter(**place(80.0, 0.0), radius=25.0, z=20.0, z_units=UP, speed=5.0)
    assert check(TAKEOFF, circle, limits=fence()).startswith("m1: is outside")


@pytest.mark.parametrize("field", ["lat", "lon", "orientation", "length", "width", "max_altitude"])
def test_limits_that_are_no_numbers_are_kept_by_no_plan(field):
    broken = fence(max_altitude=50.0, mask=imc.OpLimitsMask.AREA | imc.OpLimitsMask.MAX_ALT)
    assert check(TAKEOFF, goto(), limits=broken) == ""
    broken = broken.replace(**{field: math.nan})
    assert check(TAKEOFF, goto(), limits=broken) == "the operational limits have a value that is not a number"
    assert check(TAKEOFF, goto(), limits=broken.replace(mask=0)) == ""


def test_what_stays_where_the_vehicle_is_leaves_no_area():
    here = imc.Elevator.Flags.CURR_POS
    for rise in (imc.Elevator(speed=1.5, flags=here), imc.PopUp(speed=1.5, flags=here, duration=5)):
        assert check(rise, limits=fence(), kinds={rise.ID}) == ""
        there = rise.replace(flags=0, **place(101.0, 0.0))
        assert check(there, limits=fence(), kinds={rise.ID}).startswith("m0: is outside")


def test_durations_of_takeoff_and_landing():
    start, train = (STATE.lat, STATE.lon), Powertrain(ahead=0.0)
    assert estimate_maneuver(TAKEOFF, start, train, 0.0).seconds == pytest.approx(5.0)
    assert estimate_maneuver(TAKEOFF, start, train, 0.0).end == start
    assert estimate_maneuver(LAND, start, train, 0.0).end == start
    there = imc.Land(**place(30.0, 0.0), z=10.0, z_units=UP, speed=2.0)
    assert estimate_maneuver(there, start, train, 0.0).seconds == pytest.approx(15.0 + 20.0, abs=0.1)


def test_hovering_takes_energy_too():
    train = Powertrain((0.0, 5.0), (5950.0, 5967.0), (70.0, 71.0), (0.0, 5950.0, 6000.0), (0.0, 336.0, 345.0), 15.0)
    wait = imc.StationKeeping(**place(0.0, 0.0), z=10.0, z_units=UP, speed=5.0, duration=600)
    graph = parse_graph(plan_of(wait), {imc.StationKeeping.ID})
    assert forecast_plan(graph, (STATE.lat, STATE.lon), train, 0.0).energy == pytest.approx(
        600.0 * (15.0 + 336.0), rel=0.01
    )
