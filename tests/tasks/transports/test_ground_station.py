"""What a console asks a vehicle, on the bus: Neptus' questions, put to the shipped vehicles."""

import hashlib
import math
from collections import Counter

import imcpy
import pytest

import imc
from imc.reserved_ids import UNKNOWN_ENTITY
from tests.tasks.transports.console import CONSOLE, plan_control


def goto_plan(console, plan_id="survey"):
    place = console.wait(imc.EstimatedState)
    goto = imc.Goto(lat=place.lat + 2e-5, lon=place.lon, z=0.0, z_units=imc.ZUnits.DEPTH, speed=1.0, timeout=600)
    if console.flies:
        goto = goto.replace(z=20.0, z_units=imc.ZUnits.ALTITUDE, speed=4.0)
    goto = goto.replace(speed_units=imc.SpeedUnits.METERS_PS)
    step = imc.PlanManeuver(maneuver_id="Goto1", data=goto)
    return imc.PlanSpecification(plan_id=plan_id, start_man_id="Goto1", maneuvers=(step,))


def test_states_come_as_often_as_a_console_needs_them(console):
    seconds = 10
    counts = Counter(type(message).__name__ for message in console.run(float(seconds)))
    least = {"Heartbeat": 1, "VehicleState": 1, "PlanControlState": 1, "EstimatedState": 1, "SimulatedState": 0.5}
    least |= {
        "FuelLevel": 0.1,
        "GpsFix": 0.5,
        "VehicleMedium": 0.5,
        "Rpm": 0.0 if "hexa" in console.vehicle.name else 1,
    }
    short = {name: counts[name] / seconds for name, rate in least.items() if counts[name] < rate * seconds - 1}
    assert not short


def test_each_entity_reports_its_state_every_second(console):
    reports = Counter(m.src_ent for m in console.run(5.0) if isinstance(m, imc.EntityState))
    stateful = {entity.id for entity in console.vehicle.entities if entity.stateful}
    assert set(reports) == stateful
    assert min(reports.values()) >= 5


def test_entities_are_listed_and_described(console):
    listed = console.ask(imc.EntityList(op=imc.EntityList.Op.QUERY), imc.EntityList)
    assert listed.op == imc.EntityList.Op.REPORT
    table = dict(entry.rsplit("=", 1) for entry in listed.list.split(";"))
    assert table == {entity.label: str(entity.id) for entity in console.vehicle.entities}
    assert len(set(table.values())) == len(table)
    gps = int(table["GPS"])
    info = console.ask(imc.QueryEntityInfo(id=gps, dst_ent=gps), imc.EntityInfo)
    assert (info.id, info.label, info.src_ent) == (gps, "GPS", gps)
    state = console.ask(imc.QueryEntityState(dst_ent=gps), imc.EntityState)
    assert (state.src_ent, state.state) == (gps, imc.EntityState.State.NORMAL)
    console.send(imc.QueryEntityState())
    answers = [m for m in console.run(0.1) if isinstance(m, imc.EntityState) and m.dst == CONSOLE]
    assert {m.src_ent for m in answers} == {entity.id for entity in console.vehicle.entities if entity.stateful}


def plan_db(op, plan_id="", arg=None, request_id=7):
    return imc.PlanDB(type=imc.PlanDB.Type.REQUEST, op=op, plan_id=plan_id, arg=arg, request_id=request_id)


def settled(message):
    return message.type != imc.PlanDB.Type.IN_PROGRESS


