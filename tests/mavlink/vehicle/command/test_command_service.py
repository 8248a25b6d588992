"""Commands: which are executed, which are refused and why; each is acknowledged."""

import math

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

import imc
from tests.mavlink.vehicle.desk import State

ACCEPTED, REJECTED, DENIED, UNSUPPORTED, FAILED, IN_PROGRESS = range(6)
HOLD = (1, 4, 3)
RETURN = {"target_component": 1, "command": 20}
ORDER = {"target_component": 1, "command": 176, "param1": 1, "param2": 4, "param3": 3}
MANEUVER = imc.VehicleState(op_mode=imc.VehicleState.OpMode.MANEUVER)


def progress(desk, now):
    """Let the vehicle tell who waits that it takes time; when it is the next one's turn."""
    desk.endpoint.commands.poll(now)
    return desk.endpoint.commands.next_deadline


def texts(messages):
    return [m.values["text"].decode() for m in messages if m.name == "STATUSTEXT"]


def test_every_command_is_acknowledged(desk):
    for number in [*range(0, 700), *range(700, 65536, 61), 42428, 65535]:
        for params in ((), (math.nan,) * 7, (math.inf, -math.inf, 1e30, -1e30, 0, 1, 2)):
            result, _ = desk.command(number, *params)
            assert result in (ACCEPTED, REJECTED, DENIED, UNSUPPORTED, FAILED)
    assert desk.command(21196)[0] == UNSUPPORTED


@settings(max_examples=300)
@given(
    st.sampled_from([176, 262, 400, 410, 510, 511, 512, 520, 42428]),
    st.lists(st.floats(width=32), min_size=7, max_size=7),
    st.booleans(),
)
def test_no_parameters_of_a_command_raise(open_desk, number, params, as_int):
    desk = open_desk()
    if as_int:
        fields = {f"param{i}": p for i, p in enumerate(params[:4], 1)}
        answers = desk.ask("COMMAND_INT", target_system=26, command=number, x=-(2**31), y=2**31 - 1, **fields)
        assert [m.values["command"] for m in answers if m.name == "COMMAND_ACK"] == [number]
    else:
        desk.command(number, *params)


def test_messages_for_others_get_no_answer(desk):
    for target in ((27, 1), (26, 100), (0, 100)):
        assert desk.ask("COMMAND_LONG", command=400, target_system=target[0], target_component=target[1]) == []
    assert desk.ask("HEARTBEAT", type=6) == []


def test_request_message(open_desk, desk):
    result, (version,) = desk.command(512, 148)
    assert (result, version.name) == (ACCEPTED, "AUTOPILOT_VERSION")
    assert version.values["capabilities"] & 16
    assert not version.values["capabilities"] & 131072
    assert version.values["uid"] == open_desk().command(520)[1][0].values["uid"] != 0
    assert desk.command(512, 395) == (UNSUPPORTED, [])
    assert desk.command(512, 242)[0] == desk.command(410)[0] == REJECTED
    desk.locate()
    for number, name in ((242, "HOME_POSITION"), (33, "GLOBAL_POSITION_INT"), (30, "ATTITUDE"), (1, "SYS_STATUS")):
        result, (message,) = desk.command(512, number)
        assert (result, message.name) == (ACCEPTED, name)
    assert desk.command(410)[1][0].name == "HOME_POSITION"


def test_message_interval(desk):
    desk.locate()
    assert desk.command(511, 30, 100_000)[0] == ACCEPTED
    assert desk.command(510, 30)[1][0].values == {"message_id": 30, "interval_us": 100_000}
    assert desk.command(512, 244, 30)[1][0].values == {"message_id": 30, "interval_us": 100_000}
    assert desk.command(511, 30, -1)[0] == ACCEPTED
    assert desk.command(510, 30)[1][0].values["interval_us"] == -1
    assert "ATTITUDE" not in desk.run(1.0)
    assert desk.command(511, 30, 0)[0] == ACCEPTED
    assert desk.command(510, 30)[1][0].values["interval_us"] == 100_000
    assert desk.command(511, 2, 50_000)[0] == ACCEPTED
    assert abs(desk.run(2.0).count("SYSTEM_TIME") - 40) <= 1
    assert desk.command(511, 30, 1)[0] == ACCEPTED
    assert desk.command(510, 30)[1][0].values["interval_us"] == 5000
    assert desk.command(510, 9999)[1][0].values["interval_us"] == 0
    assert desk.command(512, 244, 9999)[1][0].values["interval_us"] == 0


