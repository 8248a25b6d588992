"""The conversation with one ground station, without a socket."""

import json
import struct
from pathlib import Path

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

import imc
from mavlink import FLAVORS, chunks, encode, load_dialect, split
from mavlink.vehicle.session import is_addressed
from mavlink.vehicle.telemetry.streams import STREAMS

DIALECT = load_dialect()
DATA = Path(__file__).parents[2] / "data" / "mavlink"
ACCEPTED, REJECTED, DENIED, UNSUPPORTED = range(4)
RALLY = 2
MANEUVER = imc.VehicleState(op_mode=imc.VehicleState.OpMode.MANEUVER)


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
        desk.session.build_and_send("ATTITUDE", desk.now)
    numbers = [frame[4] for frame in desk.frames]
    assert numbers == [i % 256 for i in range(numbers[0], numbers[0] + 300)]


@pytest.mark.parametrize("flavor", FLAVORS)
def test_heartbeat(open_desk, flavor):
    desk = open_desk(flavor)
    desk.session.build_and_send("HEARTBEAT", desk.now)
    (beat,) = desk.said()
    assert (beat.system, beat.component) == (26, 1)
    assert beat.values["type"] == 12
    assert beat.values["autopilot"] == {"ardupilot": 3, "px4": 12, "generic": 0}[flavor]
    assert beat.values["custom_mode"] == (19 if flavor == "ardupilot" else 1 << 16)
    assert (beat.values["base_mode"], beat.values["system_status"], beat.values["mavlink_version"]) == (1, 3, 3)


def test_heartbeat_follows_the_vehicle(desk):
    desk.endpoint.update_state(MANEUVER, "", desk.now)
    desk.endpoint.update_state(imc.PlanControlState(state=imc.PlanControlState.State.EXECUTING), "", desk.now)
    desk.session.build_and_send("HEARTBEAT", desk.now)
    (beat,) = desk.said()
    assert beat.values["base_mode"] == 1 + 4 + 8 + 16 + 128
    assert beat.values["custom_mode"] == 4 << 16 | 4 << 24
    assert beat.values["system_status"] == 4


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
    (answer,) = desk.ask("MISSION_COUNT", target_system=26, count=3, mission_type=kind)
    assert answer.name == ("MISSION_ACK" if kind == RALLY else "MISSION_REQUEST_INT")
    assert desk.ask("MISSION_ACK", target_system=26) == []


def transfer(desk, opcode, data=b"", offset=0):
    """Answers to a request for files: opcodes and data."""
    request = struct.pack("<HBBBBBxI", 9, 2, opcode, len(data), 0, 0, offset) + data
    said = desk.ask("FILE_TRANSFER_PROTOCOL", target_system=26, payload=tuple(request))
    payloads = [bytes(m.values["payload"]) for m in said if m.name == "FILE_TRANSFER_PROTOCOL"]
    return [(payload[3], payload[12 : 12 + payload[4]]) for payload in payloads]


def test_files_are_served_to_who_asks(desk):
    ((kind, listed),) = transfer(desk, 3, b"/")
    assert (kind, listed.split(b"\t")[0]) == (128, b"Fgeneral.json")
    ((kind, size),) = transfer(desk, 4, b"/general.json")
    ((_, text),) = transfer(desk, 5)
    assert (kind, int.from_bytes(size, "little")) == (128, len(text))
    assert json.loads(text)["vendorName"] == "Shoal"
    assert transfer(desk, 4, b"/../etc/passwd") == transfer(desk, 4, b"/nothing") == [(129, b"\n")]
    transfer(desk, 4, b"/parameters.json")
    assert transfer(desk, 15) == []
    names = desk.run(1.0)
    assert names.count("FILE_TRANSFER_PROTOCOL") > 2
    assert names.count("SYS_STATUS") >= 2, "telemetry goes on"
    ((kind, _),) = transfer(desk, 2)
    assert kind == 128


def test_metadata_are_where_component_metadata_says(desk):
    (about,) = desk.command(512, 397)[1]
    assert about.values["uri"] == b"mftp:///general.json"
    ((kind, crc),) = transfer(desk, 14, b"/general.json") or [(0, b"")]
    assert (kind, int.from_bytes(crc, "little")) == (128, about.values["file_crc"])


