"""The conversation with one ground station, without a socket."""

import math
import struct
from pathlib import Path

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

import imc
from runtime import State, Task, param
from runtime.testing import simulate
from tasks.transports.mavlink_protocol.autopilot import Autopilot
from tasks.transports.mavlink_protocol.dialect import load
from tasks.transports.mavlink_protocol.frames import encode, split
from tasks.transports.mavlink_protocol.modes import FLAVOURS, KINDS
from tasks.transports.mavlink_protocol.parameters import ParameterTable
from tasks.transports.mavlink_protocol.services import serve
from tasks.transports.mavlink_protocol.session import Session, addressed
from tasks.transports.mavlink_protocol.text import chunks

DIALECT = load()
DATA = Path(__file__).parents[2] / "data" / "mavlink"
BOOT = 1000.0
ACCEPTED, REJECTED, DENIED, UNSUPPORTED = range(4)
MANEUVER = imc.VehicleState(op_mode=imc.VehicleState.OpMode.MANEUVER)


class Lamp(Task):
    """Something with parameters."""

    power: float = param(0.5, "W", "Power.", minimum=0, maximum=10)
    blinks: int = param(3, "1", "Blinks.", minimum=0, maximum=1000)
    red: float = param(1.0, "1", "Red.")
    green: float = param(1.0, "1", "Green.")
    blue: float = param(1.0, "1", "Blue.")


class Desk:
    """One session and what went out on it."""

    def __init__(self, flavour="px4", kind="submarine", system=26):
        self.vehicle = simulate(Lamp, seconds=0.0, section="Lamp").vehicle
        self.wishes = []
        self.stops = 0
        self.frames = []
        self.autopilot = Autopilot(
            DIALECT,
            name="lauv-noptilus-1",
            system=system,
            kind=KINDS[kind],
            boot=BOOT,
            undulation=0.0,
            rates=lambda: {"ATTITUDE": 10.0, "SYS_STATUS": 2.0},
            parameters=ParameterTable(self.vehicle.tasks),
            entities=lambda: self.vehicle.entities,
            set_parameter=lambda entry, text: self.wishes.append((entry.id, text)),
            stop_plan=self.stop,
        )
        self.session = Session(self.autopilot, FLAVOURS[flavour], self.frames.append, BOOT)
        self.now = BOOT

    def stop(self):
        self.stops += 1

    def locate(self, **fields):
        fields = {"lat": 0.7, "lon": -0.15, "depth": 3.0, "timestamp": self.now} | fields
        self.autopilot.hear_state(imc.EstimatedState(**fields), self.now)

    def ask(self, name, **fields):
        """Send a message as a ground station; returns the answers."""
        definition = DIALECT.by_name[name]
        (message,), _ = split(encode(definition, definition.pack(fields), 0, 255, 190), DIALECT)
        self.said()
        if addressed(message, 26):
            self.session.hear(message, self.now)
            serve(self.session, message, self.now)
        return self.said()

    def command(self, number, *params, **more):
        named = dict(zip([f"param{i}" for i in range(1, 8)], params, strict=False))
        fields = {"target_system": 26, "target_component": 1, "command": number, **named, **more}
        answers = self.ask("COMMAND_LONG", **fields)
        (ack,) = [m for m in answers if m.name == "COMMAND_ACK"]
        assert (ack.values["command"], ack.values["target_system"], ack.values["target_component"]) == (
            number,
            255,
            190,
        )
        return ack.values["result"], [m for m in answers if m.name != "COMMAND_ACK"]

    def said(self):
        messages = [m for f in self.frames for m in split(f, DIALECT)[0]]
        self.frames.clear()
        return messages

    def run(self, seconds):
        """Pump for so long; returns the names of what went out."""
        end, names = self.now + seconds, []
        while True:
            due = self.session.pump(self.now)
            names += [m.name for m in self.said()]
            if due > end:
                self.now = end
                return names
            assert due > self.now or not names or len(names) < 10000
            self.now = due


@pytest.fixture
def desk():
    return Desk()


def texts(messages):
    return [m.values["text"].decode() for m in messages if m.name == "STATUSTEXT"]


def test_streams_keep_their_rates(desk):
    names = []
    for _ in range(10):
        desk.locate()
        names += desk.run(1.0)
    counts = {name: names.count(name) for name in names}
    assert abs(counts["HEARTBEAT"] - 10) <= 1
    assert abs(counts["ATTITUDE"] - 100) <= 2
    assert abs(counts["SYS_STATUS"] - 20) <= 1


def test_old_figures_are_not_repeated(desk):
    desk.locate()
    desk.run(5.0)
    assert "ATTITUDE" not in desk.run(2.0)
    assert desk.command(512, 30)[0] == REJECTED


