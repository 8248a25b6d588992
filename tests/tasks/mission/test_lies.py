"""Sensors of the shipped vehicles that lie while a plan is flown: what is believed, and who is named."""

import math
from functools import cache

import pytest
from flying import place, plan_of

import imc
from autonomy.navigation import DepthCheck
from tests.tasks.mission.lies import (
    AHRS,
    BAROMETER,
    BLIND,
    DEEP,
    DEPTH,
    DVL,
    FAR,
    FAULT,
    GPS,
    MOTOR,
    NAVIGATION,
    SOUNDER,
    Flight,
    Mode,
    all_of,
    before,
    fixes_under_water,
    gaps,
    late,
    lies,
)
from tests.tasks.mission.underway import underway

# a lie that is noticed and rejected: the plan goes on, and the estimate stays true
HARMLESS = {
    "depth, one sample of 1e6 m": (lies(DEPTH, imc.Depth, ("value", 1e6), times=1), 2.0),
    "depth, every tenth sample": (
        lies(DEPTH, imc.Depth, ("value", lambda z, t: 1e3 if round(10 * t) % 10 == 0 else z)),
        2.0,
    ),
    "GPS, fixes under water": (fixes_under_water, 2.0),
    "heading, one sample": (lies(AHRS, imc.EulerAngles, ("psi", 3.0), times=1), 2.0),
    "pitch, one sample": (lies(AHRS, imc.EulerAngles, ("theta", 1e6), times=1), 2.0),
    "rate, one sample": (lies(AHRS, imc.AngularVelocity, ("z", 1e6), times=1), 2.0),
    "DVL, one sample along": (lies(DVL, imc.GroundVelocity, ("x", 1e6), times=1), 2.0),
    "DVL, one sample down": (lies(DVL, imc.GroundVelocity, ("z", 1e6), times=1), 2.0),
    "DVL, not a number": (lies(DVL, imc.GroundVelocity, ("x", math.nan)), 2.0),
    "DVL, infinite": (lies(DVL, imc.GroundVelocity, ("y", math.inf)), 2.0),
    "DVL, stuck": (lies(DVL, imc.GroundVelocity, ("x", None), ("y", None), ("z", None), ("validity", 7)), 3.0),
    "DVL, backward": (lies(DVL, imc.GroundVelocity, ("x", lambda u, t: -u)), 20.0),
    "motor, one sample": (lies(MOTOR, imc.Rpm, ("value", 32767), times=1), 2.0),
    "times in the past": (lies(DEPTH, imc.Depth, ("timestamp", 1.0)), 2.0),
    "times in the future": (lies(AHRS, imc.EulerAngles, ("timestamp", 4e9), ("time", 4e9)), 2.0),
}
SINKING, TURNING = "depth does not follow the vertical speed", "heading does not follow the turn rate"
TURNED = lies(AHRS, imc.EulerAngles, ("psi", lambda psi, t: psi + 1.5))
# a lie that ends the plan: what the error says, and the longest time to it (s)
UNTRUE = {
    "depth stays at 0": (lies(DEPTH, imc.Depth, ("value", 0.0)), SINKING, 5.0),
    "depth stuck": (lies(DEPTH, imc.Depth, ("value", None)), SINKING, 8.0),
    "depth drifts": (lies(DEPTH, imc.Depth, ("value", lambda z, t: max(0.0, z - 0.5 * t))), SINKING, 8.0),
    "depth jumps": (lies(DEPTH, imc.Depth, ("value", lambda z, t: z + 10.0)), SINKING, 4.0),
    "depth not a number": (lies(DEPTH, imc.Depth, ("value", math.nan)), "depth is missing", 5.5),
    "attitude stuck": (
        lies(AHRS, imc.EulerAngles, ("phi", None), ("theta", None), ("psi", None)),
        "attitude is stuck",
        3.0,
    ),
    "pitch stuck": (lies(AHRS, imc.EulerAngles, ("theta", None)), "pitch does not follow the turn rate", 10.0),
    "heading jumps": (TURNED, TURNING, 2.0),
    "heading infinite": (lies(AHRS, imc.EulerAngles, ("psi", math.inf)), "attitude is missing", 3.0),
    "rates stuck": (lies(AHRS, imc.AngularVelocity, ("z", 0.3)), TURNING, 3.0),
    "rates not a number": (lies(AHRS, imc.AngularVelocity, ("z", math.nan)), "turn rates are missing", 3.0),
}
# (profile, what) -> the same, for vehicles with GPS all the time
AFLOAT = {
    (profile, name): case
    for profile in ("otter", "hexa-00")
    for name, case in {
        "GPS jumps": (lies(GPS, imc.GpsFix, ("lat", lambda lat, t: lat + FAR)), "GPS has jumped by 7", 6.0),
        "GPS without satellites": (lies(GPS, imc.GpsFix, ("satellites", 0)), "GPS", 11.0),
        "GPS at 0, 0": (lies(GPS, imc.GpsFix, ("lat", 0.0), ("lon", 0.0)), "GPS", 11.0),
        "heading jumps": (TURNED, TURNING, 2.0),
    }.items()
} | {
    ("hexa-00", "pressure stuck"): (lies(BAROMETER, imc.Pressure, ("value", None)), "pressure is stuck", 3.0),
    ("hexa-00", "pressure jumps"): (
        lies(BAROMETER, imc.Pressure, ("value", lambda p, t: p - 2.0)),
        "pressure has jumped by -17 m",
        2.0,
    ),
    ("hexa-00", "GPS stuck"): (lies(GPS, imc.GpsFix, ("lat", None), ("lon", None)), "GPS fixes are missing", 6.0),
}


