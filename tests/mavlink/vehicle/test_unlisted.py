"""A station that may not command reads everything; each of its orders gets the protocol's refusal, and the reason."""

import pytest

from mavlink.vehicle import UNLISTED

REASON = "mavlink:255 is not in [General] Consoles of lauv-noptilus-1"
HERE = {"target_system": 26, "target_component": 1}
DENIED, MISSION_DENIED, PERMISSION_DENIED = 2, 14, 3
ORDERS = [
    ("COMMAND_LONG", {**HERE, "command": 400, "param1": 1.0}, ("COMMAND_ACK", "result", DENIED)),
    ("COMMAND_LONG", {**HERE, "command": 300}, ("COMMAND_ACK", "result", DENIED)),
    ("COMMAND_INT", {**HERE, "command": 192, "x": 1, "y": 1}, ("COMMAND_ACK", "result", DENIED)),
    ("COMMAND_LONG", {**HERE, "command": 31999}, ("COMMAND_ACK", "result", DENIED)),
    ("MISSION_COUNT", {**HERE, "count": 3}, ("MISSION_ACK", "type", MISSION_DENIED)),
    ("MISSION_CLEAR_ALL", HERE, ("MISSION_ACK", "type", MISSION_DENIED)),
    ("MISSION_ITEM_INT", {**HERE, "current": 2, "command": 16, "frame": 6}, ("MISSION_ACK", "type", MISSION_DENIED)),
    ("MISSION_ITEM_INT", {**HERE, "command": 16, "frame": 6}, ("MISSION_ACK", "type", MISSION_DENIED)),
    ("PARAM_SET", {**HERE, "param_id": b"LAMP_RED", "param_value": 9.0, "param_type": 9}, ("PARAM_ERROR", "error", 3)),
    ("SET_MODE", {"target_system": 26, "custom_mode": 0, "base_mode": 1}, ("STATUSTEXT", "severity", 4)),
    ("SET_POSITION_TARGET_GLOBAL_INT", {**HERE, "type_mask": 0}, ("STATUSTEXT", "severity", 4)),
]
READS = [
    ("PARAM_REQUEST_LIST", HERE),
    ("MISSION_REQUEST_LIST", HERE),
    ("COMMAND_LONG", {**HERE, "command": 512, "param1": 148.0}),
    ("COMMAND_LONG", {**HERE, "command": 511, "param1": 30.0, "param2": 1e5}),
    ("HEARTBEAT", {"type": 6}),
    ("TIMESYNC", {"ts1": 5}),
]


def sent(desk, name, fields):
    ignored = desk.endpoint.receive(desk.session, desk.frame(name, **fields), desk.now, REASON)
    return ignored, desk.said()


@pytest.mark.parametrize(("name", "fields", "answer"), ORDERS)
def test_an_order_is_refused_in_the_terms_of_its_protocol_and_counted(desk, name, fields, answer):
    ignored, said = sent(desk, name, fields)
    assert ignored == {UNLISTED: 1}
    kind, field, value = answer
    assert value in [message.values[field] for message in said if message.name == kind]
    words = "".join(bytes(m.values["text"]).rstrip(b"\0").decode() for m in said if m.name == "STATUSTEXT")
    assert REASON in words
    assert (desk.requests, desk.wishes, desk.stops, desk.holds) == ([], [], 0, [])


@pytest.mark.parametrize("name", ["MANUAL_CONTROL", "RC_CHANNELS_OVERRIDE"])
def test_a_stick_moves_nothing_and_is_counted(desk, name):
    fields = {"target": 26} if name == "MANUAL_CONTROL" else HERE
    ignored, _ = sent(desk, name, fields)
    assert ignored == {UNLISTED: 1}
    assert desk.requests == []


@pytest.mark.parametrize(("name", "fields"), READS)
def test_reading_is_no_order(desk, name, fields):
    desk.locate()
    ignored, said = sent(desk, name, fields)
    assert ignored == {}
    refused = [m for m in said if m.name == "COMMAND_ACK" and m.values["result"] == DENIED]
    assert not refused


def test_the_next_message_of_a_listed_station_on_the_same_link_is_obeyed(desk):
    sent(desk, "PARAM_SET", ORDERS[8][1])
    assert desk.wishes == []
    desk.send("PARAM_SET", **ORDERS[8][1])
    assert len(desk.wishes) == 1


def test_a_station_that_may_not_command_does_not_hold_off_the_failsafe(desk):
    desk.options.gcs_timeout = 10.0
    desk.send("HEARTBEAT", type=6)
    received_at = desk.endpoint.failsafe._received_at
    assert received_at == desk.now
    desk.now += 5.0
    sent(desk, "HEARTBEAT", {"type": 6})
    sent(desk, "COMMAND_LONG", {**HERE, "command": 512, "param1": 148.0})
    assert desk.endpoint.failsafe._received_at == received_at