def test_sequence_numbers_count_all_frames_of_the_session(desk):
    desk.locate()
    for _ in range(300):
        desk.session.send_now("ATTITUDE", desk.now)
    numbers = [frame[4] for frame in desk.frames]
    assert numbers == [i % 256 for i in range(numbers[0], numbers[0] + 300)]


@pytest.mark.parametrize("flavour", FLAVOURS)
def test_heartbeat(flavour):
    desk = Desk(flavour)
    desk.session.send_now("HEARTBEAT", desk.now)
    (beat,) = desk.said()
    assert (beat.system, beat.component) == (26, 1)
    assert beat.values["type"] == 12
    assert beat.values["autopilot"] == {"ardupilot": 3, "px4": 12, "generic": 0}[flavour]
    assert beat.values["custom_mode"] == (19 if flavour == "ardupilot" else 1 << 16)
    assert (beat.values["base_mode"], beat.values["system_status"], beat.values["mavlink_version"]) == (1, 3, 3)


def test_heartbeat_follows_the_vehicle(desk):
    desk.autopilot.hear_mode(MANEUVER)
    desk.autopilot.hear_mode(imc.PlanControlState(state=imc.PlanControlState.State.EXECUTING))
    desk.session.send_now("HEARTBEAT", desk.now)
    (beat,) = desk.said()
    assert beat.values["base_mode"] == 1 + 4 + 8 + 16 + 128
    assert beat.values["custom_mode"] == 4 << 16 | 4 << 24
    assert beat.values["system_status"] == 4


def test_every_command_is_acknowledged(desk):
    for number in [*range(0, 700), *range(700, 65536, 61), 42428, 65535]:
        for params in ((), (math.nan,) * 7, (math.inf, -math.inf, 1e30, -1e30, 0, 1, 2)):
            result, _ = desk.command(number, *params)
            assert result in (ACCEPTED, REJECTED, DENIED, UNSUPPORTED)
    assert desk.command(21196)[0] == UNSUPPORTED


@settings(max_examples=300, deadline=None)
@given(
    st.sampled_from([176, 262, 400, 410, 510, 511, 512, 520, 42428]),
    st.lists(st.floats(width=32), min_size=7, max_size=7),
    st.booleans(),
)
def test_no_parameters_of_a_command_raise(number, params, as_int):
    desk = Desk()
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


def test_request_message(desk):
    result, (version,) = desk.command(512, 148)
    assert (result, version.name) == (ACCEPTED, "AUTOPILOT_VERSION")
    assert version.values["capabilities"] & 16
    assert not version.values["capabilities"] & 131072
    assert version.values["uid"] == Desk().command(520)[1][0].values["uid"] != 0
    assert desk.command(512, 435) == (UNSUPPORTED, [])
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
    assert desk.autopilot.shown[1]
    assert desk.command(400, 0) == (ACCEPTED, [])
    assert not desk.autopilot.shown[1]
    assert desk.command(400, 2)[0] == desk.command(400, math.nan)[0] == DENIED


def test_arming_is_denied_with_the_reason_while_an_entity_is_not_well(desk):
    lamp = desk.vehicle.entities.find("Lamp")
    lamp.state, lamp.description, lamp.stateful = State.ERROR, "bulb broken", True
    result, rest = desk.command(400, 1)
    assert result == DENIED
    assert texts(rest) == ["Arming denied: Lamp is in ERROR: bulb broken"]
    assert desk.command(400, 1, 21196)[0] == ACCEPTED
    desk.session.send_now("HEARTBEAT", desk.now)
    assert desk.said()[0].values["system_status"] == 5


def test_arming_is_denied_in_error_mode(desk):
    desk.autopilot.hear_mode(imc.VehicleState(op_mode=imc.VehicleState.OpMode.ERROR, error_ents="DVL"))
    result, rest = desk.command(400, 1)
    assert (result, texts(rest)) == (DENIED, ["Arming denied: the vehicle is in ERROR: DVL"])


def test_disarming_in_a_maneuver_takes_force(desk):
    desk.autopilot.hear_mode(MANEUVER)
    assert desk.command(400, 0)[0] == DENIED
    assert desk.stops == 0
    assert desk.command(400, 0, 21196)[0] == ACCEPTED
    assert desk.stops == 1


@pytest.mark.parametrize(
    ("flavour", "kind", "params"),
    [
        ("px4", "submarine", (1, 4, 3)),
        ("generic", "boat", (1, 4, 3)),
        ("ardupilot", "submarine", (1, 16)),
        ("ardupilot", "submarine", (1, 2)),
        ("ardupilot", "copter", (1, 17)),
        ("ardupilot", "boat", (1, 4)),
    ],
)
def test_hold_is_never_denied(flavour, kind, params):
    desk = Desk(flavour, kind)
    assert desk.command(176, *params)[0] == ACCEPTED
    assert desk.autopilot.mode.name == "HOLD"
    assert desk.stops == 0
    desk.autopilot.hear_mode(MANEUVER)
    assert desk.autopilot.mode.name == "MISSION"
    assert desk.command(176, *params)[0] == ACCEPTED
    assert desk.stops == 1


