"""Missions of fully simulated boats: legs, corners, stations, wind, current, operators."""

import math
from itertools import product
from pathlib import Path

import pytest

import imc
from runtime.kernel import VirtualClock
from runtime.profile import load_profile
from runtime.vehicle import build
from shoal import fly
from shoal.missions import load_plan
from shoal.rerun import resimulate
from tests.repeats import all_but
from tests.tasks.mission.boats import ALTITUDE, BOATS, DEPTH, at, goto, plan_of, sail

CONTROLLERS = {
    "otter": ("Control.ASV.HeadingAndSpeed",),
    "caravel": ("Control.ASV.Conventional.Heading", "Control.ASV.Conventional.Speed"),
}
HARBOR = Path(__file__).parents[2] / "data/plans/harbor.yaml"
CURRENT = ("Simulators.StreamVelocity:Default Speed East=0.3",)
NORTHWARD = ("Simulators.StreamVelocity:Default Speed North=0.3",)
WIND = ("Simulators.Wind:Speed=6", "Simulators.Wind:Direction=45", "Simulators.Wind:Gusts=1")
WEATHER = {"calm": (), "east": CURRENT, "north": NORTHWARD, "wind": WIND}


@pytest.mark.heavy
@pytest.mark.computing
@pytest.mark.parametrize(("boat", "corner"), all_but([("caravel", 3.5)], [("otter", 2.5), ("caravel", 3.5)]))
def test_a_plan_is_flown_along_its_legs_and_around_its_corners(boat, corner):
    voyage = sail(boat, load_plan(HARBOR))
    assert voyage.report.completed, voyage.report.reason
    assert voyage.report.maneuvers == ["Goto1", "Goto2", "Goto3", "StationKeeping4"]
    assert voyage.report.deepest == 0.0
    states = voyage.of(imc.SimulatedState)
    assert max(m.x for m in states) < 60.0 + corner
    assert max(m.y for m in states) < 60.0 + corner
    straight = [abs(m.y) for m in states if 20.0 < m.x < 48.0 and m.y < 20.0 and abs(m.psi) < 1.0]
    assert straight
    assert max(straight) < 1.0
    cruising = [m.u for m in voyage.of(imc.SimulatedState, 25.0, 35.0)]
    assert sum(cruising) / len(cruising) == pytest.approx(1.5, abs=0.05)
    end = voyage.heard[imc.SimulatedState][-1][0]
    assert max(voyage.distances(imc.SimulatedState, end - 120.0, end, (20.0, 20.0))) < 15.0


@pytest.mark.heavy
@pytest.mark.parametrize(("boat", "beyond"), all_but([("otter", 3.0)], [("otter", 3.0), ("caravel", 10.0)]))
def test_a_station_is_kept_in_a_current(boat, beyond):
    station = imc.StationKeeping(**at(30, 20), z_units=DEPTH, speed=1.2, radius=15, duration=150)
    voyage = sail(boat, plan_of(station), *CURRENT)
    assert voyage.report.completed, voyage.report.reason
    end = voyage.heard[imc.SimulatedState][-1][0]
    distances = voyage.distances(imc.SimulatedState, end - 150.0, end, (30.0, 20.0))
    assert max(distances) < 15.0 + beyond
    assert sum(distance < 15.0 for distance in distances) > 0.75 * len(distances)
    assert min(m.value for m in voyage.of(imc.DesiredSpeed)) < 0.8


@pytest.mark.heavy
@pytest.mark.computing
@pytest.mark.parametrize(
    ("boat", "weather"), all_but([("otter", "wind"), ("caravel", "north")], product(BOATS, WEATHER))
)
def test_a_station_behind_a_sharp_turn_is_reached(boat, weather):
    station = imc.StationKeeping(**at(20, 20), z_units=DEPTH, speed=1.2, radius=15, duration=10)
    voyage = sail(boat, plan_of(goto(40, 0), goto(40, 30), station), *WEATHER[weather])
    assert voyage.report.completed, voyage.report.reason
    end = voyage.heard[imc.SimulatedState][-1][0]
    assert max(voyage.distances(imc.SimulatedState, end - 10.0, end, (20.0, 20.0))) < 15.0


@pytest.mark.heavy
@pytest.mark.parametrize("boat", all_but(["caravel"], BOATS))
def test_a_leg_across_current_and_wind_is_followed(boat):
    voyage = sail(boat, plan_of(goto(20, 0), goto(90, 0)), *CURRENT, *WIND)
    assert voyage.report.completed, voyage.report.reason
    assert max(abs(m.y) for m in voyage.of(imc.SimulatedState) if m.x > 60.0) < 1.0
    assert max(m.x for m in voyage.of(imc.SimulatedState)) > 80.0


@pytest.mark.heavy
@pytest.mark.computing
def test_areas_paths_and_circles_are_sailed():
    field_ = imc.Rows(**at(20, 0), z_units=DEPTH, speed=1.5, width=10, length=30, hstep=10, bearing=0.3)
    points = [imc.PathPoint(x=10), imc.PathPoint(x=10, y=30)]
    track = imc.FollowPath(**at(0, 0), z_units=DEPTH, speed=1.5, points=points)
    circle = imc.Loiter(**at(20, 30), z_units=DEPTH, speed=1.5, radius=12, duration=60)
    voyage = sail("otter", plan_of(field_, track, circle, imc.IdleManeuver(duration=3)))
    assert voyage.report.completed, voyage.report.reason
    assert voyage.report.cross_track < 2.5
    end = voyage.heard[imc.SimulatedState][-1][0] - 4.0
    around = voyage.distances(imc.SimulatedState, end - 25.0, end, (20.0, 30.0))
    assert max(abs(distance - 12.0) for distance in around) < 1.5


