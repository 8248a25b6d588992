"""Flies plans with the ideal vehicle, supervisor and plan engine."""

from pathlib import Path

from ideal_vehicle import IdealVehicle

import imc
from runtime.testing import simulate
from support import wgs84
from tasks.maneuver.compass_calibration import CompassCalibration
from tasks.maneuver.dislodge import Dislodge
from tasks.maneuver.elevator import Elevator
from tasks.maneuver.follow_path import FollowPath
from tasks.maneuver.follow_reference.auv import AUV
from tasks.maneuver.follow_system import FollowSystem
from tasks.maneuver.goto import Goto
from tasks.maneuver.idle import Idle
from tasks.maneuver.launch import Launch
from tasks.maneuver.loiter import Loiter
from tasks.maneuver.pop_up import PopUp
from tasks.maneuver.rows import Rows
from tasks.maneuver.rows_coverage import RowsCoverage
from tasks.maneuver.scheduled_goto import ScheduledGoto
from tasks.maneuver.station_keeping import StationKeeping
from tasks.maneuver.teleoperation import Teleoperation
from tasks.maneuver.yo_yo import YoYo
from tasks.monitors.entities import Entities
from tasks.monitors.medium import Medium
from tasks.plan.db import DB
from tasks.plan.engine import Engine
from tasks.supervisors.vehicle import Vehicle

CCU = 0x4000
OWN = 0x001A
BROADCAST = 0xFFF0
START = 2.0  # s
LAT, LON = 0.7188138702989088, -0.15195185535150277
MANEUVERS = (Goto, Idle, StationKeeping, Loiter, FollowPath, PopUp, YoYo, Rows, RowsCoverage, Elevator, Launch)
MANEUVERS += (ScheduledGoto, Dislodge, Teleoperation, AUV, CompassCalibration, FollowSystem)
BOARD = (Vehicle, Entities, Medium, DB, Engine, *MANEUVERS)
DEPTH = imc.ZUnits.DEPTH
PLANS = Path(__file__).parents[2] / "data" / "plans"


def recorded(name="three_gotos"):
    """A plan from a log."""
    return imc.from_json((PLANS / f"{name}.json").read_text())


def plan_of(*maneuvers, name="test", transitions=None, **fields):
    """A plan that executes maneuvers, named m0, m1 ..., one after the other."""
    items = [imc.PlanManeuver(maneuver_id=f"m{i}", data=data) for i, data in enumerate(maneuvers)]
    if transitions is None:
        transitions = [(f"m{i}", f"m{i + 1}", "ManeuverIsDone") for i in range(len(items) - 1)]
    arrows = [imc.PlanTransition(source_man=a, dest_man=b, conditions=c) for a, b, c in transitions]
    return imc.PlanSpecification(plan_id=name, start_man_id="m0", maneuvers=items, transitions=arrows, **fields)


def place(north, east):
    """Latitude and longitude (rad) at offsets (m) from the start of the ideal vehicle."""
    lat, lon, _ = wgs84.displace(LAT, LON, 0.0, north, east)
    return {"lat": lat, "lon": lon}


def goto(north, east, depth=0.0, speed=1.5):
    """A Goto at offsets (m) from the start of the ideal vehicle."""
    return imc.Goto(**place(north, east), z=depth, z_units=DEPTH, speed=speed)


def control(op, at, plan_id="test", request_id=7, **fields):
    """A PlanControl request of a console."""
    fields = {"dst": OWN, "src": CCU, **fields}
    return imc.PlanControl(timestamp=at, op=op, plan_id=plan_id, request_id=request_id, **fields)


def start(plan, at=START, **fields):
    """A START with the plan in it."""
    return control(imc.PlanControl.Op.START, at, plan.plan_id, arg=plan, **fields)


def fly(*feed, seconds=60.0, without=(), more=(), vehicle=None, **options):
    """Run the tasks and the ideal vehicle with the fed messages."""
    tasks = [task for task in BOARD if task not in without]
    return simulate([*tasks, *more, (IdealVehicle, vehicle or {})], feed, seconds=seconds, **options)


def replies(run, op=None):
    """Type and text of the replies to consoles."""
    found = [m for m in run.of(imc.PlanControl) if m.dst == CCU and (op is None or m.op == op)]
    return [(imc.PlanControl.Type(m.type).name, m.info) for m in found]


def changes(values):
    """Without repetitions of the same value."""
    found = []
    for value in values:
        if not found or found[-1] != value:
            found.append(value)
    return found


def phases(run):
    """States and maneuvers of the plan, in order."""
    names = imc.PlanControlState.State
    return changes((names(m.state).name, m.man_id) for m in run.of(imc.PlanControlState))


def modes(run):
    """Modes of the vehicle, in order."""
    return changes(imc.VehicleState.OpMode(m.op_mode).name for m in run.of(imc.VehicleState))


def track(run):
    """North, east, depth (m) and time (s from the start of the run) of the vehicle, once a second."""
    states = run.of(imc.EstimatedState)[::20]
    return [(m.x, m.y, m.depth, m.timestamp - run.vehicle.start_time) for m in states]


def last(run):
    """The last state of the plan and its outcome."""
    state = run.of(imc.PlanControlState)[-1]
    outcome = imc.PlanControlState.LastOutcome(state.last_outcome)
    return imc.PlanControlState.State(state.state).name, outcome.name