def test_other_modes_are_denied_with_a_reason(desk):
    result, rest = desk.command(176, 1, 4, 4)
    assert result == DENIED
    assert "MISSION" in texts(rest)[0]
    assert desk.command(176, 1, 99, 99)[0] == desk.command(176, 0, 1)[0] == desk.command(262, 6)[0] == DENIED
    assert desk.command(262, 1)[0] == ACCEPTED
    assert desk.command(176, 1, 1)[0] == ACCEPTED
    assert desk.autopilot.mode.name == "MANUAL"


def test_set_mode_message(desk):
    assert desk.ask("SET_MODE", target_system=26, base_mode=1, custom_mode=4 << 16 | 3 << 24) == []
    assert desk.autopilot.mode.name == "HOLD"
    assert texts(desk.ask("SET_MODE", target_system=26, base_mode=1, custom_mode=77))


def test_ping_and_timesync(desk):
    (pong,) = desk.ask("PING", time_usec=12345, seq=6)
    assert (pong.values["time_usec"], pong.values["seq"], pong.values["target_system"]) == (12345, 6, 255)
    assert desk.ask("PING", time_usec=12345, seq=6, target_system=26, target_component=1) == []
    (sync,) = desk.ask("TIMESYNC", ts1=777)
    assert (sync.values["tc1"], sync.values["ts1"], sync.values["target_system"]) == (round(desk.now * 1e9), 777, 255)
    assert desk.ask("TIMESYNC", tc1=5, ts1=777) == []


@pytest.mark.parametrize("kind", [0, 1, 2])
def test_missions_are_answered(desk, kind):
    (count,) = desk.ask("MISSION_REQUEST_LIST", target_system=26, mission_type=kind)
    assert (count.values["count"], count.values["mission_type"], count.values["target_system"]) == (0, kind, 255)
    for name, answer in (("MISSION_CLEAR_ALL", 0), ("MISSION_REQUEST_INT", 13), ("MISSION_REQUEST", 13)):
        (ack,) = desk.ask(name, target_system=26, mission_type=kind)
        assert (ack.name, ack.values["type"], ack.values["mission_type"]) == ("MISSION_ACK", answer, kind)
    assert desk.ask("MISSION_COUNT", target_system=26, mission_type=kind)[0].values["type"] == 0
    refused = desk.ask("MISSION_COUNT", target_system=26, count=3, mission_type=kind)
    assert refused[0].values["type"] == 3
    assert desk.ask("MISSION_ACK", target_system=26) == []


def test_file_transfer_is_refused_at_once(desk):
    name = b"@PARAM/param.pck?withdefaults=1"
    request = struct.pack("<HBBBBBxI", 9, 2, 4, len(name), 0, 0, 0) + name
    (reply,) = desk.ask("FILE_TRANSFER_PROTOCOL", target_system=26, payload=tuple(request))
    payload = bytes(reply.values["payload"])
    sequence, session, opcode, size, asked, _, _ = struct.unpack_from("<HBBBBBxI", payload)
    assert (sequence, session, opcode, size, asked, payload[12]) == (10, 2, 129, 1, 4, 10)
    (reset,) = desk.ask("FILE_TRANSFER_PROTOCOL", target_system=26, payload=tuple(struct.pack("<HBB", 65535, 0, 2)))
    assert bytes(reset.values["payload"])[:4] == bytes((0, 0, 0, 128))


def test_what_qgroundcontrol_really_says():
    """Its connection to an ArduSub, from a log of the project ardusub_log_tools."""
    desk = Desk("ardupilot", system=1)
    found, damages = split((DATA / "qgroundcontrol.bin").read_bytes(), DIALECT)
    assert (len(found), damages) == (132, 0)
    for message in found:
        if addressed(message, 1):
            desk.session.hear(message, desk.now)
            serve(desk.session, message, desk.now)
    answers = desk.said()
    results = [(m.values["command"], m.values["result"]) for m in answers if m.name == "COMMAND_ACK"]
    assert results == [(512, ACCEPTED), (512, ACCEPTED), (512, UNSUPPORTED)]
    assert [m.name for m in answers if m.name != "COMMAND_ACK"] == ["AUTOPILOT_VERSION"] * 2 + ["MISSION_COUNT"] * 2
    assert desk.run(1.0).count("PARAM_VALUE") == len(desk.autopilot.parameters)


def test_banner_names_the_firmware():
    result, (banner,) = Desk("ardupilot").command(42428)
    assert result == ACCEPTED
    assert banner.values["text"].startswith(b"ArduSub V4.")


