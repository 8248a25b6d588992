"""Missions of fully simulated boats: legs, corners, stations, wind, current, aborts and faults."""

import math
import tempfile
from dataclasses import dataclass, field
from itertools import pairwise
from pathlib import Path

import pytest

import imc
from imc.coordinates import displace
from runtime.kernel import VirtualClock
from runtime.profile import load_profile
from runtime.vehicle import build
from shoal import fly
from shoal.missions import Mission, Report, load_plan, prepare
from shoal.rerun import resimulate

BOATS = ("otter", "caravel")
CONTROLLERS = {
    "otter": ("Control.ASV.HeadingAndSpeed",),
    "caravel": ("Control.ASV.Conventional.Heading", "Control.ASV.Conventional.Speed"),
}
HARBOUR = Path(__file__).parents[2] / "data/plans/harbour.yaml"
LAT, LON = math.radians(41.185), math.radians(-8.7062)
DEPTH, ALTITUDE = imc.ZUnits.DEPTH, imc.ZUnits.ALTITUDE
Mode = imc.VehicleState.OpMode
CURRENT = ("Simulators.StreamVelocity:Default Speed East=0.3",)
NORTHWARD = ("Simulators.StreamVelocity:Default Speed North=0.3",)
WIND = ("Simulators.Wind:Speed=6", "Simulators.Wind:Direction=45", "Simulators.Wind:Gusts=1")


@dataclass
class Voyage:
    """The result of a mission: the report, and messages of some types with their times from the start (s)."""

    report: Report
    heard: dict[type[imc.Message], list[tuple[float, imc.Message]]] = field(default_factory=dict)
    packets: list[bytes] = field(default_factory=list)

    def of(self, kind, begin=0.0, end=math.inf):
        """Messages of a type between two times."""
        return [message for time, message in self.heard[kind] if begin <= time < end]

    @property
    def modes(self):
        """The modes of the vehicle, in order."""
        modes = [m.op_mode for m in self.of(imc.VehicleState)]
        return modes[:1] + [mode for before, mode in pairwise(modes) if mode != before]

    def since(self, mode):
        """When the vehicle was first in a mode (s)."""
        return next(time for time, m in self.heard[imc.VehicleState] if m.op_mode == mode)

    def distances(self, kind, begin, end, place):
        """Distances (m) of SimulatedStates from a place (m north and east of the start)."""
        return [math.dist((m.x, m.y), place) for m in self.of(kind, begin, end)]


def sail(boat, plan, *overrides, seed=1, happen=None, until=None, keep_all=False):
    """Sail a plan to its end or, whatever happens, `until` a time (s).

    `happen` is a coroutine function that gets the vehicle and a script.
    """
    kinds = (imc.SimulatedState, imc.VehicleState, imc.PathControlState, imc.SetThrusterActuation, imc.DesiredSpeed)
    with tempfile.TemporaryDirectory() as folder:
        root = Path(folder)
        vehicle = prepare(boat, overrides=overrides, seed=seed, log_root=root / "log", state_folder=root / "db").vehicle
        voyage = Voyage(Report(), {kind: [] for kind in kinds})
        for kind in kinds:
            vehicle.tap(kind, lambda m, found=voyage.heard[kind]: found.append((m.timestamp - vehicle.start_time, m)))
        if keep_all:
            vehicle.tap(imc.Message, lambda _, packet: voyage.packets.append(packet), packets=True)
        if happen is not None:
            vehicle.kernel.soon(vehicle.daemon.run, lambda script: happen(vehicle, script))
        if until is None:
            voyage.report = Mission(vehicle, plan).fly(2000.0)
            return voyage

        async def command(script):
            await script.hear(imc.PlanControlState, where=lambda m: m.state == imc.PlanControlState.State.READY)
            await script.hear(imc.VehicleState, where=lambda m: m.op_mode == Mode.SERVICE)
            script.publish(imc.PlanControl(plan_id=plan.plan_id, arg=plan, dst=vehicle.system))

        vehicle.start()
        vehicle.kernel.soon(vehicle.daemon.run, command)
        try:
            vehicle.run(until)
        finally:
            vehicle.close()
    return voyage


def at(north, east):
    lat, lon, _ = displace(LAT, LON, 0.0, north, east)
    return {"lat": lat, "lon": lon}


def plan_of(*maneuvers):
    names = [f"m{number}" for number in range(len(maneuvers))]
    items = [imc.PlanManeuver(maneuver_id=name, data=m) for name, m in zip(names, maneuvers, strict=True)]
    links = [imc.PlanTransition(source_man=a, dest_man=b) for a, b in pairwise(names)]
    return imc.PlanSpecification(plan_id="boat", start_man_id="m0", maneuvers=items, transitions=links)


def goto(north, east, speed=1.5, **fields):
    return imc.Goto(**at(north, east), **({"z_units": DEPTH, "speed": speed} | fields))