def test_plans_are_kept_with_the_digest_that_the_console_computes(console):
    ops, success = imc.PlanDB.Op, imc.PlanDB.Type.SUCCESS
    plans = [goto_plan(console, "b plan"), goto_plan(console, "a plan").replace(description="the first")]
    for number, plan in enumerate(plans, 100):
        begun = console.ask(plan_db(ops.SET, plan.plan_id, plan, number), imc.PlanDB)
        assert begun.type == imc.PlanDB.Type.IN_PROGRESS
        done = (
            console.wait(imc.PlanDB, settled)
            if settled(begun)
            else next(m for m in console.heard if isinstance(m, imc.PlanDB) and settled(m) and m.dst == CONSOLE)
        )
        assert (done.type, done.op, done.request_id, done.plan_id) == (success, ops.SET, number, plan.plan_id)
    payloads = {plan.plan_id: imc.encode(plan)[20:-2] for plan in plans}
    digests = {name: hashlib.md5(payload).digest() for name, payload in payloads.items()}
    for plan in plans:
        info = console.ask(plan_db(ops.GET_INFO, plan.plan_id), imc.PlanDB, settled)
        assert info.type == success
        assert isinstance(info.arg, imc.PlanDBInformation)
        assert info.arg.md5 == digests[plan.plan_id]
        assert info.arg.plan_size == len(payloads[plan.plan_id])
        assert info.arg.change_sid == CONSOLE
        got = console.ask(plan_db(ops.GET, plan.plan_id), imc.PlanDB, settled)
        assert imc.encode(got.arg)[20:-2] == payloads[plan.plan_id]
    for op in (ops.GET_STATE, ops.GET_DSTATE):
        state = console.ask(plan_db(op), imc.PlanDB, settled).arg
        assert isinstance(state, imc.PlanDBState)
        names = [item.plan_id for item in state.plans_info]
        assert names == sorted(names)
        assert {"a plan", "b plan"} <= set(names)
        assert state.plan_count == len(names)
        assert state.md5 == hashlib.md5(b"".join(item.md5 for item in state.plans_info)).digest()
    missing = console.ask(plan_db(ops.GET, "no such plan"), imc.PlanDB, settled)
    assert (missing.type, missing.info) == (imc.PlanDB.Type.FAILURE, "undefined plan")
    assert console.ask(plan_db(ops.DEL, "a plan"), imc.PlanDB, settled).type == success
    assert console.ask(plan_db(ops.GET_INFO, "a plan"), imc.PlanDB, settled).type == imc.PlanDB.Type.FAILURE
    assert console.ask(plan_db(ops.CLEAR), imc.PlanDB, settled).type == success
    assert console.ask(plan_db(ops.GET_STATE), imc.PlanDB, settled).arg.plan_count == 0


@pytest.mark.parametrize("order", ["little", "big"])
def test_the_digest_is_that_of_the_bytes_of_another_program(noptilus, order):
    """imcpy serializes the plan; whatever the byte order on the wire, the digest is of the little-endian fields."""
    goto = imcpy.Goto()
    goto.timeout, goto.lat, goto.lon, goto.z, goto.speed = 1000, 0.718, -0.152, 1.1, float("nan")
    goto.z_units, goto.speed_units, goto.custom = imcpy.ZUnits.DEPTH, imcpy.SpeedUnits.METERS_PS, "depth=ñ"
    step, plan, request = imcpy.PlanManeuver(), imcpy.PlanSpecification(), imcpy.PlanDB()
    step.maneuver_id, step.data = "Goto1", goto
    plan.plan_id, plan.start_man_id = "theirs", "Goto1"
    plan.maneuvers.append(step)
    request.type, request.op = imcpy.PlanDB.TypeEnum.REQUEST, imcpy.PlanDB.OperationEnum.SET
    request.request_id, request.plan_id, request.arg = 3, "theirs", plan
    request.src, request.dst = CONSOLE, noptilus.vehicle.system
    packet = imcpy.Packet.serialize(request)
    if order == "big":
        packet = imc.encode(imc.decode(packet), "big")
    noptilus.vehicle.bus.deliver(noptilus.vehicle.bus.decode(packet), packet)
    answer = noptilus.wait(imc.PlanDB, lambda m: m.dst == CONSOLE and settled(m))
    assert answer.arg.md5 == hashlib.md5(imcpy.Packet.serialize(plan)[20:-2]).digest()


def test_a_plan_is_started_watched_read_back_and_stopped(console):
    ops, types, states = imc.PlanControl.Op, imc.PlanControl.Type, imc.PlanControlState.State
    plan = goto_plan(console)
    console.ask(plan_db(imc.PlanDB.Op.SET, "survey", plan), imc.PlanDB, settled)
    loaded = console.ask(plan_control(ops.LOAD, "survey"), imc.PlanControl)
    assert (loaded.type, loaded.request_id) == (types.SUCCESS, 9)
    started = console.ask(plan_control(ops.START, "survey", request_id=41, flags=1), imc.PlanControl)
    assert (started.type, started.op, started.request_id, started.plan_id) == (types.SUCCESS, ops.START, 41, "survey")
    state = console.wait(imc.PlanControlState, lambda s: s.state == states.EXECUTING, 30.0)
    assert (state.plan_id, state.man_id, state.man_type) == ("survey", "Goto1", imc.Goto.ID)
    vehicle = console.wait(imc.VehicleState)
    assert (vehicle.op_mode, vehicle.maneuver_type) == (imc.VehicleState.OpMode.MANEUVER, imc.Goto.ID)
    assert console.wait(imc.PathControlState).path_ref
    running = console.ask(plan_control(ops.GET), imc.PlanControl, lambda m: m.op == ops.GET)
    assert running.arg.plan_id == "survey"
    stopped = console.ask(plan_control(ops.STOP, request_id=42), imc.PlanControl, lambda m: m.request_id == 42)
    assert stopped.type == types.SUCCESS
    state = console.wait(imc.PlanControlState, lambda s: s.state == states.READY)
    assert state.last_outcome == imc.PlanControlState.LastOutcome.FAILURE
    unknown = console.ask(plan_control(ops.START, "nothing"), imc.PlanControl)
    assert (unknown.type, unknown.info) == (types.FAILURE, "undefined plan")
    console.wait(imc.VehicleState, lambda s: s.op_mode == imc.VehicleState.OpMode.SERVICE, 30.0)


