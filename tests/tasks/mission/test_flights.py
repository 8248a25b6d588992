"""Plans of the profile hexa-00 with its full simulation, and faults in the air."""

import hashlib
import math

import pytest
from aloft import CCU, HEAD, HOVER, OWN, Flight, load
from lean import UNLOGGED

import imc
from runtime.kernel import VirtualClock
from runtime.profile import load_profile
from runtime.vehicle import build
from shoal import fly
from shoal.missions import parse_plan, plan_text
from tests.repeats import all_but

SQUARE = parse_plan(
    "plan: square\n"
    + HEAD
    + """
  - takeoff: {altitude: 10, speed: 2 m/s}
  - goto: {north: 40}
  - goto: {north: 40, east: 40, altitude: 30}
  - goto: {east: 40, height: 104.6}
  - loiter: {north: 0, radius: 15, duration: 20}
  - loiter: {north: 0, duration: 5, type: HOVER}
  - land: {north: 0}
"""
)


@pytest.mark.heavy
def test_a_square_at_several_heights():
    report = fly(SQUARE, "hexa-00", limit=600, overrides=[UNLOGGED])
    assert report.completed, report.reason
    assert report.maneuvers == ["Takeoff1", "Goto2", "Goto3", "Goto4", "Loiter5", "Loiter6", "Land7"]
    assert report.cross_track < 1.5
    assert report.depth_error <= 0.5
    assert report.distance == pytest.approx(280.0, abs=40.0)


@pytest.mark.heavy
def test_an_area_in_wind():
    plan = parse_plan(
        "plan: area\n"
        + HEAD
        + """
  - takeoff: {}
  - rows: {north: 10, width: 30, length: 60, hstep: 10, bearing: 30°}
  - follow_path: {north: 0, points: [[20, 0, 0], [20, 20, 5], [0, 0, 10]]}
  - land: {}
"""
    )
    report = fly(plan, "hexa-00", limit=600, overrides=[UNLOGGED, "Simulators.StreamVelocity:Default Speed North=-7"])
    assert report.completed, report.reason
    assert report.cross_track < 1.5


@pytest.mark.parametrize(
    ("maneuvers", "reason"),
    [
        ("  - goto: {north: 10}", "Goto1: the vehicle is on the ground, a Takeoff must come first"),
        ("  - takeoff: {altitude: 130}", "Takeoff1: an altitude of 130 m is above the limit of 120 m"),
        ("  - takeoff: {}\n  - goto: {north: 10, depth: 2}", "Goto2: an aerial vehicle cannot go to a depth"),
        ("  - takeoff: {}\n  - goto: {north: 5100}", "Goto2: a leg of 5.1 km is longer than 5 km"),
        (
            "  - takeoff: {}\n  - loiter: {north: 9, radius: 9, duration: 1h}",
            "the plan needs 356 W h and the battery has",
        ),
        ("  - takeoff: {}\n  - pop_up: {north: 10}", "PopUp2: maneuver is not supported"),
    ],
)
def test_plans_that_cannot_be_flown_are_refused(maneuvers, reason):
    report = fly(parse_plan("plan: refused\n" + HEAD + maneuvers), "hexa-00", limit=60)
    assert not report.completed
    assert report.reason.startswith(reason)
    assert report.legs == []


def test_takeoff_and_landing_are_written_as_they_are_read():
    text = plan_text(SQUARE)
    assert "Takeoff" in text
    assert imc.encode(parse_plan(text)) == imc.encode(SQUARE)


@pytest.mark.heavy
def test_an_abort_lands_it_where_it_is(tmp_path):
    flight = Flight(tmp_path, (35.0, imc.Abort(src=CCU, dst=OWN)), seconds=65.0, until_down=True)
    assert flight.modes == ["GROUND", "GUIDED", "LAND", "GROUND"]
    assert "ERROR" in flight.op_modes
    assert (flight.end.x, flight.end.y, flight.end.z) == (
        pytest.approx(30.0, abs=2.0),
        pytest.approx(0.0, abs=2.0),
        0.0,
    )
    assert flight.touchdown < 1.0