def test_logs_are_listed_and_not_erased(desk):
    (entry,) = desk.ask("LOG_REQUEST_LIST", target_system=26, end=0xFFFF) or desk.listen(0.2, "LOG_ENTRY")
    assert (entry.name, entry.values["num_logs"]) == ("LOG_ENTRY", 0)
    assert texts(desk.ask("LOG_ERASE", target_system=26)) == ["Logs are not erased by ground stations"]


def test_what_qgroundcontrol_really_says(open_desk):
    """Its connection to an ArduSub, from a log of the project ardusub_log_tools."""
    desk = open_desk("ardupilot", system=1)
    found, damages = split((DATA / "qgroundcontrol.bin").read_bytes(), DIALECT)
    assert (len(found), damages) == (132, 0)
    for message in found:
        if is_addressed(message, 1):
            desk.session.note_contact(desk.now)
            desk.endpoint.dispatch(desk.session, message, desk.now)
    answers = desk.said()
    results = [(m.values["command"], m.values["result"]) for m in answers if m.name == "COMMAND_ACK"]
    assert results == [(512, ACCEPTED), (512, ACCEPTED), (512, UNSUPPORTED)]
    assert [m.name for m in answers if m.name != "COMMAND_ACK"] == ["AUTOPILOT_VERSION"] * 2 + ["MISSION_COUNT"] * 2
    assert desk.run(1.0).count("PARAM_VALUE") == len(desk.endpoint.parameters)


def test_banner_names_the_firmware(open_desk):
    result, (banner,) = open_desk("ardupilot").command(42428)
    assert result == ACCEPTED
    assert banner.values["text"].startswith(b"ArduSub V4.")


def read(desk, name):
    (value,) = desk.ask("PARAM_REQUEST_READ", target_system=26, param_id=name, param_index=-1)
    return value


@pytest.mark.parametrize(("flavor", "layout"), [("px4", "<i"), ("ardupilot", "<f")])
def test_parameters_are_read_in_the_encoding_of_the_flavor(open_desk, flavor, layout):
    desk = open_desk(flavor)
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
        desk.endpoint.poll(desk.now)
        seen += [m.values for m in desk.said() if m.name == "PARAM_VALUE"]
        desk.now += 0.02
    assert [v["param_index"] for v in seen] == list(range(len(desk.endpoint.parameters)))
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
    desk.endpoint.model.notices.append((4, "leak"))
    desk.session.send_statustext(4, "leak", desk.now)
    assert desk.said() == []
    assert texts(desk.ask("HEARTBEAT", type=6)) == ["leak"]
    assert texts(desk.ask("HEARTBEAT", type=6)) == []
    for i in range(100):
        desk.session.send_statustext(4, f"text {i}", desk.now)
        desk.session.send_statustext(4, f"text {i}", desk.now)
    assert texts(desk.said()) == [f"text {i}" for i in range(15)]
    desk.now += 1.0
    for i in range(100):
        desk.session.send_statustext(4, f"more {i}", desk.now)
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


@settings(max_examples=200)
@given(st.sampled_from(sorted(DIALECT.by_name)), st.binary(max_size=255), st.sampled_from(sorted(FLAVORS)))
def test_no_message_raises(open_desk, name, payload, flavor):
    desk = open_desk(flavor)
    definition = DIALECT.by_name[name]
    found, _ = split(encode(definition, payload or b"\0", 0, 255, 190), DIALECT)
    for message in found:
        if is_addressed(message, 26):
            desk.session.note_contact(desk.now)
            desk.endpoint.dispatch(desk.session, message, desk.now)
    desk.said()


def test_home_is_not_where_a_vehicle_is_that_does_not_know_its_position_yet(desk):
    desk.locate(lat=0.0, lon=0.0)
    desk.locate(lat=0.7, lon=-0.15, x=100.0)
    desk.locate(lat=0.71, lon=-0.15, x=50.0)
    home = desk.endpoint.model.home
    assert (home.lat, home.lon) == (0.7, -0.15)
    (local,) = STREAMS["LOCAL_POSITION_NED"].build_message_fields(
        desk.endpoint.telemetry.sources, desk.session.flavor, desk.now
    )
    assert abs(local["x"]) < 100_000.0
