"""Duration estimates of plans, compared with DUNE's estimate for a plan that it flew."""

import math

import pytest
from flying import LAT, LON, goto, place, plan_of, recorded

import imc
from autonomy.plans.estimate import SMALLEST_CIRCLE, Powertrain, estimate_maneuver, interpolate
from autonomy.plans.graph import PlanError
from autonomy.plans.preflight import Preflight, PreflightOptionError
from tasks.maneuver.compass_calibration import SMALLEST_RADIUS, CompassCalibration
from tasks.maneuver.scheduled_goto import ScheduledGoto

NOPTILUS = {
    "Absolute Maximum Depth": "50",
    "Battery Capacity": "700",
    "Time Of Arrival Factor": "5",
    "Speed Conversion -- Actuation": "0, 36, 50",
    "Speed Conversion -- MPS": "0, 1, 1.4",
    "Speed Conversion -- RPM": "0, 900, 1250",
    "Power Model -- Conversion - RPM": "0, 500, 850, 1250, 1400",
    "Power Model -- Conversion - Watt": "0, 14, 23.5, 54, 70",
}
KINDS = [imc.Goto.ID, imc.StationKeeping.ID, imc.IdleManeuver.ID, imc.YoYo.ID, imc.Elevator.ID, imc.PopUp.ID]
HERE = imc.EstimatedState(lat=LAT, lon=LON)


def preflight(**changes):
    values = {**NOPTILUS, **changes}
    return Preflight(lambda option: values.get(option, ""), 45.0, 25_000.0)


def test_durations_and_fuel_are_those_of_dune():
    statistics = preflight().check(recorded(), KINDS, HERE, None, 0.0).statistics(700 * 3600.0)
    found = {name: float(value) for name, value in (pair.split("=") for pair in statistics.durations.split(","))}
    dune = {
        "Total": 228.3,
        "Maneuver Goto1": 63.0,
        "Maneuver Goto2": 45.2,
        "Maneuver Goto3": 61.7,
        "Maneuver SK1": 58.4,
    }
    assert {name: found[name] for name in dune} == pytest.approx(dune, abs=0.3)
    fuel = {name: float(value) for name, value in (pair.split("=") for pair in statistics.fuel.split(","))}
    assert fuel == pytest.approx({"Total": 0.73, "Hotel": 0.41, "Motion": 0.32}, abs=0.02)


def test_without_a_position_the_way_there_is_left_out():
    outlook = preflight().check(plan_of(goto(100, 0), goto(100, 60)), KINDS, None, None, 0.0)
    assert [e.distance for e in outlook.estimates.values()] == pytest.approx([0.0, 60.0], abs=0.1)


@pytest.mark.parametrize(
    ("maneuver", "seconds"),
    [
        (imc.IdleManeuver(duration=7), 7.0),
        (imc.IdleManeuver(), math.inf),
        (imc.Teleoperation(), math.inf),
        (imc.Loiter(**place(100, 0), radius=15, duration=60, speed=1.0), 155.0),
        (imc.YoYo(**place(100, 0), speed=1.0, pitch=math.radians(60)), 190.0),
        (imc.Elevator(start_z=0, end_z=10, speed=1.0, flags=imc.Elevator.Flags.CURR_POS), 38.6),
        (imc.PopUp(**place(100, 0), z=0, duration=20, speed=1.0), 115.0),
        (imc.ScheduledGoto(**place(100, 0), arrival_time=500.0), 485.0),
        (imc.ScheduledGoto(**place(160, 0), arrival_time=20.0), 95.0),
        (imc.ScheduledGoto(**place(160, 0), arrival_time=20.0, delayed=imc.ScheduledGoto.Delayed.FAIL), math.nan),
        (imc.CompassCalibration(**place(100, 0), radius=20, speed=1.0, duration=50), 145.0),
        (imc.CompassCalibration(**place(100, 0), radius=20, speed=1.0, duration=500), 220.7),
        (imc.Takeoff(z=10, z_units=imc.ZUnits.ALTITUDE, speed=2.0), 5.0),
        (imc.Takeoff(z=10, z_units=imc.ZUnits.HEIGHT, speed=2.0), math.nan),
        (imc.Land(z=10, z_units=imc.ZUnits.ALTITUDE, speed=2.0), 20.0),
        (imc.Land(speed=2.0), math.nan),
        (imc.FollowPath(**place(0, 0), speed=1.0, points=[imc.PathPoint(x=50), imc.PathPoint(x=50, y=50)]), 95.0),
        (imc.Goto(**place(100, 0), speed=1000.0, speed_units=imc.SpeedUnits.RPM), 95.0),
        (imc.Goto(**place(100, 0), speed=50.0, speed_units=imc.SpeedUnits.PERCENTAGE), 195.0),
    ],
)
def test_each_maneuver(maneuver, seconds):
    found = estimate_maneuver(maneuver, (LAT, LON), Powertrain(), now=10.0)
    assert found.seconds == pytest.approx(seconds, abs=0.3, nan_ok=True)


