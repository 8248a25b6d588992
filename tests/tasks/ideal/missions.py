"""Strategies for missions: good and bad plans, requests in any order, faults; and the checks of each flight."""

import math
from dataclasses import dataclass

from flying import BOARD, BROADCAST, CCU, DEPTH, OWN, control, place, plan_of
from hypothesis import strategies as st
from ideal_vehicle import IdealVehicle

import imc
from runtime import State, Task, param
from runtime.testing import Run, simulate
from tasks.monitors.entities import Entities

Op = imc.PlanControl.Op
Type = imc.PlanControl.Type
Phase = imc.PlanControlState.State
Mode = imc.VehicleState.OpMode
DEEPEST = 6.0  # m, of which control uses 5
SETTINGS = {"General": {"Absolute Maximum Depth": str(DEEPEST), "Battery Capacity": "700"}}
FIRST, LAST = 2.0, 30.0  # s, the interval of events
STOPPING, PROBING, END = 50.0, 54.0, 64.0  # s
PROBE = 0xF00D  # request id of the plan that tests whether the engine works
KINDS = (
    imc.Goto, imc.IdleManeuver, imc.StationKeeping, imc.Loiter, imc.FollowPath, imc.PopUp, imc.YoYo, imc.Rows,
    imc.RowsCoverage, imc.Elevator, imc.Launch, imc.ScheduledGoto, imc.Dislodge, imc.Teleoperation,
    imc.FollowReference, imc.CustomManeuver, imc.VehicleFormation,
)  # fmt: skip
ODD_NUMBERS = (math.nan, math.inf, -math.inf, -1.0, 0.0, 1e-9, 1e9, 3e38)
CONDITIONS = ("ManeuverIsDone", "", "true", "false", "FuelLevel.value < 40", "EstimatedState.depth > 1", "a b", "9 < 8")
NAMES = ("m0", "m1", "m2", "m9", "_done_", "")


class Sensor(Task):
    """A monitored entity that fails, becomes silent or recovers on demand."""

    fails: float = param(-1.0, "s", "Time of its failure, -1 for none.")
    recovers: float = param(-1.0, "s", "Time from its failure to its recovery, -1 for none.")
    silent: bool = param(False, "", "It says nothing any more instead of being in error.")

    def start(self) -> None:
        self.set_entity_state(State.NORMAL, "active")
        if self.fails >= 0.0:
            self.after(self.fails, self.set_entity_state, State.ERROR, "broken")
            if self.recovers >= 0.0:
                self.after(self.fails + self.recovers, self.set_entity_state, State.NORMAL, "active")


@dataclass(frozen=True)
class Happening:
    """A mission of an ideal vehicle: fed messages, failures of the sensor, and which task becomes silent when (s)."""

    feed: tuple[imc.Message, ...] = ()
    fails: float = -1.0
    recovers: float = -1.0
    silent: str = ""
    silent_at: float = 0.0
    current: float = 0.0


numbers = st.one_of(st.floats(-20.0, 20.0, width=32), st.floats(0.5, 5.0, width=32), st.sampled_from(ODD_NUMBERS))
offsets = st.floats(-40.0, 40.0)


@st.composite
def maneuvers(draw):
    """A maneuver near the vehicle, sometimes with invalid fields."""
    kind = draw(st.sampled_from(KINDS))
    known = {item.name for item in imc.fields(kind)}
    near = place(draw(offsets), draw(offsets))
    usual = {
        **near, "z": draw(st.sampled_from((0.0, 1.0, 3.0, 5.0))), "z_units": DEPTH, "travel_z": 2.0,
        "travel_z_units": DEPTH, "start_z": 0.0, "start_z_units": DEPTH, "end_z": 4.0, "end_z_units": DEPTH,
        "speed": draw(st.sampled_from((0.5, 1.5, 5.0))), "amplitude": 1.0, "pitch": 0.25, "radius": 12.0,
        "length": 30.0, "width": 20.0, "hstep": 10.0, "duration": draw(st.integers(0, 6)), "rpm": 1000.0,
        "range": 10, "angaperture": 1.0, "arrival_time": 1_767_225_630.0, "control_src": CCU, "control_ent": 0xFF,
    }  # fmt: skip
    fields = {name: value for name, value in usual.items() if name in known}
    if kind is imc.FollowPath:
        points = st.builds(imc.PathPoint, x=offsets, y=offsets, z=st.floats(-2.0, 2.0, width=32))
        fields["points"] = draw(st.lists(points, max_size=4))
    if draw(st.integers(0, 2)) == 0:
        floats = [item.name for item in imc.fields(kind) if item.type in ("fp32_t", "fp64_t")]
        small = [item.name for item in imc.fields(kind) if item.type == "uint8_t"]
        if floats:
            fields[draw(st.sampled_from(floats))] = draw(numbers)
        if small and draw(st.booleans()):
            fields[draw(st.sampled_from(small))] = draw(st.integers(0, 255))
    return kind(**fields)