@pytest.mark.parametrize(("boat", "corner"), [("otter", 2.5), ("caravel", 3.5)])
def test_a_plan_is_flown_along_its_legs_and_around_its_corners(boat, corner):
    voyage = sail(boat, load_plan(HARBOUR))
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


@pytest.mark.parametrize(("boat", "beyond"), [("otter", 3.0), ("caravel", 10.0)])
def test_a_station_is_kept_in_a_current(boat, beyond):
    station = imc.StationKeeping(**at(30, 20), z_units=DEPTH, speed=1.2, radius=15, duration=150)
    voyage = sail(boat, plan_of(station), *CURRENT)
    assert voyage.report.completed, voyage.report.reason
    end = voyage.heard[imc.SimulatedState][-1][0]
    distances = voyage.distances(imc.SimulatedState, end - 150.0, end, (30.0, 20.0))
    assert max(distances) < 15.0 + beyond
    assert sum(distance < 15.0 for distance in distances) > 0.75 * len(distances)
    assert min(m.value for m in voyage.of(imc.DesiredSpeed)) < 0.8


@pytest.mark.parametrize("weather", [(), CURRENT, NORTHWARD, WIND], ids=["calm", "east", "north", "wind"])
@pytest.mark.parametrize("boat", BOATS)
def test_a_station_behind_a_sharp_turn_is_reached(boat, weather):
    station = imc.StationKeeping(**at(20, 20), z_units=DEPTH, speed=1.2, radius=15, duration=10)
    voyage = sail(boat, plan_of(goto(40, 0), goto(40, 30), station), *weather)
    assert voyage.report.completed, voyage.report.reason
    end = voyage.heard[imc.SimulatedState][-1][0]
    assert max(voyage.distances(imc.SimulatedState, end - 10.0, end, (20.0, 20.0))) < 15.0


@pytest.mark.parametrize("boat", BOATS)
def test_a_leg_across_current_and_wind_is_followed(boat):
    voyage = sail(boat, plan_of(goto(20, 0), goto(90, 0)), *CURRENT, *WIND)
    assert voyage.report.completed, voyage.report.reason
    assert max(abs(m.y) for m in voyage.of(imc.SimulatedState) if m.x > 60.0) < 1.0
    assert max(m.x for m in voyage.of(imc.SimulatedState)) > 80.0


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


@pytest.mark.parametrize("boat", BOATS)
def test_an_abort_stops_the_motors(boat):
    async def abort(vehicle, script):
        await script.sleep(30.0)
        script.publish(imc.Abort(dst=vehicle.system))

    voyage = sail(boat, plan_of(goto(200, 0)), happen=abort, until=60.0)
    assert {m.value for m in voyage.of(imc.SetThrusterActuation, 30.5)} <= {0.0}
    assert voyage.modes == [Mode.BOOT, Mode.SERVICE, Mode.MANEUVER, Mode.ERROR, Mode.SERVICE]
    speeds = [m.u for m in voyage.of(imc.SimulatedState, 30.0)]
    assert speeds[0] > 1.3
    assert speeds[-1] < 0.6 * speeds[0]


def silenced(task):
    """What happens to a voyage whose task falls silent after 25 s."""

    async def silence(vehicle, script):
        await script.sleep(25.0)
        vehicle.task(task).disconnect()

    return silence


@pytest.mark.parametrize(
    ("boat", "task", "within"),
    [
        ("otter", "Simulators.GPS", 12.0),
        ("caravel", "Simulators.GPS", 12.0),
        ("otter", "Simulators.IMU/AHRS", 5.0),
        ("otter", "Navigation.General.GPSNavigation", 8.0),
        ("otter", "Control.ASV.HeadingAndSpeed", 7.0),
        ("otter", "Simulators.Motor/Port", 5.0),
        ("caravel", "Simulators.Motor", 5.0),
        ("caravel", "Simulators.Servos", 5.0),
        ("caravel", "Control.ASV.Conventional.Heading", 5.0),
        ("caravel", "Control.ASV.Conventional.Speed", 6.0),
        ("otter", "Control.Path.VectorField", 5.0),
        ("caravel", "Control.Path.VectorField", 5.0),
        ("otter", "Plan.Engine", 5.0),
        ("otter", "Monitors.Entities", 5.0),
        ("otter", "Supervisors.Failsafe", 7.0),
    ],
)
def test_what_falls_silent_ends_the_plan_and_leaves_the_motors_at_rest(boat, task, within):
    voyage = sail(boat, plan_of(goto(200, 0)), happen=silenced(task), until=30.0 + within)
    assert voyage.modes[:4] == [Mode.BOOT, Mode.SERVICE, Mode.MANEUVER, Mode.ERROR]
    assert voyage.since(Mode.ERROR) < 25.0 + within
    last = {m.id: m.value for m in voyage.of(imc.SetThrusterActuation, 0.0, 29.0 + within)}
    assert set(last.values()) == {0.0}