@pytest.mark.heavy
def test_a_plan_that_is_stopped_leaves_it_hovering_and_a_new_one_begins_in_the_air(tmp_path):
    stop = imc.PlanControl(op=imc.PlanControl.Op.STOP, dst=OWN, src=CCU)
    there = parse_plan("plan: there\n" + HEAD + "  - goto: {north: 0, altitude: 15}\n  - land: {}")
    again = imc.PlanControl(op=imc.PlanControl.Op.START, plan_id="there", arg=there, dst=OWN, src=CCU)
    flight = Flight(tmp_path, (35.0, stop), (45.0, again), seconds=90.0)
    assert flight.modes == ["GROUND", "GUIDED", "LOITER", "GUIDED", "GROUND"]
    assert (flight.end.x, flight.end.z) == (pytest.approx(0.0, abs=2.0), 0.0)


@pytest.mark.heavy
@pytest.mark.parametrize(
    ("task", "modes", "hardest"),
    [
        ("Simulators.GPS", ["GUIDED", "LOITER", "LAND", "GROUND"], 1.0),
        ("Simulators.Barometer", ["GUIDED", "LOITER", "LAND", "GROUND"], 1.5),
        ("Simulators.IMU/AHRS", ["GUIDED", "BLIND", "GROUND"], 2.5),
        ("Navigation.UAV.Navigation", ["GUIDED", "BLIND", "GROUND"], 2.5),
        ("Control.UAV.Path", ["GUIDED", "LOITER", "LAND", "GROUND"], 1.0),
        ("Supervisors.Vehicle", ["GUIDED", "LAND", "GROUND"], 1.0),
        ("Supervisors.Failsafe", ["GUIDED", "LOITER", "LAND", "GROUND"], 1.0),
        ("Plan.Engine", ["GUIDED", "LAND", "GROUND"], 1.0),
        ("Monitors.Entities", ["GUIDED", "LAND", "GROUND"], 1.0),
        ("Monitors.FuelLevel", ["GUIDED", "LAND", "GROUND"], 1.0),
        ("Simulators.Battery", ["GUIDED", "LOITER", "LAND", "GROUND"], 1.0),
        ("Control.UAV.Autopilot", ["GUIDED"], 2.5),
    ],
)
def test_what_falls_silent_in_the_air_brings_it_down_softly(tmp_path, task, modes, hardest):
    idle = ["Control.UAV.Autopilot:Idle Timeout=10"]
    flight = Flight(tmp_path, (25.0, task), seconds=100.0, overrides=idle, until_down=True)
    assert flight.modes[1:] == modes
    assert "ERROR" in flight.op_modes or task == "Supervisors.Vehicle"
    assert flight.end.z == 0.0
    assert flight.touchdown < hardest


@pytest.mark.heavy
@pytest.mark.parametrize("kilograms", all_but((-1.0, 1.0), [-1.0, 0.25, 0.5, 1.0]))
@pytest.mark.parametrize("when", [15.0, 29.0], ids=["before", "meanwhile"])
@pytest.mark.parametrize("task", ["Navigation.UAV.Navigation", "Simulators.IMU/AHRS"])
def test_a_load_makes_no_landing_without_a_state_hard(tmp_path, task, kilograms, when):
    flight = Flight(tmp_path, (when, load(kilograms)), (25.0, task), seconds=100.0, until_down=True)
    assert flight.modes[-2:] == ["BLIND", "GROUND"]
    assert flight.end.z == 0.0
    assert flight.touchdown < 2.5


@pytest.mark.heavy
@pytest.mark.parametrize("kilograms", all_but([-1.5, 1.5], [-1.5, -1.0, 1.5]))
def test_a_load_that_is_dropped_or_added_in_the_air_is_no_touchdown(tmp_path, kilograms):
    flight = Flight(tmp_path, (20.0, load(kilograms)), seconds=45.0)
    assert flight.modes == ["GROUND", "GUIDED"]
    assert flight.end.z == pytest.approx(-15.0, abs=1.5)


@pytest.mark.heavy
def test_without_supervisor_and_failsafe_it_lands(tmp_path):
    silent = (25.0, "Supervisors.Failsafe"), (25.0, "Supervisors.Vehicle")
    flight = Flight(tmp_path, *silent, seconds=70.0, until_down=True)
    assert flight.modes[-2:] == ["LAND", "GROUND"]
    assert flight.end.z == 0.0
    assert flight.touchdown < 1.0