@st.composite
def plans(draw):
    """A graph of maneuvers: mostly a chain, else with any transitions, cycles and gaps included."""
    items = draw(st.lists(maneuvers(), min_size=0 if draw(st.integers(0, 9)) == 0 else 1, max_size=4))
    arrows = None
    if draw(st.integers(0, 2)) == 0:
        names = st.sampled_from(NAMES)
        arrows = draw(st.lists(st.tuples(names, names, st.sampled_from(CONDITIONS)), max_size=5))
    plan = plan_of(*items, name=draw(st.sampled_from(("test", "other"))), transitions=arrows)
    if draw(st.integers(0, 5)) == 0:
        plan = plan.replace(start_man_id=draw(st.sampled_from(NAMES)))
    return plan


times = st.floats(FIRST, LAST).map(lambda t: round(t, 1))
sources = st.sampled_from((CCU, CCU, CCU, 0x4001))
destinations = st.sampled_from((OWN, OWN, OWN, OWN, OWN, 0xFFF0, 0xFFFF, 0x0015))
request_ids = st.sampled_from((1, 2, 3, 7, 0xFFFF))


@st.composite
def requests(draw, plan):
    """A request of a console to the plan tasks, or directly to the supervisor."""
    fields = {"dst": draw(destinations), "src": draw(sources)}
    at, request_id = draw(times), draw(request_ids)
    choice = draw(st.integers(0, 9))
    if choice == 8:
        command = imc.VehicleCommand(timestamp=at, request_id=request_id, command=draw(st.integers(0, 5)), **fields)
        return command.replace(maneuver=draw(st.none() | maneuvers()), calib_time=draw(st.integers(0, 4)))
    if choice == 9:
        op = draw(st.integers(0, 8))
        arg = draw(st.sampled_from((plan, None, imc.Goto())))
        name = draw(st.sampled_from((plan.plan_id, "test", "")))
        return imc.PlanDB(timestamp=at, op=op, request_id=request_id, plan_id=name, arg=arg, **fields)
    op = draw(st.sampled_from((Op.START, Op.START, Op.START, Op.STOP, Op.LOAD, Op.GET, 77)))
    arg = draw(st.sampled_from((plan, plan, plan, None, imc.IdleManeuver(duration=2), imc.Abort())))
    flags = draw(st.sampled_from((0, 0, 1, 2, 3)))
    name = draw(st.sampled_from((plan.plan_id, plan.plan_id, "test", "", "dislodge")))
    return control(op, at, name, request_id, arg=arg, flags=flags, **fields)


def disturbances():
    """An Abort, sometimes addressed to others, or a message at the wrong time."""
    return st.one_of(
        st.builds(imc.Abort, timestamp=times, src=sources, dst=destinations),
        st.builds(imc.ManeuverControlState, timestamp=times, state=st.integers(0, 5), eta=st.integers(0, 9)),
        st.builds(imc.StopManeuver, timestamp=times),
        st.builds(imc.FuelLevel, timestamp=times, value=st.sampled_from((40.0, 120.0, math.nan))),
    )


@st.composite
def happenings(draw):
    """A mission with any requests, disturbances and faults."""
    plan = draw(plans())
    feed = [control(Op.START, FIRST, plan.plan_id, 1, arg=plan)]
    feed += draw(st.lists(requests(plan), max_size=6))
    feed += draw(st.lists(disturbances(), max_size=2))
    feed += draw(st.lists(st.sampled_from(feed), max_size=2))
    fails = draw(st.sampled_from((-1.0, -1.0)) | times)
    return Happening(
        tuple(feed),
        fails=fails,
        recovers=draw(st.floats(0.5, 10.0)) if fails >= 0.0 and draw(st.booleans()) else -1.0,
        silent=draw(st.sampled_from(("", "", "", "Plan.DB", "Supervisors.Vehicle", "Maneuver.Goto", "IdealVehicle"))),
        silent_at=draw(times),
        current=draw(st.floats(-1.0, 1.0)),
    )


def happen(mission: Happening) -> Run:
    """Fly it, then stop what still runs and start a short plan as a probe."""
    stop = control(Op.STOP, STOPPING, "", 0xBEEF)
    probe = plan_of(imc.IdleManeuver(duration=2), name="probe")
    start = control(Op.START, PROBING, "probe", PROBE, arg=probe)

    async def silence(script):
        await script.sleep(mission.silent_at)
        if mission.silent:
            task = next(t for t in script.task.vehicle.tasks if t.name.endswith(mission.silent))
            task.cancel_callbacks()

    board = [
        *(task for task in BOARD if task is not Entities),
        (Entities, {"default_monitoring": ["Sensor"]}),
        (Sensor, {"fails": mission.fails, "recovers": mission.recovers, "entity_label": "Sensor"}),
        (IdealVehicle, {"current_east": mission.current}),
    ]
    return simulate(board, (*mission.feed, stop, start), seconds=END, script=silence, settings=SETTINGS)