APART = "GPS disagrees with attitude and accelerations: the position is not trusted"
HEIGHTS = "GPS and barometer disagree on the height, which is not trusted"
# lies that a multirotor cannot steer by: it descends level
DRIFTS = (
    {
        f"{name} {rate:+g}/s": (lies(task, kind, (field, lambda value, t, rate=rate: value + rate * t)), error)
        for name, task, kind, field, rate, error in (
            ("pressure", BAROMETER, imc.Pressure, "value", 0.1, HEIGHTS),
            ("pressure", BAROMETER, imc.Pressure, "value", -0.1, HEIGHTS),
            ("height by GPS", GPS, imc.GpsFix, "height", 1.0, HEIGHTS),
            ("roll", AHRS, imc.EulerAngles, "phi", 0.02, APART),
            ("pitch", AHRS, imc.EulerAngles, "theta", 0.005, APART),
        )
    }
    | {
        f"pressure with a noise of {noise} hPa": (
            lies(BAROMETER, imc.Pressure, ("value", lambda p, t, noise=noise: p + noise * (-1.0) ** round(t * 7.3))),
            "pressure jumps",
        )
        for noise in (0.2, 1.0, 5.0)
    }
    | {
        f"fixes that scatter by {size} m": (
            lies(
                GPS, imc.GpsFix, ("lat", lambda lat, t, m=size: lat + m / 6.4e6 * math.cos(7.0 * round(5.0 * t) ** 2))
            ),
            "GPS fixes jump",
        )
        for size in (15.0, 30.0, 60.0)
    }
    | {
        "roll jumps": (
            lies(AHRS, imc.EulerAngles, ("phi", lambda phi, t: phi + 0.3)),
            "roll does not follow the turn rate",
        )
    }
)


@pytest.fixture(scope="module")
def fly():
    """Flies a vehicle on from the moment at which it begins to lie, up to which all of one kind are the same."""
    state = cache(before)
    return lambda folder, inject, flight="lauv-noptilus-1", seconds=50.0: Flight(state(flight), folder, inject, seconds)


@pytest.mark.parametrize("lie", HARMLESS)
def test_a_lie_that_others_contradict_is_rejected_and_the_plan_goes_on(lie, fly, tmp_path):
    inject, astray = HARMLESS[lie]
    flight = fly(tmp_path, inject, seconds=42.0)
    assert set(flight.modes) == {Mode.MANEUVER}
    assert flight.astray < astray
    assert flight.wrong_depth < 0.5
    assert flight.depths[-1] == pytest.approx(6.0, abs=0.5)


@pytest.mark.parametrize("lie", UNTRUE)
def test_a_sensor_that_lies_on_and_on_is_named_and_the_vehicle_comes_up(lie, fly, tmp_path):
    inject, error, seconds = UNTRUE[lie]
    flight = fly(tmp_path, inject)
    assert flight.failed <= seconds
    assert flight.errors[0] == f"Navigation: {error}"
    assert Mode.MANEUVER not in flight.modes[flight.modes.index(Mode.ERROR) :]
    assert max(flight.depths) < 7.0
    assert flight.depths[-1] < flight.depths[-1000] - 0.5 or flight.depths[-1] < 0.3


def test_a_depth_beyond_the_limit_names_its_sensor(fly, tmp_path):
    flight = fly(tmp_path, lies(DEPTH, imc.Depth, ("value", 1e6), times=20))
    assert flight.failed <= 2.0
    assert flight.errors[0] == "Failsafe: depth 1000000.0 m (Depth Sensor) is deeper than the limit of 50 m"


@pytest.mark.parametrize(("profile", "lie"), AFLOAT)
def test_a_lie_on_boats_and_multirotors_ends_the_plan(profile, lie, fly, tmp_path):
    inject, error, seconds = AFLOAT[profile, lie]
    flight = fly(tmp_path, inject, profile, 37.0)
    assert flight.failed <= seconds
    assert flight.errors[0].startswith(f"Navigation: {error}")