@pytest.mark.parametrize(
    ("maneuver", "reason"),
    [
        (goto(10, 0, z=2.0), "m0: maneuver depth beyond limits, the vehicle stays at the surface"),
        (goto(10, 0, z=2.0, z_units=ALTITUDE), "m0: maneuver at an altitude, the vehicle stays at the surface"),
        (imc.YoYo(**at(10, 0), z_units=DEPTH, amplitude=1.0, pitch=0.3, speed=1.0), "m0: maneuver is not supported"),
    ],
)
def test_a_boat_does_not_dive(maneuver, reason):
    for boat in BOATS:
        report = fly(plan_of(maneuver), boat, limit=60)
        assert (report.outcome, report.reason) == ("FAILURE", reason)


@pytest.mark.heavy
@pytest.mark.parametrize("boat", all_but(["otter"], BOATS))
def test_an_operator_steers(boat):
    async def steer(vehicle, script):
        await script.sleep(10.0)
        for k in range(150):
            text = "Thrust=100;Heading=127" if k < 100 else "Thrust=-100"
            script.publish(imc.RemoteActions(actions=text, dst=vehicle.system))
            await script.sleep(0.2)

    voyage = sail(boat, plan_of(imc.Teleoperation()), happen=steer, until=50.0)
    turning = voyage.of(imc.SimulatedState, 25.0, 30.0)
    assert all(m.r > math.radians(6.0) and m.u > 0.3 for m in turning)
    assert voyage.of(imc.SimulatedState, 39.0, 40.0)[-1].u < 0.5 * turning[-1].u
    assert max(abs(m.value) for m in voyage.of(imc.SetThrusterActuation, 42.5)) < 0.2, "the operator is silent"


@pytest.mark.heavy
def test_an_operator_who_steers_out_of_the_area_is_stopped():
    async def steer(vehicle, script):
        await script.sleep(10.0)
        for _ in range(300):
            script.publish(imc.RemoteActions(actions="Thrust=127", dst=vehicle.system))
            await script.sleep(0.2)

    area = [
        f"Monitors.OperationalLimits:Initial Setting - Area {each}"
        for each in ("Center=41.185, -8.7062", "Size=30, 30")
    ]
    modes = []

    async def steer_and_note(vehicle, script):
        vehicle.observe(imc.VehicleState, lambda m: modes.append((m.op_mode, m.last_error)))
        await steer(vehicle, script)

    voyage = sail("otter", plan_of(imc.Teleoperation()), *area, happen=steer_and_note, until=70.0)
    assert imc.VehicleState.OpMode.ERROR in [mode for mode, _ in modes]
    assert max(math.hypot(m.x, m.y) for m in voyage.of(imc.SimulatedState)) < 40.0
    assert abs(voyage.of(imc.SimulatedState)[-1].u) < 0.3


@pytest.mark.heavy
@pytest.mark.parametrize("boat", all_but(["caravel"], BOATS))
def test_equal_voyages_are_equal(boat):
    plan = plan_of(goto(20, 10))
    first, again = (sail(boat, plan, *CURRENT, keep_all=True).packets for _ in range(2))
    assert first == again
    assert sail(boat, plan, *CURRENT, seed=2, keep_all=True).packets != first


@pytest.mark.heavy
@pytest.mark.parametrize("boat", BOATS)
def test_each_task_says_the_same_again_from_the_log(boat, tmp_path):
    (tmp_path / "windy.ini").write_text(
        f"[Require {boat}.ini]\n[Simulators.StreamVelocity]\nDefault Speed East = 0.3\n[Simulators.Wind]\nSpeed = 6\n"
    )
    profile = load_profile(tmp_path / "windy.ini")
    vehicle = build(
        profile, {"Simulation"}, clock=VirtualClock(profile.start_time_ns), seed=1, log_root=tmp_path / "log"
    ).vehicle
    vehicle.start()
    vehicle.run(12.0)
    vehicle.close()
    log = imc.Log(max((tmp_path / "log").glob("*/*/*")))
    tasks = ["Simulators.VSIM", "Navigation.General.GPSNavigation", *CONTROLLERS[boat]]
    for task in tasks:
        done = resimulate(log, [task])
        assert (done.comparison.bytes, done.comparison.first) == (0, None)
        assert sum(tally.equal for tally in done.comparison.counts.values()) > 100


@pytest.mark.heavy
def test_a_boat_circles_by_itself_until_it_is_given_a_plan(tmp_path):
    profile = load_profile("otter")
    selected = profile.parse_modes("Simulation")
    vehicle = build(profile, selected, clock=VirtualClock(profile.start_time_ns), log_root=tmp_path).vehicle
    positions = []
    vehicle.observe(imc.SimulatedState, lambda m: positions.append((m.x, m.y)))
    vehicle.start()
    vehicle.run(100.0)
    vehicle.close()
    assert max(math.hypot(*position) for position in positions[-2500:]) < 25.0
    assert max(x for x, _ in positions[-2500:]) - min(x for x, _ in positions[-2500:]) > 25.0
    assert any(folder.name.endswith("_loiter") for folder in tmp_path.glob("*/*/*"))
