"""Missions, commands and parameters in .tlog files, as pymavlink writes them."""

import math
import struct

import pytest
from pymavlink.dialects.v20 import ardupilotmega as mavlink

import imc
from mavlink import encode, load_dialect
from shoal.logs.edit.tlog_import import import_tlog

PX4, ARDUPILOT = 12, 3
WAYPOINT, SERVO = 16, 183
Phase = imc.PlanControlState.State


class Recording:
    """Frames of an autopilot and a station, one per second."""

    def __init__(self, kind=12, autopilot=ARDUPILOT, mode=3):
        self.data, self.time = b"", 1.7e9
        self._senders = {n: mavlink.MAVLink(None, srcSystem=n, srcComponent=1 if n == 1 else 190) for n in (1, 255)}
        self.add(1, mavlink.MAVLink_heartbeat_message(kind, autopilot, 81, mode, 4, 3))

    def add(self, sender, *messages):
        for message in messages:
            self.data += struct.pack(">Q", round(self.time * 1e6)) + message.pack(self._senders[sender])
            self.time += 1.0
        return self

    def mission(self, *commands, sender=255, result=0, skip=None):
        """A transfer from `sender`, of waypoints at 10 m depth and 100 m distances."""
        target = 256 - sender
        self.add(sender, mavlink.MAVLink_mission_count_message(target, 1, len(commands)))
        for seq, command in enumerate(commands):
            where = (round(41.18e7) + seq * 9000, round(-8.7e7), -10.0)
            item = mavlink.MAVLink_mission_item_int_message(target, 1, seq, 6, command, 0, 1, 0, 0, 0, math.nan, *where)
            if seq != skip:
                self.add(sender, item)
        return self.add(target, mavlink.MAVLink_mission_ack_message(sender, 1, result))

    def imported(self, tmp_path):
        (tmp_path / "a.tlog").write_bytes(self.data)
        (tmp_path / "log").mkdir()
        import_tlog(tmp_path / "a.tlog", tmp_path / "log")
        return imc.Log(tmp_path / "log")


@pytest.mark.parametrize("sender", [1, 255], ids=["download", "upload"])
@pytest.mark.parametrize(("autopilot", "first"), [(ARDUPILOT, 1), (PX4, 0)], ids=["ardupilot", "px4"])
def test_a_mission_becomes_a_plan_whoever_sends_it(tmp_path, sender, autopilot, first):
    log = Recording(autopilot=autopilot).mission(*[WAYPOINT] * 4, sender=sender).imported(tmp_path)
    (plan,) = log.messages("PlanSpecification")
    places = [maneuver.data for maneuver in plan.maneuvers]
    lats = [math.radians(41.18 + seq * 9e-4) for seq in range(first, 4)]
    assert [place.lat for place in places] == pytest.approx(lats, abs=1e-10)
    assert {(place.z, place.z_units) for place in places} == {(10.0, imc.ZUnits.DEPTH)}
    assert not list(log.messages("LogBookEntry"))


def test_a_mission_that_is_read_again_is_one_plan_and_another_one_is_another(tmp_path):
    recording = Recording().mission(WAYPOINT, WAYPOINT).mission(WAYPOINT, WAYPOINT, sender=1)
    log = recording.mission(WAYPOINT, WAYPOINT, WAYPOINT).imported(tmp_path)
    assert [len(plan.maneuvers) for plan in log.messages("PlanSpecification")] == [1, 2]


WRONG = {
    "unknown": (Recording().mission(WAYPOINT, WAYPOINT, SERVO), "the mission of 3 items is no plan of IMC: item 2 ("),
    "refused": (Recording().mission(WAYPOINT, WAYPOINT, result=5), "a mission of 2 items was not accepted: INVALID"),
    "lossy": (Recording().mission(WAYPOINT, WAYPOINT, skip=1), "the recording lacks 1 of its items"),
}


@pytest.mark.parametrize("name", WRONG)
def test_what_is_no_plan_is_reported_with_the_reason(tmp_path, name):
    recording, why = WRONG[name]
    log = recording.imported(tmp_path)
    (entry,) = log.messages("LogBookEntry")
    assert (why in entry.text, entry.type) == (True, imc.LogBookEntry.Type.WARNING), entry.text
    assert not list(log.messages("PlanSpecification"))


