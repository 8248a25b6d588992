"""Each service of a vehicle that is not there: bytes in, bytes out, at times that are only numbers."""

import struct

import pytest

import imc
from mavlink.missions import MissionCommand
from tests.mavlink.vehicle.desk import Desk, Folder

ACCEPTED, FAILED = 0, 4
HOLD = {"param1": 1.0, "param2": 4.0, "param3": 3.0}  # PX4's mode AUTO, LOITER
OURS = {"target_system": 26, "target_component": 1}
LIST_FOLDER, ACK, NAK, END_OF_FILE = 3, 128, 129, 6
Plan = imc.PlanControlState


def named(messages, name):
    return [message.values for message in messages if message.name == name]


def test_a_new_peer_gets_a_heartbeat_and_then_one_each_second(desk):
    assert desk.endpoint.next_deadline <= desk.now
    beats = [(message.system, message.component) for message in desk.listen(3.5, "HEARTBEAT")]
    assert beats == [(26, 1)] * 4


def test_a_command_is_carried_out_and_acknowledged_to_its_sender(desk):
    desk.locate()
    desk.endpoint.receive_imc_message(imc.VehicleState(op_mode=imc.VehicleState.OpMode.MANEUVER), "", desk.now)
    desk.said()
    ignored, said = desk.send("COMMAND_LONG", **OURS, command=176, **HOLD)
    (ack,) = named(said, "COMMAND_ACK")
    assert (ignored, len(desk.holds)) == ({}, 1)
    assert (ack["command"], ack["result"], ack["target_system"], ack["target_component"]) == (176, ACCEPTED, 255, 190)


def test_what_stands_before_the_port_later_gets_all_requests(desk):
    """A fault, for example, that is put there while the vehicle runs."""
    desk.locate()
    desk.endpoint.receive_imc_message(imc.VehicleState(op_mode=imc.VehicleState.OpMode.MANEUVER), "", desk.now)
    caught = []
    desk.publish = caught.append
    desk.send("COMMAND_LONG", **OURS, command=176, **HOLD)
    desk.send("COMMAND_LONG", **OURS, command=185, param1=1)
    desk.send("MISSION_CLEAR_ALL", **OURS)
    assert [type(message) for message in caught] == [imc.PlanControl, imc.Abort]
    assert {message.dst for message in caught} == {desk.imc_id}


def test_a_change_of_mode_is_shown_at_once(desk):
    desk.said()
    desk.endpoint.receive_imc_message(imc.VehicleState(op_mode=imc.VehicleState.OpMode.MANEUVER), "", desk.now)
    assert [message.name for message in desk.said()] == ["HEARTBEAT"]
    desk.endpoint.receive_imc_message(imc.VehicleState(op_mode=imc.VehicleState.OpMode.MANEUVER), "", desk.now)
    assert desk.said() == []


def test_the_whole_list_of_parameters_comes_a_few_at_a_time(desk):
    desk.send("PARAM_REQUEST_LIST", **OURS)
    assert desk.endpoint.next_deadline <= desk.now
    values = [message.values for message in desk.listen(1.0, "PARAM_VALUE")]
    assert [value["param_index"] for value in values] == list(range(len(desk.endpoint.parameters))) != []
    assert {value["param_count"] for value in values} == {len(values)}


def test_a_parameter_that_the_vehicle_does_not_change_is_shown_as_it_is(desk):
    desk.run(0.0)
    _, said = desk.send("PARAM_SET", **OURS, param_id=b"LAMP_POWER", param_value=2.0, param_type=9)
    assert (desk.wishes, named(said, "PARAM_VALUE")) == ([("LAMP_POWER", "2")], [])
    asked = desk.now
    (value,) = [message.values for message in desk.listen(0.26, "PARAM_VALUE")]
    assert value["param_value"] == 0.5
    assert desk.now == pytest.approx(asked + 0.26)


