"""The forecast of each maneuver of the shipped vehicles, compared with its flight."""

import math
import tempfile
from itertools import pairwise
from pathlib import Path
from typing import NamedTuple

import pytest
from flying import plan_of
from lean import BLIND, UNLOGGED

import imc
from autonomy.plans import LatLon, PlanForecast
from runtime.profile import load_profile
from runtime.vehicle import find_task
from shoal.missions import Mission, Report, prepare
from support.wgs84 import displace, displacement
from tasks.maneuver.maneuver_task import Maneuver
from tests.repeats import all_but

pytestmark = [pytest.mark.heavy, pytest.mark.computing]

DEPTH, ALTITUDE = imc.ZUnits.DEPTH, imc.ZUnits.ALTITUDE
START = 1_767_225_600.0  # s since 1970 UTC, of the shipped vehicles
PLACE = math.radians(41.185), math.radians(-8.7062)
DEEP = ("Bathymetry:Data=", "World:Out Of Bounds Depth=60", UNLOGGED)
SECONDS = METERS = 0.2  # relative; legs are a little shorter than planned, corners and the first turn take time
ENERGY = 0.25
FAR = 70.0  # m: at 1.2 m/s, a fifth of it is as long as the least tolerance
LEAST = {"s": 12.0, "m": 15.0, "Wh": 0.5}
OF_CARAVEL = 2.0  # Wh, which it needs to get under way
LONG, PROGRESS = 60.0, 30.0  # s of a plan, and % by which its progress may be off
OFF = 12.0  # m from the end, and the radius of a circle


class Flown(NamedTuple):
    """A plan that was flown: its forecast, and the duration, length and end of its last maneuver.

    `progress` is each time (s since the plan began) and the progress (%) that was reported then.
    """

    report: Report
    forecast: PlanForecast
    statistics: imc.PlanStatistics
    seconds: float
    meters: float
    watt_hours: float
    end: LatLon
    progress: list[tuple[float, float]]


def place(north, east):
    lat, lon, _ = displace(*PLACE, 0.0, north, east)
    return {"lat": lat, "lon": lon}


def fly(profile, plan, seconds=900.0):
    """Fly a plan. Only the energy is that of all its maneuvers."""
    last = plan.maneuvers[-1].maneuver_id
    overrides = (*DEEP, BLIND) if profile.startswith("lauv") else DEEP
    with tempfile.TemporaryDirectory() as folder:
        root = Path(folder)
        made = prepare(profile, overrides=overrides, seed=1, log_root=root / "log", state_folder=root / "db")
        vehicle = made.vehicle
        mission = Mission(vehicle, plan)
        forecasts, track, power, voltage, progress = [], [], [], [], []
        engine = next(task for task in vehicle.tasks if task.name == "Plan.Engine")

        def keep_forecast(statistics):
            if statistics.type == imc.PlanStatistics.Type.PREPLAN:
                forecasts.append((engine._execution.forecast, statistics))

        def note_position(m):
            if mission.report.states[-1:] == ["EXECUTING"] and mission.report.legs[-1].name == last:
                track.append(displace(m.lat, m.lon, 0.0, m.x, m.y)[:2])

        def note_power(m):
            if mission.report.states[-1:] == ["EXECUTING"]:
                power.append(voltage[-1] * m.value)

        def note_progress(m):
            if m.state == imc.PlanControlState.State.EXECUTING:
                progress.append((m.timestamp, m.plan_progress))

        vehicle.observe(imc.PlanStatistics, keep_forecast)
        vehicle.observe(imc.PlanControlState, note_progress)
        vehicle.observe(imc.SimulatedState, note_position)
        vehicle.observe(imc.Voltage, lambda m: voltage.append(m.value))
        vehicle.observe(imc.Current, note_power)
        report = mission.fly(seconds)
    assert report.states[-1] == "READY", report
    legs = (displacement(*a, 0.0, *b, 0.0)[:2] for a, b in pairwise(track))
    meters = math.fsum(math.hypot(*leg) for leg in legs)
    mean = math.fsum(power) / len(power)
    energy = report.seconds * mean / 3600.0
    since_start = [(time - progress[0][0], percent) for time, percent in progress]
    return Flown(report, *forecasts[-1], report.legs[-1].seconds, meters, energy, track[-1], since_start)