def check(mission: Happening, run: Run) -> None:
    """Check all rules. Raises AssertionError."""
    check_depth(mission, run)
    check_replies(mission, run)
    check_abort(mission, run)
    check_end(mission, run)


def check_depth(mission: Happening, run: Run) -> None:
    assert all(math.isfinite(m.depth + m.x + m.y) for m in run.of(imc.EstimatedState))
    given = [arg for m in mission.feed for arg in (getattr(m, "arg", None), getattr(m, "maneuver", None))]
    if any(imc.encode(arg) != b"" and _asks_for_altitude(arg) for arg in given if arg is not None):
        return
    if any(isinstance(m, imc.VehicleCommand) for m in mission.feed):
        return
    assert max(m.depth for m in run.of(imc.EstimatedState)) <= DEEPEST + 0.3


def _asks_for_altitude(message: imc.Message | None) -> bool:
    if isinstance(message, imc.PlanSpecification):
        return any(_asks_for_altitude(m.data) for m in message.maneuvers if isinstance(m, imc.PlanManeuver))
    names = ("z_units", "start_z_units", "end_z_units", "travel_z_units")
    return any(getattr(message, name, DEPTH) != DEPTH for name in names)


def check_replies(mission: Happening, run: Run) -> None:
    """One reply to each request to this vehicle, none to others; a START has at most one end.

    An exact copy of a request that is not answered yet gets no reply of its own.
    """
    sent = [m for m in mission.feed if isinstance(m, (imc.PlanControl, imc.PlanDB, imc.VehicleCommand))]
    silent = {"Plan.DB": imc.PlanDB, "Supervisors.Vehicle": imc.VehicleCommand}.get(mission.silent)
    for request in {_key(m): m for m in sent}.values():
        same = [m for m in sent if _key(m) == _key(request)]
        ours = [m for m in same if m.dst in (OWN, 0xFFF0) or (m.dst == 0xFFFF and type(m) is not imc.PlanControl)]
        own, different = len(ours), len(set(map(imc.encode, ours)))
        found = [m for m in run.of(type(request)) if m.type != 0 and _key(m.replace(src=m.dst)) == _key(request)]
        kind = type(request)
        if kind is silent:
            continue
        if not own:
            assert not found, f"replies to {request}, which is for nobody here"
        elif kind is imc.PlanControl and request.op == Op.START:
            assert len(found) >= 1, f"no reply to {request}"
            ends = [m for m in found if m.type == Type.FAILURE or m.info == "plan completed"]
            assert len(ends) <= own, f"{len(ends)} ends of {own} STARTs: {[m.info for m in ends]}"
        else:
            final = [m for m in found if m.type != kind.Type.IN_PROGRESS]
            assert different <= len(final) <= own, f"{len(final)} replies to {own} x {request}"


def _key(message) -> tuple:
    return type(message), message.src, message.request_id, getattr(message, "op", getattr(message, "command", 0))


def check_abort(mission: Happening, run: Run) -> None:
    """After an Abort, the vehicle does not move until requested."""
    aborts = [m.timestamp for m in mission.feed if isinstance(m, imc.Abort) and m.dst in (OWN, BROADCAST, 0xFFFF)]
    if mission.silent == "Supervisors.Vehicle" or not aborts:
        return
    assert len(run.of(imc.Aborted)) == len(aborts)
    others = (imc.PlanControl, imc.VehicleCommand)
    for abort in aborts:
        begin = run.vehicle.start_time + abort
        later = [m.timestamp for m in mission.feed if isinstance(m, others) and m.timestamp >= abort]
        end = run.vehicle.start_time + min([STOPPING, *later])
        calm = [m for m in run.of(imc.VehicleState) if begin + 0.05 < m.timestamp < end]
        assert all(m.op_mode in (Mode.ERROR, Mode.SERVICE) for m in calm)
        states = [m for m in run.of(imc.PlanControlState) if begin + 0.05 < m.timestamp < end]
        assert all(m.state in (Phase.BLOCKED, Phase.READY) for m in states)


def check_end(mission: Happening, run: Run) -> None:
    """The engine can start a plan, or gives the reason if the vehicle is not ready."""
    probes = [m for m in run.of(imc.PlanControl) if m.request_id == PROBE and m.type != Type.REQUEST]
    assert probes, "no reply to the last START"
    broken = mission.fails >= 0.0 and mission.recovers < 0.0
    if broken or mission.silent == "Supervisors.Vehicle":
        assert [m.type for m in probes][-1] == Type.FAILURE
    else:
        assert probes[-1].info == "plan completed", [m.info for m in probes]
    last = run.of(imc.PlanControlState)[-1]
    assert last.state in (Phase.READY, Phase.BLOCKED)
    assert (last.man_id, last.man_type) == ("", 0xFFFF)