@pytest.mark.parametrize(("late", "is_known"), [(-1.0, True), (0.5, True), (2.9, True), (3.5, False)])
def test_a_scheduled_goto_may_be_as_late_in_a_forecast_as_in_the_maneuver(late, is_known):
    fail = imc.ScheduledGoto.Delayed.FAIL
    maneuver = imc.ScheduledGoto(**place(160, 0), arrival_time=110.0 - late, delayed=fail)
    found = estimate_maneuver(maneuver, (LAT, LON), Powertrain(), now=10.0)
    assert math.isfinite(found.seconds) is is_known


@pytest.mark.parametrize(
    ("maneuver", "meters"),
    [
        (imc.Loiter(**place(100, 0), radius=15, duration=60, speed=1.0), 160.0),
        (imc.Loiter(**place(100, 0), radius=15, speed=1.0), math.inf),
        (imc.StationKeeping(**place(100, 0), duration=60, speed=1.0), 100.0),
        (imc.Elevator(**place(100, 0), end_z=10, speed=1.0), 138.6),
        (imc.IdleManeuver(duration=7), 0.0),
        (imc.Dislodge(rpm=1000), math.nan),
        (imc.Teleoperation(), math.nan),
        (imc.FollowReference(), math.nan),
        (imc.FollowSystem(duration=60, speed=1.0), math.nan),
        (imc.CustomManeuver(name="Own"), math.nan),
    ],
)
def test_the_distance_has_circles_and_is_not_0_if_unknown(maneuver, meters):
    found = estimate_maneuver(maneuver, (LAT, LON), Powertrain(), now=10.0)
    assert found.distance == pytest.approx(meters, abs=0.3, nan_ok=True)


def test_what_is_unknown_is_absent_from_the_statistics():
    known = goto(100, 0)
    kinds = [*KINDS, imc.Dislodge.ID, imc.Loiter.ID]
    whole = preflight().check(plan_of(known), kinds, HERE, None, 0.0).statistics(700 * 3600.0)
    assert "Total=" in whole.durations
    assert "Total=" in whole.distances
    assert "Total=" in whole.fuel
    for unknown in (
        imc.Dislodge(rpm=1000),
        imc.Loiter(**place(100, 0), z_units=imc.ZUnits.DEPTH, radius=15, speed=1.0),
    ):
        partly = preflight().check(plan_of(known, unknown), kinds, HERE, None, 0.0).statistics(700 * 3600.0)
        assert partly.durations == "Calibration=0.0,Maneuver m0=61.7"
        assert partly.distances == "Maneuver m0=100.0"
        assert partly.fuel == ""


def test_a_scheduled_goto_is_estimated_from_when_it_begins():
    depths = {"z_units": imc.ZUnits.DEPTH, "travel_z_units": imc.ZUnits.DEPTH}
    later = imc.ScheduledGoto(**place(100, 0), **depths, arrival_time=500.0)
    kinds = [*KINDS, imc.ScheduledGoto.ID]
    outlook = preflight().check(plan_of(imc.IdleManeuver(duration=100), later), kinds, HERE, None, 0.0)
    assert outlook.seconds == pytest.approx(495.0, abs=0.3)  # as each path, it ends 5 s before the point


def test_an_aerial_vehicle_lands_from_where_it_is():
    units = imc.ZUnits
    up = imc.Takeoff(z=60, z_units=units.HEIGHT, speed=2.0)
    ground = HERE.replace(height=40.0, alt=0.0)
    kinds = [imc.Takeoff.ID, imc.Land.ID]
    aerial = preflight(**{"Absolute Maximum Depth": ""})
    outlook = aerial.check(plan_of(up, imc.Land(speed=2.0)), kinds, ground, None, 0.0)
    assert [e.seconds for e in outlook.estimates.values()] == pytest.approx([10.0, 40.0], abs=0.1)


def test_the_usual_speeds_and_turns_are_those_of_the_maneuvers():
    train, scheduled, calibration = Powertrain(), ScheduledGoto.parameters(), CompassCalibration.parameters()
    assert train.slowest == scheduled["Minimum Speed"].default
    assert train.fastest == scheduled["Maximum Speed"].default
    assert train.turns == calibration["Number Of Turns"].default
    assert SMALLEST_CIRCLE == SMALLEST_RADIUS