def common(z, speed):
    """Maneuvers that each vehicle has, with the radius of the circle on which they end."""
    far, fields = place(FAR, 0), {**z, "speed": speed}
    corners = [imc.PathPoint(), imc.PathPoint(y=60.0), imc.PathPoint(x=60.0, y=60.0)]
    yield imc.Goto(**far, **fields), 0.0
    yield imc.Goto(**place(30, 20), **fields), 0.0
    yield imc.Loiter(**far, **fields, radius=20.0, duration=60), 20.0
    yield imc.StationKeeping(**far, **fields, radius=20.0, duration=60), 20.0
    yield imc.FollowPath(**far, **fields, points=corners), 0.0
    yield imc.Rows(**far, **fields, width=40.0, length=60.0, hstep=20.0, coff=5, alternation=100, flags=1), 0.0
    yield imc.IdleManeuver(duration=20), 0.0


def swimming(z):
    """Those of an AUV and of a boat."""
    far, fields = place(FAR, 0), {**z, "speed": 1.2}
    travel = {"travel_z": z["z"], "travel_z_units": DEPTH, **z}
    yield imc.RowsCoverage(**far, **fields, width=40.0, length=60.0, coff=5, flags=1, angaperture=2.1, range=10), 0.0
    yield imc.ScheduledGoto(**far, **travel, arrival_time=START + 100.0), 0.0
    yield imc.ScheduledGoto(**place(100, 0), **travel, arrival_time=START + 300.0), 0.0
    yield imc.ScheduledGoto(**far, **travel, arrival_time=START + 30.0), 0.0
    yield imc.CompassCalibration(**far, **fields, radius=20.0, duration=40), 20.0
    yield imc.CompassCalibration(**far, **fields, radius=20.0, duration=140), 20.0


def diving(z):
    """Those of an AUV only."""
    far, fields, flags = place(FAR, 0), {**z, "speed": 1.2}, imc.PopUp.Flags
    ends = {"start_z_units": DEPTH, "end_z_units": DEPTH, "speed": 1.2, "radius": 15.0}
    circle = "Under Water=circle"
    yield imc.StationKeeping(**far, **fields, radius=20.0, duration=60, custom=circle), 20.0
    yield imc.YoYo(**place(130, 0), z=3.0, z_units=DEPTH, amplitude=1.5, pitch=0.26, speed=1.2), 0.0
    yield imc.Elevator(**far, end_z=8.0, **ends), 15.0
    yield imc.Elevator(**far, start_z=8.0, end_z=1.0, **ends), 15.0
    yield imc.Elevator(flags=imc.Elevator.Flags.CURR_POS, end_z=8.0, **ends), 30.0
    yield imc.PopUp(**far, **fields, radius=15.0, duration=30, flags=flags.WAIT_AT_SURFACE), 30.0
    yield imc.Launch(**far, **fields), 0.0


def flying(z):
    """Those of a multirotor only."""
    yield imc.Takeoff(**place(0, 0), z=10.0, z_units=ALTITUDE, speed=2.0), 0.0
    yield imc.Takeoff(**place(0, 0), z=94.6, z_units=imc.ZUnits.HEIGHT, speed=2.0), 0.0
    yield imc.Land(**place(50, 0), **z, speed=5.0), 0.0
    yield imc.Land(**place(50, 0), z=94.6, z_units=imc.ZUnits.HEIGHT, speed=5.0), 0.0
    yield imc.Land(speed=5.0), 0.0
    yield imc.Loiter(**place(FAR, 0), **z, radius=20.0, duration=60, speed=5.0, type=imc.Loiter.Type.HOVER), 0.0


def cases():
    for profile in ("lauv-noptilus-1", "otter", "caravel"):
        z = {"z": 2.0 if profile.startswith("lauv") else 0.0, "z_units": DEPTH}
        found = [*common(z, 1.2), *swimming(z), *(diving(z) if profile.startswith("lauv") else ())]
        yield from ((profile, number, [], *each) for number, each in enumerate(found))
    z = {"z": 10.0, "z_units": ALTITUDE}
    up = imc.Takeoff(**place(0, 0), **z, speed=2.0)
    for number, (maneuver, radius) in enumerate([*common(z, 5.0), *flying(z)]):
        yield "hexa-00", number, [] if isinstance(maneuver, imc.Takeoff) else [up], maneuver, radius


def name(case):
    return f"{case[0]}-{type(case[3]).__name__}-{case[1]}"