def test_a_plan_in_the_request_and_a_single_maneuver_start_at_once(console):
    ops, types = imc.PlanControl.Op, imc.PlanControl.Type
    plan = goto_plan(console, "quick one")
    for arg, plan_id in ((plan, "quick one"), (plan.maneuvers[0].data, "Goto")):
        started = console.ask(plan_control(ops.START, plan_id, arg), imc.PlanControl)
        assert started.type == types.SUCCESS, started.info
        console.wait(imc.PlanControlState, lambda s, name=plan_id: s.plan_id == name and s.state == 3)
        console.ask(plan_control(ops.STOP, request_id=5), imc.PlanControl, lambda m: m.request_id == 5)
        console.wait(imc.VehicleState, lambda s: s.op_mode == imc.VehicleState.OpMode.SERVICE, 30.0)


@pytest.mark.parametrize("op", ["START", "LOAD"])
def test_a_plan_in_a_rejected_request_leaves_the_stored_plan_of_its_name(console, op):
    ops, types = imc.PlanDB.Op, imc.PlanControl.Type
    stored = goto_plan(console)
    console.ask(plan_db(ops.SET, "survey", stored), imc.PlanDB, settled)
    (step,) = stored.maneuvers
    far = step.replace(data=step.data.replace(lat=step.data.lat + 1.0))
    for number, name in enumerate(("survey", "newcomer"), 60):
        wrong = stored.replace(plan_id=name, maneuvers=(far,))
        request = plan_control(imc.PlanControl.Op[op], name, arg=wrong, request_id=number)
        assert console.ask(request, imc.PlanControl).type == types.FAILURE
    got = console.ask(plan_db(ops.GET, "survey"), imc.PlanDB, settled)
    assert imc.encode(got.arg)[20:-2] == imc.encode(stored)[20:-2]
    assert console.ask(plan_db(ops.GET, "newcomer"), imc.PlanDB, settled).info == "undefined plan"
    better = stored.replace(description="accepted")
    accepted = console.ask(plan_control(imc.PlanControl.Op.LOAD, "survey", arg=better, request_id=70), imc.PlanControl)
    assert (accepted.type, accepted.info) == (types.SUCCESS, "plan loaded")
    assert console.ask(plan_db(ops.GET, "survey"), imc.PlanDB, settled).arg.description == "accepted"


def test_limits_are_reported_and_changed(console):
    limits = console.ask(imc.GetOperationalLimits(), imc.OperationalLimits)
    wish = limits.replace(max_speed=1.5, mask=limits.mask | imc.OpLimitsMask.MAX_SPEED, timestamp=-1.0)
    console.send(wish.replace(src=CONSOLE, src_ent=UNKNOWN_ENTITY, dst_ent=UNKNOWN_ENTITY))
    console.run(0.1)
    told = console.ask(imc.GetOperationalLimits(), imc.OperationalLimits)
    assert (told.max_speed, told.mask) == (1.5, wish.mask)
    console.send(limits.replace(src_ent=UNKNOWN_ENTITY))


def test_the_log_is_named_and_begun_on_request(console):
    kind = imc.LoggingControl
    name = console.ask(kind(op=kind.Op.REQUEST_CURRENT_NAME), kind)
    assert name.op == kind.Op.CURRENT_NAME
    assert name.name
    console.send(kind(op=kind.Op.REQUEST_START, name="by hand"))
    console.run(0.1)
    assert console.ask(kind(op=kind.Op.REQUEST_CURRENT_NAME), kind).name.endswith("_by_hand")


def test_the_log_book_is_read_and_cleared(console):
    kind, types = imc.LogBookControl, imc.LogBookEntry.Type
    console.send(imc.SetEntityParameters(name="GPS", params=(imc.EntityParameter(name="Nonsense", value="1"),)))
    since = console.now
    console.run(0.5)
    book = console.ask(kind(command=kind.Command.GET), kind)
    assert book.command == kind.Command.REPLY
    assert book.htime >= since
    entries = list(book.msg)
    assert any("mode" in entry.text for entry in entries)
    times = [entry.htime for entry in entries]
    assert times == sorted(times)
    recent = console.ask(kind(command=kind.Command.GET, htime=since), kind)
    assert recent.msg
    assert all(entry.htime >= since for entry in recent.msg)
    errors = console.ask(kind(command=kind.Command.GET_ERR), kind)
    assert {entry.type for entry in errors.msg} == {types.ERROR}
    assert any("Nonsense" in entry.text for entry in errors.msg)
    console.send(kind(command=kind.Command.CLEAR))
    console.run(0.1)
    assert not any("Nonsense" in e.text for e in console.ask(kind(command=kind.Command.GET), kind).msg)