@pytest.mark.parametrize("boat", BOATS)
def test_the_motors_stop_without_supervisor_and_failsafe(boat):
    async def silence(vehicle, script):
        vehicle.task("Supervisors.Failsafe").disconnect()
        await silenced("Supervisors.Vehicle")(vehicle, script)

    voyage = sail(boat, plan_of(goto(200, 0)), happen=silence, until=35.0)
    assert max(abs(m.value) for m in voyage.of(imc.SetThrusterActuation, 25.0, 26.0)) > 0.1
    assert {m.value for m in voyage.of(imc.SetThrusterActuation, 30.0)} <= {0.0}


@pytest.mark.parametrize("boat", BOATS)
@pytest.mark.parametrize(("task", "to"), [("Supervisors.Vehicle", 0xFFFF), ("Maneuver.Goto", 0xFFF0)])
def test_the_motors_stop_without_supervisor_or_maneuver_and_an_abort_stops_them_at_once(boat, task, to):
    async def abort(vehicle, script):
        await silenced(task)(vehicle, script)
        await script.sleep(1.0)
        script.publish(imc.Abort(dst=to))

    voyage = sail(boat, plan_of(goto(200, 0)), happen=silenced(task), until=32.0)
    assert {m.value for m in voyage.of(imc.SetThrusterActuation, 29.5)} <= {0.0}
    assert {
        m.value for m in sail(boat, plan_of(goto(200, 0)), happen=abort, until=28.0).of(imc.SetThrusterActuation, 26.1)
    } <= {0.0}


@pytest.mark.parametrize("boat", BOATS)
def test_a_boat_whose_battery_is_empty_drifts(boat):
    half_a_minute = {"otter": 0.07, "caravel": 0.03}[boat]  # % of the battery
    empty = f"Simulators.Battery:Initial Level={half_a_minute}", "Simulators.Battery:Error Level=0"
    voyage = sail(boat, plan_of(goto(200, 0)), *empty, until=90.0)
    assert max(m.u for m in voyage.of(imc.SimulatedState)) > 1.0
    assert voyage.of(imc.SimulatedState)[-1].u < 0.4
    assert Mode.MANEUVER in voyage.modes[:-1]


@pytest.mark.parametrize("boat", BOATS)
@pytest.mark.parametrize("level", ["Monitors.FuelLevel:Initial Level=9.5", "Simulators.Battery:Initial Level=5"])
def test_a_boat_does_not_leave_with_the_reserve_of_its_battery(boat, level):
    report = fly(plan_of(goto(200, 0)), boat, limit=60, overrides=[level])
    assert (report.outcome, report.reason) == ("FAILURE", "the battery is below its reserve of 10 %")


def test_a_rudder_that_is_stuck_ends_the_plan():
    faults = ("Simulators.Servos:Generate Faults=true", "Simulators.Servos:Fault Time=25")
    voyage = sail("caravel", plan_of(goto(200, 0)), *faults, until=40.0)
    assert voyage.modes == [Mode.BOOT, Mode.SERVICE, Mode.MANEUVER, Mode.ERROR]
    assert voyage.since(Mode.ERROR) < 27.0


def test_fixes_that_are_no_longer_valid_end_the_plan_and_the_boat_is_ready_when_they_are_back():
    async def jam(vehicle, script):
        gps = vehicle.task("Simulators.GPS")
        await script.sleep(25.0)
        gps.activation_depth = -1.0
        await script.sleep(20.0)
        gps.activation_depth = 0.2

    voyage = sail("otter", plan_of(goto(200, 0)), happen=jam, until=60.0)
    assert voyage.modes == [Mode.BOOT, Mode.SERVICE, Mode.MANEUVER, Mode.ERROR, Mode.SERVICE]
    assert 33.0 < voyage.since(Mode.ERROR) < 38.0


@pytest.mark.parametrize("boat", BOATS)
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


@pytest.mark.parametrize("boat", BOATS)
def test_equal_voyages_are_equal(boat):
    plan = plan_of(goto(20, 10))
    first, again = (sail(boat, plan, *CURRENT, keep_all=True).packets for _ in range(2))
    assert first == again
    assert sail(boat, plan, *CURRENT, seed=2, keep_all=True).packets != first


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
        assert sum(tally.equal for tally in done.comparison.tallies.values()) > 100


def test_a_boat_circles_by_itself_until_it_is_given_a_plan(tmp_path):
    profile = load_profile("otter")
    selected = profile.select("Simulation")
    vehicle = build(profile, selected, clock=VirtualClock(profile.start_time_ns), log_root=tmp_path).vehicle
    positions = []
    vehicle.tap(imc.SimulatedState, lambda m: positions.append((m.x, m.y)))
    vehicle.start()
    vehicle.run(100.0)
    vehicle.close()
    assert max(math.hypot(*position) for position in positions[-2500:]) < 25.0
    assert max(x for x, _ in positions[-2500:]) - min(x for x, _ in positions[-2500:]) > 25.0
    assert any(folder.name.endswith("_loiter") for folder in tmp_path.glob("*/*/*"))