def test_a_change_of_a_parameter_is_shown_to_all(desk):
    other = []
    desk.endpoint.connect(desk.traits, other.append, desk.now)
    desk.send("PARAM_SET", **OURS, param_id=b"LAMP_POWER", param_value=2.0, param_type=9)
    answer = imc.EntityParameters(name="Lamp", params=(imc.EntityParameter(name="Power", value="0.5"),))
    desk.endpoint.receive_imc_message(answer, "Lamp", desk.now)
    assert len(named(desk.said(), "PARAM_VALUE")) == len(other) == 1
    assert desk.listen(0.5, "PARAM_VALUE") == [], "once is enough"


def test_a_mission_goes_up_and_comes_down_again(desk):
    desk.locate()
    items = [
        {
            **OURS,
            "seq": n,
            "frame": 6,
            "command": MissionCommand.NAV_WAYPOINT,
            "x": 401_000_000 + n,
            "y": -86_000_000,
            "z": -2.0,
        }
        for n in range(3)
    ]
    _, said = desk.send("MISSION_COUNT", **OURS, count=3)
    while requests := named(said, "MISSION_REQUEST_INT"):
        _, said = desk.send("MISSION_ITEM_INT", **items[requests[0]["seq"]])
    (ack,) = named(said, "MISSION_ACK")
    assert ack["type"] == ACCEPTED
    (stored,) = [request for request in desk.requests if isinstance(request, imc.PlanDB)]
    assert (stored.op, stored.plan_id, len(stored.arg.maneuvers)) == (imc.PlanDB.Op.SET, "mavlink", 3)
    (count,) = named(desk.send("MISSION_REQUEST_LIST", **OURS)[1], "MISSION_COUNT")
    assert (count["count"], count["opaque_id"]) == (3, ack["opaque_id"])
    for item in items:
        (found,) = named(desk.send("MISSION_REQUEST_INT", **OURS, seq=item["seq"])[1], "MISSION_ITEM_INT")
        assert (found["x"], found["y"], found["command"]) == (item["x"], item["y"], item["command"])


def test_an_item_that_does_not_come_is_asked_for_again_in_time(desk):
    desk.run(0.0)
    desk.send("MISSION_COUNT", **OURS, count=2)
    began = desk.now
    desk.endpoint.poll(desk.now)
    assert desk.endpoint.mission_transfer.next_deadline == began + 0.25
    again = desk.listen(3.0, "MISSION_REQUEST_INT")
    assert len(again) == 5
    assert desk.endpoint.mission_transfer.next_deadline is None


def listing(desk, path, offset=0):
    """The kind of the answer to a request for a listing, and its data."""
    request = struct.pack("<HBBBBBxI", 1, 0, LIST_FOLDER, len(path), 0, 0, offset) + path
    _, said = desk.send("FILE_TRANSFER_PROTOCOL", target_system=26, payload=tuple(request))
    (values,) = named(said, "FILE_TRANSFER_PROTOCOL")
    payload = bytes(values["payload"])
    return payload[3], payload[12 : 12 + payload[4]]


def test_folders_are_listed():
    desk = Desk(files=Folder(**{"logs/20240102/data": b"12345", "logs/notes": b"1"}))
    kind, root = listing(desk, b"/")
    names = [line.split(b"\t")[0] for line in root.split(b"\0")[:-1]]
    assert (kind, names) == (ACK, [b"Fgeneral.json", b"Dlogs", b"Fparameters.json", b"Fparameters.json.xz"])
    assert listing(desk, b"/logs") == (ACK, b"D20240102\0Fnotes\t1\0")
    assert listing(desk, b"/logs/20240102") == (ACK, b"Fdata\t5\0")
    assert listing(desk, b"/logs/20240102", offset=1) == (NAK, bytes((END_OF_FILE,)))
    assert listing(desk, b"/../logs") == listing(desk, b"/nowhere") == (NAK, b"\n")