@pytest.mark.parametrize(
    ("z", "custom", "circles", "moves"),
    [
        (0.0, "", True, 85.0),
        (8.0, "", False, 85.0),
        (8.0, "", True, 145.0),
        (8.0, "Under Water=circle", False, 145.0),
        (8.0, "Under Water=surface", True, 85.0),
    ],
)
def test_a_circle_under_water_needs_the_motor_all_the_time(z, custom, circles, moves):
    below = {"z": z, "z_units": imc.ZUnits.DEPTH, "custom": custom}
    station = imc.StationKeeping(**place(90, 0), **below, speed=1.0, duration=60)
    train = Powertrain(circles=circles)
    assert estimate_maneuver(station, (LAT, LON), train, now=10.0).moving == pytest.approx(moves, abs=0.3)


def test_what_is_unknown_is_not_a_number():
    assert math.isnan(estimate_maneuver(imc.CustomManeuver(), (LAT, LON), Powertrain(), 0.0).seconds)
    assert math.isnan(estimate_maneuver(imc.Goto(speed=0.0), (LAT, LON), Powertrain(), 0.0).seconds)


def test_energy_decides():
    far = plan_of(goto(9_000, 0))
    assert preflight().check(far, KINDS, HERE, 100.0, 0.0).energy > 0
    with pytest.raises(PlanError, match=r"the plan needs \d+ W h and the battery has 70 W h"):
        preflight().check(far, KINDS, HERE, 10.0, 0.0)


@pytest.mark.parametrize(
    ("option", "text", "reason"),
    [
        ("Battery Capacity", "much", "'much' is not a number"),
        ("Speed Conversion -- MPS", "0, x", "are not numbers"),
        ("Speed Conversion -- MPS", "1, 0, 2", "rising numbers"),
        ("Speed Conversion -- MPS", "0, 1", "must have as many values"),
        ("Power Model -- Conversion - RPM", "0, 1", "must have as many values"),
    ],
)
def test_bad_profiles_are_named(option, text, reason):
    with pytest.raises(PreflightOptionError, match=reason):
        preflight(**{option: text})


def test_a_power_model_of_one_value_is_a_proportion_and_numbers_may_have_units():
    one = {"Power Model -- Conversion - RPM": "1000 rpm", "Power Model -- Conversion - Watt": "50.0f"}
    two = {"Power Model -- Conversion - RPM": "0, 1000", "Power Model -- Conversion - Watt": "0, 50"}
    far = plan_of(goto(9_000, 0))
    energies = [preflight(**options).check(far, KINDS, HERE, 100.0, 0.0).energy for options in (one, two)]
    assert energies[0] == energies[1] > 0.0


def test_interpolation_goes_on_beyond_the_ends():
    assert [interpolate(x, (0.0, 1.0, 2.0), (0.0, 10.0, 30.0)) for x in (-1, 0.5, 1.5, 3)] == [-10.0, 5.0, 20.0, 50.0]


@pytest.mark.parametrize("depth", ["-5", "nan"])
def test_a_vehicle_that_may_not_even_float_is_refused(depth):
    with pytest.raises(PreflightOptionError, match="Absolute Maximum Depth"):
        preflight(**{"Absolute Maximum Depth": depth})


def test_a_start_from_rest_costs_a_distance_once_and_after_each_rest():
    def forecast(*maneuvers, **changes):
        found = preflight(**changes).check(plan_of(*maneuvers), KINDS, HERE, None, 0.0)
        return [estimate.seconds for estimate in found.estimates.values()], found.energy

    legs = goto(100, 0), goto(200, 0), imc.IdleManeuver(duration=10), goto(300, 0)
    (before, less), (after, more) = forecast(*legs), forecast(*legs, **{"Run-Up Distance": "6"})
    lost = [b - a for a, b in zip(before, after, strict=True)]
    speed, standing = legs[0].speed, imc.FollowSystem(duration=60, z_units=imc.ZUnits.DEPTH)
    assert lost == pytest.approx([6.0 / speed, 0.0, 0.0, 6.0 / speed])
    assert more > less
    following = preflight(**{"Run-Up Distance": "6"}).check(
        plan_of(standing.replace(speed=1.0)), [standing.ID], HERE, None, 0.0
    )
    assert following.estimates["m0"].seconds == 60.0
    with pytest.raises(PlanError, match="m0: speed must be above 0"):
        preflight().check(plan_of(standing), [standing.ID], HERE, None, 0.0)
    with pytest.raises(PreflightOptionError, match="must be 0 m or more"):
        preflight(**{"Run-Up Distance": "-1"})