ALL = list(cases())
OF_BOATS = {"otter": (0, 4, 9), "caravel": (3, 5)}  # of those that an AUV has, too
OF_OTHERS = {"lauv-noptilus-1": (1, 9)}  # a further Goto, and one on time, which a boat shows
ONCE = [
    case for case in ALL if case[1] in OF_BOATS.get(case[0], (case[1],)) and case[1] not in OF_OTHERS.get(case[0], ())
]


@pytest.mark.parametrize(("profile", "_", "before", "maneuver", "radius"), all_but(ONCE, ALL), ids=map(name, ALL))
def test_a_forecast_is_like_the_flight(profile, _, before, maneuver, radius):
    flown = fly(profile, plan_of(*before, maneuver))
    expected = flown.forecast.estimates[f"m{len(before)}"]
    assert flown.seconds == pytest.approx(expected.seconds, rel=SECONDS, abs=LEAST["s"])
    assert flown.meters == pytest.approx(expected.distance, rel=METERS, abs=LEAST["m"])
    least = OF_CARAVEL if profile == "caravel" else LEAST["Wh"]
    assert flown.watt_hours == pytest.approx(flown.forecast.energy / 3600.0, rel=ENERGY, abs=least)
    assert expected.end is not None
    assert math.hypot(*displacement(*expected.end, 0.0, *flown.end, 0.0)[:2]) <= radius + OFF
    if flown.progress[-1][0] > LONG:
        off = [(at, percent - 100.0 * at / flown.progress[-1][0]) for at, percent in flown.progress]
        assert max(abs(each) for _, each in off) < PROGRESS, off[:: max(1, len(off) // 40)]
    is_too_short = isinstance(maneuver, imc.CompassCalibration) and maneuver.duration < 100  # for a whole circle
    assert flown.report.completed is not is_too_short, flown.report.reason


@pytest.mark.parametrize("profile", ["otter", "caravel"])
@pytest.mark.parametrize("speed", all_but([0.3, 1.4], [0.3, 0.5, 1.4]))
def test_the_forecast_of_a_slow_boat_from_rest_is_within_a_tenth(profile, speed):
    """It gains speed over the same distance at each speed, which takes the longer the slower it is."""
    flown = fly(profile, plan_of(imc.Goto(**place(120.0 * speed, 0.0), z_units=DEPTH, speed=speed)))
    assert flown.watt_hours == pytest.approx(flown.forecast.energy / 3600.0, rel=0.1)
    assert flown.seconds == pytest.approx(flown.forecast.estimates["m0"].seconds, rel=0.1)


def test_a_popup_that_waits_for_a_fix_takes_at_most_the_forecast():
    popup = imc.PopUp(**place(FAR, 0), z=5.0, z_units=DEPTH, radius=15.0, speed=1.2, duration=60)
    flown = fly("lauv-noptilus-1", plan_of(popup))
    assert flown.report.completed
    assert 60.0 < flown.seconds < flown.forecast.estimates["m0"].seconds


def test_what_nobody_can_forecast_is_unknown():
    goto = imc.Goto(**place(30, 0), z=1.0, z_units=DEPTH, speed=1.2)
    flown = fly("lauv-noptilus-1", plan_of(goto, imc.Dislodge(rpm=1000.0)))
    assert flown.report.completed
    assert math.isnan(flown.forecast.seconds)
    texts = flown.statistics
    assert "Total" not in texts.durations + texts.distances + texts.fuel
    assert "Maneuver m1" not in texts.durations + texts.distances


@pytest.mark.parametrize("profile", ["lauv-noptilus-1", "otter", "caravel", "hexa-00"])
def test_every_maneuver_of_a_shipped_vehicle_is_compared_or_has_no_end(profile):
    compared = {type(maneuver) for name, _, _, maneuver, _ in ALL if name == profile}
    endless = {imc.Dislodge, imc.Teleoperation, imc.FollowReference, imc.FollowSystem}
    loaded = load_profile(profile)
    sections = [s.name for s in loaded.config.sorted_sections() if loaded.is_task_enabled(s.name, {"Simulation"})]
    classes = [find_task(section) for section in sections]
    known = {cls.message_type() for cls in classes if cls is not None and issubclass(cls, Maneuver)}
    assert known - compared - endless - {imc.PopUp} == set()
    assert compared <= known