def read(desk, name):
    (value,) = desk.ask("PARAM_REQUEST_READ", target_system=26, param_id=name, param_index=-1)
    return value


@pytest.mark.parametrize(("flavour", "layout"), [("px4", "<i"), ("ardupilot", "<f")])
def test_parameters_are_read_in_the_encoding_of_the_flavour(flavour, layout):
    desk = Desk(flavour)
    value = read(desk, b"LAMP_BLINKS")
    assert struct.unpack(layout, value.payload[:4]) == (3,)
    assert value.values["param_type"] == 6
    assert read(desk, b"LAMP_POWER").values["param_value"] == 0.5
    index = value.values["param_index"]
    (same,) = desk.ask("PARAM_REQUEST_READ", target_system=26, param_index=index)
    assert same.payload == value.payload


def test_unknown_parameters_are_an_error(desk):
    for fields in ({"param_id": b"NOTHING", "param_index": -1}, {"param_index": 9999}):
        (error,) = desk.ask("PARAM_REQUEST_READ", target_system=26, **fields)
        assert (error.name, error.values["error"]) == ("PARAM_ERROR", 1)
    (error,) = desk.ask("PARAM_SET", target_system=26, param_id=b"NOTHING")
    assert (error.name, error.values["error"]) == ("PARAM_ERROR", 1)


def test_parameter_list_is_complete_paced_and_restartable(desk):
    desk.ask("PARAM_REQUEST_LIST", target_system=26)
    assert desk.run(0.0).count("PARAM_VALUE") == 5
    desk.ask("PARAM_REQUEST_LIST", target_system=26)
    seen = []
    for _ in range(200):
        desk.session.pump(desk.now)
        seen += [m.values for m in desk.said() if m.name == "PARAM_VALUE"]
        desk.now += 0.02
    assert [v["param_index"] for v in seen] == list(range(len(desk.autopilot.parameters)))
    assert {v["param_count"] for v in seen} == {len(seen)}


def test_setting_a_parameter_asks_the_vehicle(desk):
    assert desk.ask("PARAM_SET", target_system=26, param_id=b"LAMP_POWER", param_value=0.1, param_type=9) == []
    assert desk.wishes == [("LAMP_POWER", "0.1")]


def test_refused_parameter_is_shown_as_it_is(desk):
    error, value, *rest = desk.ask("PARAM_SET", target_system=26, param_id=b"LAMP_POWER", param_value=11, param_type=9)
    assert (error.name, error.values["error"]) == ("PARAM_ERROR", 2)
    assert (value.name, value.values["param_value"]) == ("PARAM_VALUE", 0.5)
    assert "".join(texts(rest)).startswith("Lamp, Power: 11 is above the maximum")
    assert desk.wishes == []


def test_texts_wait_for_the_station_and_are_few(desk):
    desk.autopilot.remember(4, "leak")
    desk.session.say(4, "leak", desk.now)
    assert desk.said() == []
    assert texts(desk.ask("HEARTBEAT", type=6)) == ["leak"]
    assert texts(desk.ask("HEARTBEAT", type=6)) == []
    for i in range(100):
        desk.session.say(4, f"text {i}", desk.now)
        desk.session.say(4, f"text {i}", desk.now)
    assert texts(desk.said()) == [f"text {i}" for i in range(15)]
    desk.now += 1.0
    for i in range(100):
        desk.session.say(4, f"more {i}", desk.now)
    assert len(texts(desk.said())) == 5


@given(st.text(max_size=300))
def test_chunks_join_to_the_text(words):
    parts = chunks(6, words, 7)
    joined = "".join(part["text"].decode() for part in parts).replace(" ", "")
    plain = words.replace("\0", "").replace(" ", "").encode(errors="replace").decode()
    assert plain.startswith(joined)
    assert joined == plain or len(words.encode(errors="replace")) > 200
    assert all(len(part["text"]) == 50 for part in parts[:-1])
    if len(parts) > 1:
        assert len(parts[-1]["text"]) < 50
        assert [part["chunk_seq"] for part in parts] == list(range(len(parts)))
        assert {part["id"] for part in parts} == {7}


@settings(max_examples=200, deadline=None)
@given(st.sampled_from(sorted(DIALECT.by_name)), st.binary(max_size=255), st.sampled_from(sorted(FLAVOURS)))
def test_no_message_raises(name, payload, flavour):
    desk = DESKS[flavour]
    definition = DIALECT.by_name[name]
    found, _ = split(encode(definition, payload or b"\0", 0, 255, 190), DIALECT)
    for message in found:
        if addressed(message, 26):
            desk.session.hear(message, desk.now)
            serve(desk.session, message, desk.now)
    desk.said()


DESKS = {flavour: Desk(flavour) for flavour in FLAVOURS}