def test_actions_of_a_joystick_are_offered_and_steer(console):
    kind = imc.RemoteActionsRequest
    offer = console.ask(kind(op=kind.Op.QUERY), kind)
    assert offer.op == kind.Op.REPORT
    ops, types = imc.PlanControl.Op, imc.PlanControl.Type
    teleoperation = imc.Teleoperation(custom=f"src={CONSOLE}")
    started = console.ask(plan_control(ops.START, "teleoperation-mode", teleoperation), imc.PlanControl)
    assert ("Roll=Axis" in offer.actions) == console.flies
    assert "Thrust=Axis" in offer.actions
    assert started.type == types.SUCCESS
    console.wait(imc.VehicleState, lambda s: s.maneuver_type == imc.Teleoperation.ID)
    for _ in range(20):
        console.send(imc.RemoteActions(actions="Pitch=-100" if console.flies else "Thrust=100;Heading=0"))
        console.run(0.1)
    assert console.wait(imc.DesiredVelocity).u > 2 if console.flies else console.wait(imc.DesiredSpeed).value > 40
    console.send(imc.TeleoperationDone())
    console.wait(imc.VehicleState, lambda s: s.op_mode == imc.VehicleState.OpMode.SERVICE)


def test_an_abort_stops_everything(console):
    ops = imc.PlanControl.Op
    console.ask(plan_control(ops.START, "survey", goto_plan(console)), imc.PlanControl)
    console.wait(imc.VehicleState, lambda s: s.op_mode == imc.VehicleState.OpMode.MANEUVER)
    console.send(imc.Abort())
    state = console.wait(imc.VehicleState, lambda s: s.op_mode == imc.VehicleState.OpMode.ERROR)
    assert "abort request" in state.last_error
    assert state.last_error_time == pytest.approx(console.now, abs=1.0)
    console.wait(imc.VehicleState, lambda s: s.op_mode == imc.VehicleState.OpMode.SERVICE, 60.0)


def test_what_the_vehicle_has_not_got_is_said(console):
    beacons = console.ask(imc.LblConfig(op=imc.LblConfig.Op.GET_CFG), imc.LblConfig)
    assert (beacons.op, beacons.beacons) == (imc.LblConfig.Op.CUR_CFG, ())
    down = console.ask(imc.PowerOperation(op=imc.PowerOperation.Op.PWR_DOWN), imc.PowerOperation)
    assert down.op == imc.PowerOperation.Op.PWR_DOWN_ABORTED
    for request, words in (
        (imc.LblConfig(op=imc.LblConfig.Op.SET_CFG, beacons=(imc.LblBeacon(beacon="b1"),)), "LBL"),
        (imc.PowerOperation(op=imc.PowerOperation.Op.SCHED_PWR_DOWN), "power"),
        (imc.PowerChannelControl(name="Camera", op=imc.PowerChannelControl.Op.TURN_ON), "Camera"),
        (imc.RestartSystem(type=imc.RestartSystem.Type.SYSTEM), "restart"),
        (imc.RestartSystem(type=imc.RestartSystem.Type.DUNE), "restart"),
    ):
        console.send(request)
        entry = console.wait(imc.LogBookEntry)
        assert entry.type == imc.LogBookEntry.Type.WARNING
        assert words in entry.text
        assert "0x4000" in entry.text or "ccu" in entry.text


def test_requests_to_another_vehicle_are_not_answered(console):
    other = 0x0801
    asked = [
        imc.EntityList(op=imc.EntityList.Op.QUERY),
        plan_db(imc.PlanDB.Op.GET_STATE),
        plan_control(imc.PlanControl.Op.GET),
        imc.QueryEntityParameters(name="GPS"),
        imc.LblConfig(op=imc.LblConfig.Op.GET_CFG),
        imc.PowerOperation(op=imc.PowerOperation.Op.PWR_DOWN),
        imc.RemoteActionsRequest(op=imc.RemoteActionsRequest.Op.QUERY),
        imc.LogBookControl(command=imc.LogBookControl.Command.GET),
        imc.GetOperationalLimits(),
        imc.LoggingControl(op=imc.LoggingControl.Op.REQUEST_CURRENT_NAME),
    ]
    for request in asked:
        console.send(request, dst=other)
    assert [type(m).__name__ for m in console.run(0.5) if m.dst == CONSOLE] == []


def test_positions_are_those_of_the_map(noptilus):
    state = noptilus.wait(imc.EstimatedState)
    assert math.degrees(state.lat) == pytest.approx(41.185, abs=0.01)