@pytest.mark.parametrize(
    "params", [(9999, 1000), (30, math.nan), (30, math.inf), (30, -5), (math.nan, 1), (0, -1), (0, 2e6)]
)
def test_bad_intervals_are_denied_with_a_reason(desk, params):
    result, rest = desk.command(511, *params)
    assert result == DENIED
    assert texts(rest)


def test_request_data_stream(desk):
    desk.locate()
    desk.ask("REQUEST_DATA_STREAM", target_system=26, req_stream_id=0, req_message_rate=5, start_stop=1)
    names = desk.run(2.0)
    assert abs(names.count("VFR_HUD") - 10) <= 1
    desk.ask("REQUEST_DATA_STREAM", target_system=26, req_stream_id=10, req_message_rate=5, start_stop=0)
    assert "ATTITUDE" not in desk.run(1.0)


def test_arming(desk):
    assert desk.command(400, 1) == (ACCEPTED, [])
    assert desk.endpoint.urgent_state[0][1]
    assert desk.command(400, 0) == (ACCEPTED, [])
    assert not desk.endpoint.urgent_state[0][1]
    assert desk.command(400, 2)[0] == desk.command(400, math.nan)[0] == DENIED


def test_arming_is_denied_with_the_reason_while_an_entity_is_not_well(desk):
    lamp = desk.lamp
    lamp.state, lamp.description, lamp.stateful = State.ERROR, "bulb broken", True
    result, rest = desk.command(400, 1)
    assert result == DENIED
    assert texts(rest) == ["Arming denied: Lamp is in ERROR: bulb broken"]
    assert desk.command(400, 1, 21197)[0] == DENIED
    assert [desk.command(400, 1, force)[0] for force in (21196, 2989)] == [ACCEPTED] * 2, "2989 is MAVProxy's"
    desk.session.build_and_send("HEARTBEAT", desk.now)
    assert desk.said()[0].values["system_status"] == 5


def test_arming_is_denied_in_error_mode(desk):
    desk.endpoint.update_state(imc.VehicleState(op_mode=imc.VehicleState.OpMode.ERROR, error_ents="DVL"), "", desk.now)
    result, rest = desk.command(400, 1)
    assert (result, texts(rest)) == (DENIED, ["Arming denied: the vehicle is in ERROR: DVL"])


def test_disarming_in_a_maneuver_takes_force(desk):
    desk.endpoint.update_state(MANEUVER, "", desk.now)
    assert desk.command(400, 0)[0] == DENIED
    assert desk.stops == 0
    assert desk.command(400, 0, 2989)[0] == DENIED
    assert desk.command(400, 0, 21196)[0] == ACCEPTED
    assert desk.stops == 1


@pytest.mark.parametrize(
    ("flavor", "kind", "params"),
    [
        ("px4", "submarine", (1, 4, 3)),
        ("generic", "boat", (1, 4, 3)),
        ("ardupilot", "submarine", (1, 16)),
        ("ardupilot", "submarine", (1, 2)),
        ("ardupilot", "copter", (1, 17)),
        ("ardupilot", "boat", (1, 4)),
    ],
)
def test_hold_is_never_denied(open_desk, flavor, kind, params):
    desk = open_desk(flavor, kind)
    assert desk.command(176, *params)[0] == ACCEPTED
    assert desk.endpoint.model.mode.name == "HOLD"
    assert desk.holds == []
    desk.endpoint.update_state(MANEUVER, "", desk.now)
    assert desk.endpoint.model.mode.name == "MISSION"
    assert desk.command(176, *params)[0] == ACCEPTED
    assert (desk.holds, desk.stops) == ([], 1), "without a position it can only stop"
    desk.locate()
    assert desk.command(176, *params, confirmation=0)[0] == ACCEPTED
    assert isinstance(desk.holds[0], imc.StationKeeping)


@pytest.mark.parametrize(("kind", "number"), [("boat", 4), ("boat", 5), ("copter", 17), ("submarine", 2)])
def test_heartbeat_shows_the_number_that_was_asked_for(open_desk, kind, number):
    """ArduRover's HOLD was shown as LOITER, and a station that waits for its mode waited in vain."""
    desk = open_desk("ardupilot", kind)
    desk.command(176, 1, number)
    desk.session.build_and_send("HEARTBEAT", desk.now)
    assert desk.said()[0].values["custom_mode"] == number
    desk.endpoint.update_state(MANEUVER, "", desk.now)
    desk.endpoint.update_state(imc.VehicleState(op_mode=imc.VehicleState.OpMode.SERVICE), "", desk.now)
    desk.session.build_and_send("HEARTBEAT", desk.now)
    assert desk.said()[0].values["custom_mode"] == {"boat": 0, "copter": 0, "submarine": 19}[kind]