@pytest.mark.heavy
def test_a_battery_that_runs_low_ends_the_plan_and_lands_it(tmp_path):
    flight = Flight(tmp_path, seconds=110.0, overrides=["Monitors.FuelLevel:Initial Level=28"], until_down=True)
    assert flight.modes == ["GROUND", "GUIDED", "LOITER", "LAND", "GROUND"]
    assert "the battery is below its reserve of 25 %" in flight.log
    assert "landing: the vehicle is in error" in flight.log
    assert flight.volts[-1] > 14.0, "it is not empty"
    assert flight.end.z == 0.0


def test_it_does_not_take_off_if_the_battery_itself_says_that_it_is_low(tmp_path):
    flight = Flight(tmp_path, seconds=30.0, overrides=["Simulators.Battery:Initial Level=2"])
    assert flight.modes == ["GROUND"]
    assert flight.end.z == 0.0
    assert any(text.startswith("Batteries: fuel reserve") for text in flight.log)


def test_hovering_takes_the_power_that_carries_the_weight(tmp_path):
    flight = Flight(tmp_path, seconds=40.0)
    powers = [volt * ampere for volt, ampere in zip(flight.volts, flight.amperes, strict=True)]
    induced = (3.0 * 9.80665) ** 1.5 / math.sqrt(2.0 * 1.225 * 6.0 * math.pi * 0.127**2)  # W, momentum theory
    assert sum(powers[-10:]) / 10.0 == pytest.approx(15.0 + induced / 0.55, rel=0.05)
    assert powers[1] == pytest.approx(15.0, rel=0.01)
    assert 14.0 < flight.volts[-1] < flight.volts[1] < 17.0


def test_beyond_the_limits_the_plan_ends(tmp_path):
    limits = imc.OperationalLimits(dst=OWN, src=CCU, mask=imc.OpLimitsMask.MAX_ALT, max_altitude=10.0)
    flight = Flight(tmp_path, (25.0, limits), seconds=40.0)
    assert "vehicle errors: Operational Limits" in flight.log
    assert "LAND" in flight.modes


@pytest.mark.heavy
def test_two_flights_are_the_same(tmp_path):
    def digest(folder):
        Flight(folder, seconds=30.0, logged=True)
        logs = sorted(folder.rglob("Data.lsf.gz"))
        assert len(logs) == 2
        return [hashlib.sha256(log.read_bytes()).hexdigest() for log in logs]

    assert digest(tmp_path / "first") == digest(tmp_path / "second")


def test_without_a_plan_of_others_it_flies_circles(tmp_path):
    profile = load_profile("hexa-00")
    made = build(
        profile, profile.parse_modes("Simulation"), clock=VirtualClock(profile.start_time_ns), log_root=tmp_path
    )
    heights = []
    made.vehicle.observe(imc.SimulatedState, lambda m: heights.append(m.z))
    made.vehicle.start()
    made.vehicle.run(25.0)
    made.vehicle.close()
    assert min(heights) == pytest.approx(-15.0, abs=1.5)


@pytest.mark.heavy
def test_the_area_bounds_plans_and_flights(tmp_path):
    area = ["Monitors.OperationalLimits:Initial Setting - Area Center=41.185, -8.7062"]
    size = "Monitors.OperationalLimits:Initial Setting - Area Size="
    report = fly(HOVER, "hexa-00", limit=60, overrides=[*area, size + "50, 50"])
    assert report.reason == "StationKeeping2: is outside the area of the operational limits"
    smaller = imc.OperationalLimits(dst=OWN, src=CCU, mask=imc.OpLimitsMask.AREA, length=20.0, width=20.0)
    center = {"lat": math.radians(41.185), "lon": math.radians(-8.7062)}
    flight = Flight(tmp_path, (25.0, smaller.replace(**center)), seconds=60.0, overrides=[*area, size + "90, 90"])
    assert "vehicle errors: Operational Limits" in flight.log
    assert flight.modes[-2:] == ["LAND", "GROUND"]