def test_a_message_comes_at_the_interval_that_was_asked_for(desk):
    desk.run(0.0)
    _, said = desk.send("COMMAND_LONG", **OURS, command=511, param1=2, param2=50_000)  # SYSTEM_TIME
    assert named(said, "COMMAND_ACK")[0]["result"] == ACCEPTED
    desk.endpoint.poll(desk.now)
    desk.said()
    assert desk.endpoint.next_deadline == pytest.approx(desk.now + 0.05)
    assert len(desk.listen(1.0, "SYSTEM_TIME")) == 20
    desk.send("COMMAND_LONG", **OURS, command=511, param1=2, param2=-1)
    desk.listen(0.0, "")
    assert desk.listen(1.0, "SYSTEM_TIME") == []


def test_who_waits_for_an_answer_is_reported_in_time(desk):
    desk.answers = False
    desk.locate()
    desk.endpoint.receive_imc_message(imc.VehicleState(op_mode=imc.VehicleState.OpMode.MANEUVER), "", desk.now)
    desk.run(0.0)
    assert named(desk.send("COMMAND_LONG", **OURS, command=20)[1], "COMMAND_ACK") == []
    assert desk.endpoint.commands.next_deadline == desk.now + 0.25
    assert [ack.values["result"] for ack in desk.listen(0.3, "COMMAND_ACK")] == [5]
    assert [ack.values["result"] for ack in desk.listen(7.0, "COMMAND_ACK")] == [FAILED], "nobody answered"


def test_what_is_damaged_foreign_or_doubled_is_ignored_and_counted(desk):
    frame = bytearray(desk.frame("PARAM_REQUEST_LIST", **OURS))
    frame[-1] ^= 0xFF
    assert desk.endpoint.receive(desk.session, bytes(frame), desk.now) == {"malformed": 1}
    assert desk.endpoint.receive(desk.session, b"rubbish", desk.now) == {"malformed": 1}
    assert desk.endpoint.receive(desk.session, b"", desk.now) == {"malformed": 1}
    assert desk.send("COMMAND_LONG", target_system=27, target_component=1, command=400, param1=1) == (
        {"foreign": 1},
        [],
    )
    frame = desk.frame("COMMAND_LONG", **OURS, command=400, param1=1)
    assert desk.endpoint.receive(desk.session, frame, desk.now) == {}
    assert desk.endpoint.receive(desk.session, frame, desk.now) == {"doubled": 1}
    assert len(named(desk.said(), "COMMAND_ACK")) == 1


@pytest.mark.parametrize("action", ["Hold", "Stop", "Return"])
def test_a_vehicle_whose_stations_fall_silent_does_what_its_profile_says(desk, action):
    desk.options.gcs_timeout, desk.options.gcs_action = 5.0, action
    running = Plan(state=Plan.State.EXECUTING, plan_id="goto")
    moving = imc.VehicleState(op_mode=imc.VehicleState.OpMode.MANEUVER)

    def live(seconds):
        for _ in range(seconds):
            desk.locate()
            desk.endpoint.receive_imc_message(running, "Plan Engine", desk.now)
            desk.endpoint.receive_imc_message(moving, "Vehicle Supervisor", desk.now)
            desk.listen(1.0, "")

    live(10)
    assert desk.warnings == [], "no station was there"
    desk.send("HEARTBEAT", type=6)
    desk.send("COMMAND_INT", **OURS, command=192, param1=-1.0, x=401_000_000, y=-86_000_000, z=-3.0, frame=6)
    before = len(desk.requests)
    live(5)
    assert len(desk.requests) == before
    live(2)
    assert desk.warnings == [f"no ground station for 5 s: {action}"]
    (request,) = desk.requests[before:]
    assert (request.op, request.plan_id) == {
        "Hold": (imc.PlanControl.Op.START, "hold"),
        "Stop": (imc.PlanControl.Op.STOP, ""),
        "Return": (imc.PlanControl.Op.START, "return"),
    }[action]


def test_a_session_that_has_ended_gets_nothing_and_files_are_closed(desk):
    desk.send("PARAM_REQUEST_LIST", **OURS)
    desk.endpoint.disconnect(desk.session)
    assert desk.run(2.0) == []
    desk.endpoint.send_statustext(4, "leak", desk.now)
    assert desk.said() == []
    desk.endpoint.close()