def test_an_order_that_takes_time_is_acknowledged_when_the_vehicle_has_answered(desk):
    desk.answers = False
    desk.locate()
    desk.endpoint.update_state(MANEUVER, "", desk.now)
    assert desk.ask("COMMAND_LONG", target_system=26, **RETURN) == []
    assert [m.values["result"] for m in desk.ask("COMMAND_LONG", target_system=26, confirmation=1, **RETURN)] == [5]
    assert progress(desk, desk.now + 0.1) == desk.now + 0.25
    assert desk.said() == []
    assert progress(desk, desk.now + 0.3) is None
    assert [m.values["result"] for m in desk.said()] == [IN_PROGRESS]
    assert len(desk.requests) == 1, "the same order again means that the answer was lost"
    kind = imc.PlanControl.Type
    desk.endpoint.plans.receive(desk.requests[0].replace(type=kind.IN_PROGRESS))
    assert desk.said() == []
    desk.endpoint.plans.receive(desk.requests[0].replace(type=kind.SUCCESS))
    (ack,) = desk.said()
    assert (ack.values["command"], ack.values["result"], ack.values["target_system"]) == (20, ACCEPTED, 255)
    desk.endpoint.plans.receive(desk.requests[0].replace(type=kind.SUCCESS))
    assert desk.said() == []
    assert desk.command(20, confirmation=2)[0] == ACCEPTED
    assert len(desk.requests) == 1


@pytest.mark.parametrize("answers", [True, False])
def test_a_mode_that_takes_time_is_not_in_progress_as_mavsdk_would_give_up(desk, answers):
    desk.answers = False
    desk.locate()
    desk.endpoint.update_state(MANEUVER, "", desk.now)
    assert desk.ask("COMMAND_LONG", target_system=26, **ORDER) == []
    assert desk.ask("COMMAND_LONG", target_system=26, confirmation=1, **ORDER) == []
    assert progress(desk, desk.now + 0.3) == desk.now + 1.5
    assert desk.said() == []
    assert len(desk.requests) == 1, "the same order again means that the answer was lost"
    if answers:
        desk.endpoint.plans.receive(desk.requests[0].replace(type=imc.PlanControl.Type.SUCCESS))
    else:  # before MAVSDK gives up, after 2 s
        assert progress(desk, desk.now + 1.6) is None
    assert [m.values["result"] for m in desk.said() if m.name == "COMMAND_ACK"] == [ACCEPTED if answers else FAILED]


@pytest.mark.parametrize("between", ["hold", "mode", "nothing"])
def test_the_same_place_again_after_another_order_is_meant(desk, between):
    """COMMAND_INT has no count of its repetitions."""
    desk.locate()
    desk.endpoint.update_state(MANEUVER, "", desk.now)
    place = dict(target_system=26, command=192, param1=-1.0, x=401000000, y=-86000000, z=-3.0, frame=6)
    desk.ask("COMMAND_INT", **place)
    if between == "hold":
        desk.command(176, *HOLD)
    elif between == "mode":
        desk.ask("SET_MODE", target_system=26, base_mode=1, custom_mode=4 << 16 | 3 << 24)
    desk.now += 1.0
    desk.ask("COMMAND_INT", **place)
    went = [request for request in desk.requests if request.plan_id == "goto"]
    assert len(went) == (1 if between == "nothing" else 2)


def test_answers_that_are_no_longer_needed_are_forgotten(desk):
    desk.locate()
    for command in (192, 193, 20):
        desk.ask("COMMAND_LONG", target_system=26, command=command)
    assert desk.endpoint.commands._pending[desk.session]
    progress(desk, desk.now + 11.0)
    assert not desk.endpoint.commands._pending[desk.session]


def test_a_vehicle_that_does_not_answer_is_reported_after_some_seconds(desk):
    desk.answers = False
    desk.locate()
    desk.endpoint.update_state(MANEUVER, "", desk.now)
    assert desk.ask("COMMAND_LONG", target_system=26, **ORDER) == []
    for seconds in (3.1, 6.2):  # the hold, and the stop after it
        desk.endpoint.plans.tick(desk.now + seconds)
    said = desk.said()
    assert [m.values["result"] for m in said if m.name == "COMMAND_ACK"] == [ACCEPTED]
    assert texts(said) == ["Cannot hold, stopping: the vehicle does not answer"]