@pytest.mark.heavy
@pytest.mark.computing
@pytest.mark.parametrize("profile", ["otter", "caravel"])
def test_fixes_that_drift_away_from_their_own_speed_end_the_plan_of_a_boat(profile, fly, tmp_path):
    drifting = lies(GPS, imc.GpsFix, ("lat", lambda lat, t: lat + 0.6 * t / 6.371e6))
    flight = fly(tmp_path, drifting, profile, 80.0)
    assert flight.errors[0] == "Navigation: GPS drifts away from its own speed"
    assert flight.failed < 45.0
    assert Mode.MANEUVER not in flight.modes[flight.modes.index(Mode.ERROR) :]


@pytest.mark.parametrize("lie", DRIFTS)
def test_a_multirotor_whose_sensors_drift_apart_comes_down(lie, fly, tmp_path):
    inject, error = DRIFTS[lie]
    flight = fly(tmp_path, inject, "hexa-00", 170.0)
    assert flight.errors[0].startswith((f"Navigation: {error}", "Autopilot: pressure does not follow the acceleration"))
    assert -min(flight.depths) < 60.0
    assert flight.depths[-1] == pytest.approx(0.0, abs=0.1)


@pytest.mark.heavy
@pytest.mark.parametrize("drift", [0.3, 0.6, -3.2])
def test_a_multirotor_whose_gps_drifts_against_its_own_velocity_lands_where_it_is(drift, fly, tmp_path):
    drifts = lies(GPS, imc.GpsFix, ("lat", lambda lat, t: lat + drift * t / 6.37e6))
    flight = fly(tmp_path, drifts, "hexa-00", 170.0)
    assert flight.errors[0] == "Navigation: GPS position moves against its own velocity"
    assert flight.astray < 12.0
    assert flight.depths[-1] == pytest.approx(0.0, abs=0.1)
    assert flight.touchdown < 1.0


@pytest.mark.heavy
@pytest.mark.parametrize("angle", ["phi", "theta", "psi"])
def test_a_multirotor_uses_no_attitude_in_degrees(angle, fly, tmp_path):
    degrees = lies(AHRS, imc.EulerAngles, (angle, lambda value, t: math.degrees(value) + 100.0))
    flight = fly(tmp_path, degrees, "hexa-00", 60.0)
    assert flight.errors[0] == "Navigation: attitude is impossible in radians"
    assert flight.wrong_depth < 1.0
    assert flight.touchdown < 2.5


FEET = lies(GPS, imc.GpsFix, ("height", lambda h, t: 3.2808 * h))
METERS = lies(GPS, imc.GpsFix, ("height", lambda h, t: 0.3048 * h))
# how much higher than 10 m it may be
CLIMBS = {
    f"{angle} in {unit} for 8 s": lies(AHRS, imc.EulerAngles, (angle, lambda v, t, k=factor: k * v if t < 8.0 else v))
    for angle in ("phi", "theta")
    for unit, factor in (("degrees", 57.3), ("milliradians", 1000.0))
} | {
    "a barometer with gaps, GPS in feet": all_of(gaps(BAROMETER, 7.0, 4.0), FEET),
    "a barometer with gaps, GPS too low": all_of(gaps(BAROMETER, 7.0, 4.0), METERS),
    "no barometer, GPS in feet": all_of(gaps(BAROMETER, 1e3, 1e3), FEET),
    "no barometer, GPS too low": all_of(gaps(BAROMETER, 1e3, 1e3), METERS),
    "GPS in feet, then no barometer": all_of(
        FEET, lambda vehicle: vehicle.kernel.after(9.0, gaps(BAROMETER, 1e3, 1e3), vehicle)
    ),
    "a navigation that repeats itself": lies(NAVIGATION, imc.EstimatedState, ("z", -8.0), ("alt", 8.0), ("vz", 0.0)),
    "a navigation that sinks on and on": lies(
        NAVIGATION, imc.EstimatedState, ("z", lambda z, t: z + t), ("alt", lambda z, t: max(0.0, z - t))
    ),
    "a navigation that falls": lies(NAVIGATION, imc.EstimatedState, ("vz", lambda v, t: v + t)),
}


@pytest.mark.heavy
@pytest.mark.parametrize("lie", CLIMBS)
def test_a_multirotor_does_not_climb_by_a_height_that_others_contradict(lie, fly, tmp_path):
    flight = fly(tmp_path, CLIMBS[lie], "hexa-00", 200.0)
    assert -min(flight.depths) < 30.0
    assert flight.errors
    assert flight.depths[-1] == pytest.approx(0.0, abs=0.1)
    assert flight.touchdown <= 2.5