def test_progress_names_the_maneuver_of_the_item(tmp_path):
    recording = Recording().mission(*[WAYPOINT] * 4)
    for seq in (1, 1, 2):
        recording.add(1, mavlink.MAVLink_mission_current_message(seq, 4, 3))
    log = recording.add(1, mavlink.MAVLink_mission_current_message(3, 4, 5)).imported(tmp_path)
    (plan,) = log.messages("PlanSpecification")
    names = [maneuver.maneuver_id for maneuver in plan.maneuvers]
    states = list(log.messages("PlanControlState"))
    assert [(state.state, state.man_id) for state in states] == [
        (Phase.EXECUTING, names[0]),
        (Phase.EXECUTING, names[1]),
        (Phase.READY, ""),
    ]
    assert [state.plan_progress for state in states] == [25.0, 50.0, -1.0]
    assert states[-1].last_outcome == imc.PlanControlState.LastOutcome.SUCCESS


def test_commands_are_reported_with_their_results_but_not_what_only_asks(tmp_path):
    recording = Recording()
    for command, result in ((512, 4), (400, 0), (22, 2)):
        recording.add(1, mavlink.MAVLink_command_ack_message(command, result))
    entries = list(recording.imported(tmp_path).messages("LogBookEntry"))
    types = imc.LogBookEntry.Type
    assert [(e.type, e.text) for e in entries] == [
        (types.INFO, "command 400: ACCEPTED"),
        (types.WARNING, "NAV_TAKEOFF: DENIED"),
    ]


def test_items_that_were_reached_are_reported(tmp_path):
    recording = Recording().mission(*[WAYPOINT] * 3)
    for seq in (1, 2, 65535):
        recording.add(1, mavlink.MAVLink_mission_item_reached_message(seq))
    log = recording.imported(tmp_path)
    (plan,) = log.messages("PlanSpecification")
    names = [maneuver.maneuver_id for maneuver in plan.maneuvers]
    assert [(entry.context, entry.text) for entry in log.messages("LogBookEntry")] == [
        ("mission", f"item 1 of the mission was reached: maneuver {names[0]}"),
        ("mission", f"item 2 of the mission was reached: maneuver {names[1]}"),
        ("mission", "item 65535 of the mission was reached"),
    ]


def test_events_are_reported_once_by_number_and_those_for_programs_not_at_all(tmp_path):
    """What their numbers mean is in a file of the autopilot; pymavlink's dialect lacks the message."""
    recording, definition = Recording(autopilot=PX4), load_dialect().by_name["EVENT"]
    for sequence, level in ((7, 0x54), (7, 0x54), (8, 0x58), (9, 0x63)):
        values = {"id": 1 << 24 | 4711, "sequence": sequence, "log_levels": level, "arguments": b"\x01\x02" + bytes(38)}
        recording.data += struct.pack(">Q", round(recording.time * 1e6))
        recording.data += encode(definition, definition.pack(values), sequence, 1, 1)
    types = imc.LogBookEntry.Type
    assert [(e.type, e.context, e.text) for e in recording.imported(tmp_path).messages("LogBookEntry")] == [
        (types.WARNING, "EVENT", "event 4711 of component 1, arguments 01 02"),
        (types.ERROR, "EVENT", "event 4711 of component 1, arguments 01 02"),
    ]


def test_arming_is_reported_when_it_changes(tmp_path):
    recording = Recording()
    for base in (81, 209, 209, 81):
        recording.add(1, mavlink.MAVLink_heartbeat_message(12, ARDUPILOT, base, 3, 4, 3))
    states = imc.ArmingState.State
    found = [message.state for message in recording.imported(tmp_path).messages("ArmingState")]
    assert found == [states.DISARMED, states.ARMED, states.DISARMED]


@pytest.mark.parametrize("autopilot", [ARDUPILOT, PX4])
def test_parameters_come_together_and_integers_as_the_autopilot_encodes_them(tmp_path, autopilot):
    recording = Recording(autopilot=autopilot)
    (seven,) = struct.unpack("<f", struct.pack("<i", -7)) if autopilot == PX4 else (-7.0,)
    for name, value, kind in ((b"COUNT", seven, 6), (b"GAIN", 0.1, 9)):
        recording.add(1, mavlink.MAVLink_param_value_message(name, value, kind, 2, 0))
    (message,) = recording.imported(tmp_path).messages("EntityParameters")
    assert message.name == "Autopilot"
    assert [(p.name, p.value) for p in message.params] == [("COUNT", "-7"), ("GAIN", "0.1")]