def test_modes_are_listed_one_by_one_or_all(open_desk):
    for flavor, kind, names in (
        ("ardupilot", "submarine", ["Manual", "Teleoperation", "Mission", "Hold", "Guided", "Return"]),
        ("px4", "submarine", ["Manual", "Teleoperation", "Mission", "Hold", "Offboard", "Return"]),
        ("px4", "copter", ["Manual", "Teleoperation", "Mission", "Hold", "Offboard", "Return", "Takeoff", "Land"]),
    ):
        desk = open_desk(flavor, kind)
        found = [m.values for m in desk.command(512, 435)[1]]
        assert [m["mode_name"].decode() for m in found] == names
        assert [(m["number_modes"], m["mode_index"]) for m in found] == [
            (len(names), n) for n in range(1, len(names) + 1)
        ]
        assert [m.values for m in desk.command(512, 435, 3)[1]] == [found[2]]
        assert desk.command(512, 435, 99)[0] == REJECTED


def test_hold_keeps_station_at_the_present_depth_and_ends_with_manual_or_disarming(desk):
    desk.locate(depth=3.0)
    desk.endpoint.update_state(MANEUVER, "", desk.now)
    assert desk.command(176, *HOLD)[0] == ACCEPTED
    (station,) = desk.holds
    assert (station.lat, station.lon, station.z) == pytest.approx((0.7, -0.15, 3.0))
    assert station.z_units == imc.ZUnits.DEPTH
    plan = imc.PlanControlState
    desk.endpoint.update_state(plan(state=plan.State.EXECUTING, plan_id="hold"), "", desk.now)
    assert desk.endpoint.model.mode.name == "HOLD"
    assert desk.command(176, *HOLD)[0] == ACCEPTED
    assert len(desk.holds) == 1, "it holds already"
    assert desk.command(176, 1, 1)[0] == desk.command(400, 0)[0] == ACCEPTED
    assert desk.stops == 2


def test_hold_moves_no_vehicle_that_rests_disarmed_or_is_ill(desk):
    desk.locate(depth=0.0)
    for mode in (imc.VehicleState.OpMode.SERVICE, imc.VehicleState.OpMode.ERROR):
        desk.endpoint.update_state(imc.VehicleState(op_mode=mode), "", desk.now)
        assert desk.command(176, *HOLD)[0] == ACCEPTED
    assert desk.holds == []
    desk.endpoint.update_state(imc.VehicleState(op_mode=imc.VehicleState.OpMode.SERVICE), "", desk.now)
    assert desk.command(400, 1)[0] == desk.command(176, *HOLD)[0] == ACCEPTED
    assert len(desk.holds) == 1


def test_what_nobody_reports_any_more_is_unknown(desk):
    desk.endpoint.update_state(imc.VehicleState(op_mode=imc.VehicleState.OpMode.MANEUVER), "", desk.now)
    for message in (imc.Voltage(value=24.0), imc.Current(value=2.0), imc.CpuUsage(value=7), imc.FuelLevel(value=60.0)):
        desk.endpoint.update_state(message, "Batteries", desk.now)
    assert desk.endpoint.urgent_state[1]
    desk.now += 3.5
    desk.endpoint.model.forget_old()
    desk.session.build_and_send("HEARTBEAT", desk.now)
    beat = desk.said()[0].values
    assert (beat["system_status"], beat["base_mode"] & 128) == (5, 0)
    assert desk.command(400, 1)[0] == DENIED
    desk.now += 7.5
    desk.endpoint.model.forget_old()
    desk.session.build_and_send("SYS_STATUS", desk.now)
    status = desk.said()[0].values
    assert (status["voltage_battery"], status["current_battery"], status["load"]) == (0xFFFF, -1, 0)
    assert status["battery_remaining"] == 60


def test_other_modes_are_denied_with_a_reason(desk):
    result, rest = desk.command(176, 1, 4, 4)
    assert result == DENIED
    assert "MISSION" in texts(rest)[0]
    assert desk.command(176, 1, 99, 99)[0] == desk.command(176, 0, 1)[0] == desk.command(262, 6)[0] == DENIED
    assert desk.command(262, 1)[0] == ACCEPTED
    assert desk.command(176, 1, 1)[0] == ACCEPTED
    assert desk.endpoint.model.mode.name == "MANUAL"


def test_set_mode_message(desk):
    assert desk.ask("SET_MODE", target_system=26, base_mode=1, custom_mode=4 << 16 | 3 << 24) == []
    assert desk.endpoint.model.mode.name == "HOLD"
    assert texts(desk.ask("SET_MODE", target_system=26, base_mode=1, custom_mode=77))