def test_a_navigation_that_restarts_in_the_air_still_knows_the_ground(fly, tmp_path):
    def fail():
        raise RuntimeError("broken")

    def inject(vehicle):
        vehicle.kernel.after(0.0, fail).owner = vehicle.task("Navigation.UAV.Navigation")

    flight = fly(tmp_path, inject, "hexa-00", 130.0)
    assert min(flight.depths) < -8.0
    assert flight.wrong_depth < 2.0
    assert flight.astray < 5.0
    assert flight.depths[-1] == pytest.approx(0.0, abs=0.1)


@pytest.mark.heavy
@pytest.mark.parametrize("task", [AHRS, BAROMETER])
def test_a_multirotor_whose_sensors_are_two_seconds_late_comes_down(task, fly, tmp_path):
    flight = fly(tmp_path, late(task, 2.0), "hexa-00", 200.0)
    assert flight.depths[-1] == pytest.approx(0.0, abs=0.1)


@pytest.mark.parametrize("profile", ["otter", "caravel", "hexa-00"])
def test_one_fix_far_away_moves_nothing(profile, fly, tmp_path):
    once = lies(GPS, imc.GpsFix, ("lat", lambda lat, t: lat + FAR), ("sog", 1e6), times=1)
    flight = fly(tmp_path, once, profile, 35.0)
    assert set(flight.modes) == {Mode.MANEUVER}
    assert flight.astray < 3.0


@pytest.mark.heavy
def test_a_depth_that_is_stuck_is_found_in_the_gentlest_dive(fly, tmp_path):
    flight = fly(tmp_path, lies(DEPTH, imc.Depth, ("value", 0.0)), "lauv-noptilus-1, gently", 80.0)
    assert flight.failed < 40.0
    assert flight.errors[0] == "Navigation: depth is stuck"
    assert max(flight.depths) < 6.0


def test_a_depth_that_lies_is_uncertain(fly, tmp_path):
    flight = fly(tmp_path, UNTRUE["depth stuck"][0], seconds=40.0)
    assert max(depth for _, depth in flight.variances) > 4.0


def test_an_altimeter_that_is_stuck_is_not_believed(fly, tmp_path):
    def stick(vehicle):
        lies(SOUNDER, imc.Distance, ("value", 20.0))(vehicle)

    flight = fly(tmp_path, stick, seconds=40.0)
    assert "active without altitude" in flight.said


@pytest.mark.heavy
@pytest.mark.computing
@pytest.mark.parametrize(("rate", "longest"), [(-0.03, 160.0), (-0.06, 55.0), (0.06, 55.0)])
def test_a_depth_that_drifts_slowly_ends_the_plan(rate, longest, fly, tmp_path):
    drifting = lies(DEPTH, imc.Depth, ("value", lambda z, t: z + rate * t))
    flight = fly(tmp_path, drifting, seconds=FAULT + longest + 20.0)
    assert flight.errors[0] == "Navigation: depth drifts away from the vertical speed"
    assert flight.failed < longest
    assert max(flight.depths) < 6.5 + abs(rate) * flight.failed
    assert flight.depths[-1] < flight.depths[-1500] - 0.5


@pytest.mark.heavy
@pytest.mark.computing
def test_no_drift_is_found_in_a_yoyo_against_current_and_waves(monkeypatch, tmp_path):
    largest = 0.0
    judge = DepthCheck.evaluate

    def note(check, *measured):
        nonlocal largest
        decision = judge(check, *measured)
        largest = max(largest, check.drift)
        return decision

    monkeypatch.setattr(DepthCheck, "evaluate", note)
    yoyo = imc.YoYo(**place(160, 0), z=10.0, z_units=imc.ZUnits.DEPTH, amplitude=9.5, pitch=0.26, speed=1.4)
    current = "Simulators.StreamVelocity:Default Speed North=-0.4"
    state = underway("lauv-noptilus-1", plan_of(yoyo), FAULT, DEEP, BLIND, current, "World:Wave Height=1.0")
    flight = Flight(state, tmp_path, lambda vehicle: None, seconds=160.0)
    assert not flight.errors
    assert max(flight.depths) > 15.0
    assert 0.05 < largest < 1.0, "it measures, and half of what is a fault is far away"


@pytest.mark.heavy
@pytest.mark.parametrize("lie", [lambda d, t: 30.0 + 0.1 * math.sin(9.0 * t), lambda d, t: d + min(10.0, t)])
def test_an_altimeter_that_leads_to_the_bottom_does_not_keep_the_vehicle_there(lie, fly, tmp_path):
    lying = lies(SOUNDER, imc.Distance, ("value", lie))
    flight = fly(tmp_path, lying, "lauv-noptilus-1, in the basin", seconds=75.0)
    assert max(flight.depths) > 3.8, "it gets there"
    assert flight.errors[0] == "Speed Control: not moving though the motor runs"
    assert flight.failed < 40.0
    assert flight.depths[-1] < max(flight.depths) - 0.5
