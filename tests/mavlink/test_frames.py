"""Framing: frames compared with pymavlink's, and other contents of a datagram."""

import itertools
import math
import struct

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from pymavlink.dialects.v20 import ardupilotmega as upstream

from mavlink import StreamSplitter, encode, load_dialect, split
from mavlink.extra_messages import MESSAGES, ExtraMessage

DIALECT = load_dialect()


def frame(name, sequence=0, system=26, component=1, **fields):
    definition = DIALECT.by_name[name]
    return encode(definition, definition.pack(fields), sequence, system, component)


def pymavlink_frame(message, *, v1=False, sequence=7):
    mav = upstream.MAVLink(None, srcSystem=255, srcComponent=190)
    mav.seq = sequence
    return message.pack(mav, force_mavlink1=v1)


ATTITUDE = upstream.MAVLink_attitude_message(1, 0.1, 0.2, 0.3, 0.4, 0.5, 0.6)
PING = upstream.MAVLink_ping_message(5, 6, 0, 0)


def test_frame_is_the_one_that_pymavlink_makes():
    mav = upstream.MAVLink(None, srcSystem=26, srcComponent=1)
    mav.seq = 200
    expected = upstream.MAVLink_heartbeat_message(12, 3, 209, 19, 4, 3).pack(mav)
    fields = dict(type=12, autopilot=3, base_mode=209, custom_mode=19, system_status=4, mavlink_version=3)
    assert frame("HEARTBEAT", 200, **fields) == expected


def test_every_message_packs_and_is_read_by_pymavlink():
    names = sorted(set(DIALECT.by_name) - {message.name for message in MESSAGES})
    assert [upstream.MAVLink(None).parse_char(bytearray(frame(name))).get_type() for name in names] == names


@pytest.mark.parametrize("name", ["HEARTBEAT", "PARAM_VALUE", "GPS_STATUS", "MISSION_REQUEST_LIST", "COMMAND_LONG"])
def test_checksums_of_own_definitions_follow_the_rule_of_upstream(name):
    """The extra checksum covers no extension fields, so some of the last fields may be missing."""
    known = next(message for message in upstream.mavlink_map.values() if message.msgname == name)
    lengths = dict(zip(known.ordered_fieldnames, known.array_lengths, strict=True))
    declared = [
        f"{kind}[{lengths[field]}] {field}" if lengths[field] else f"{kind} {field}"
        for kind, field in zip(known.fieldtypes, known.fieldnames, strict=True)
    ]
    found = {ExtraMessage(0, name, tuple(declared[: n + 1])).crc_extra: n for n in range(len(declared))}
    assert known.crc_extra in found


@pytest.mark.parametrize(
    ("name", "crc_extra"),
    [
        ("COMMAND_CANCEL", 14),
        ("PROTOCOL_VERSION", 217),
        ("COMPONENT_METADATA", 182),
        ("AVAILABLE_MODES", 134),
        ("CURRENT_MODE", 193),
        ("AVAILABLE_MODES_MONITOR", 30),
    ],
)
def test_newer_messages_have_the_checksums_of_mavlinks_own_libraries(name, crc_extra):
    definition = DIALECT.by_name[name]
    assert definition.crc_extra == crc_extra
    (message,), damages = split(frame(name), DIALECT)
    assert (message.name, damages) == (name, 0)


def test_payload_keeps_its_first_byte():
    assert frame("SYSTEM_TIME")[1] == 1


def test_numbers_are_rounded_and_clamped():
    values = DIALECT.by_name["GLOBAL_POSITION_INT"]
    read = values.unpack(values.pack({"lat": 1e12, "lon": -1e12, "vx": 40000.4, "vy": -0.6, "hdg": -5}))
    assert (read["lat"], read["lon"], read["vx"], read["vy"], read["hdg"]) == (2**31 - 1, -(2**31), 32767, -1, 0)
    values = DIALECT.by_name["ATTITUDE"]
    read = values.unpack(values.pack({"roll": 1e300, "pitch": math.nan, "yaw": -math.inf}))
    assert math.isfinite(read["roll"])
    assert math.isnan(read["pitch"])
    assert read["yaw"] == -math.inf


def test_integer_field_refuses_what_is_not_finite():
    with pytest.raises(ValueError, match="nan"):
        DIALECT.by_name["GLOBAL_POSITION_INT"].pack({"lat": math.nan})


@pytest.mark.parametrize("v1", [False, True])
def test_both_versions_are_read(v1):
    (message,), damages = split(pymavlink_frame(ATTITUDE, v1=v1), DIALECT)
    assert (message.name, message.system, message.component, damages) == ("ATTITUDE", 255, 190, 0)
    assert message.values["yaw"] == pytest.approx(0.3)


def test_several_frames_in_a_datagram():
    found, damages = split(pymavlink_frame(ATTITUDE) + pymavlink_frame(PING, v1=True) + pymavlink_frame(PING), DIALECT)
    assert [m.name for m in found] == ["ATTITUDE", "PING", "PING"]
    assert damages == 0


def test_damage_does_not_hide_the_good_frame_behind_it():
    good = pymavlink_frame(PING)
    for rubbish in (b"\xfd\xff", b"\xfd\xff\x00\x00", b"\xfe", b"hello", pymavlink_frame(ATTITUDE)[:-3]):
        found, damages = split(rubbish + good + rubbish, DIALECT)
        assert [m.name for m in found] == ["PING"]
        assert damages == 2


def test_wrong_checksum_is_damage():
    broken = bytearray(pymavlink_frame(PING))
    broken[12] ^= 1
    assert split(bytes(broken), DIALECT) == ([], 1)


def test_unknown_flags_are_dropped_and_unknown_messages_passed_over():
    flagged = bytearray(pymavlink_frame(PING))
    flagged[2] = 0x04
    assert split(bytes(flagged), DIALECT)[0] == []
    unknown = bytes((0xFD, 3, 0, 0, 0, 1, 1, 0xFF, 0xFF, 0xFF, 1, 2, 3, 0xAA, 0xBB))
    found, damages = split(unknown + pymavlink_frame(PING), DIALECT)
    assert ([m.name for m in found], damages) == (["PING"], 0)


def test_signed_frame_is_read():
    mav = upstream.MAVLink(None, srcSystem=255, srcComponent=190)
    mav.signing.secret_key, mav.signing.sign_outgoing = b"k" * 32, True
    found, damages = split(PING.pack(mav) + pymavlink_frame(ATTITUDE), DIALECT)
    assert ([m.name for m in found], damages) == (["PING", "ATTITUDE"], 0)


def test_longer_payload_of_a_newer_dialect_is_read():
    definition = DIALECT.by_name["PING"]
    payload = definition.pack({"time_usec": 9, "target_component": 3}) + b"\x01\x02"
    (message,), _ = split(encode(definition, payload, 0, 1, 1), DIALECT)
    assert (message.values["time_usec"], message.values["target_component"]) == (9, 3)


def test_timesync_carries_its_target():
    (message,), _ = split(frame("TIMESYNC", tc1=1, ts1=2, target_system=255, target_component=190), DIALECT)
    assert (message.values["target_system"], message.values["target_component"]) == (255, 190)
    assert message.payload == struct.pack("<qqBB", 1, 2, 255, 190)


@settings(max_examples=200)
@given(
    st.lists(
        st.sampled_from([pymavlink_frame(PING), pymavlink_frame(ATTITUDE), pymavlink_frame(PING, v1=True), b"xy"])
    ),
    st.data(),
)
def test_a_stream_loses_no_good_frame_wherever_it_is_cut(parts, data):
    stream = b"".join(parts) + bytes(300)
    cuts = sorted(data.draw(st.lists(st.integers(0, len(stream)), max_size=12)))
    splitter, found, damages = StreamSplitter(DIALECT), [], 0
    for begin, end in itertools.pairwise([0, *cuts, len(stream)]):
        more, damaged = splitter.feed(stream[begin:end])
        found += more
        damages += damaged
    expected, stretches = split(stream, DIALECT)
    assert [(m.name, m.sequence, m.content) for m in found] == [(m.name, m.sequence, m.content) for m in expected]
    assert damages == stretches


def test_a_stream_waits_for_the_end_of_a_frame_and_gives_up_a_false_one():
    good = pymavlink_frame(PING)
    splitter = StreamSplitter(DIALECT)
    assert splitter.feed(b"\xfd\xff\x00\x00" + good) == ([], 0)
    found = [m.name for _ in range(20) for m in splitter.feed(good)[0]]
    assert len(found) == 21


def test_a_frame_whose_end_never_comes_is_given_up():
    good = pymavlink_frame(PING)
    splitter = StreamSplitter(DIALECT)
    assert splitter.feed(b"noise\xfd\xff\x00\x00" + good + good) == ([], 1)
    assert (splitter.passed, splitter.bytes_waiting) == (5, 4 + 2 * len(good))
    found, damages = splitter.take_remaining_messages()
    assert ([m.name for m in found], damages, splitter.bytes_waiting) == (["PING", "PING"], 0, 0)
    assert splitter.take_remaining_messages() == ([], 0)
    assert [m.name for m in splitter.feed(good)[0]] == ["PING"]


@settings(max_examples=200)
@given(st.lists(st.one_of(st.binary(max_size=80), st.sampled_from([pymavlink_frame(PING), pymavlink_frame(ATTITUDE)]))))
def test_no_datagram_raises(parts):
    found, damages = split(b"".join(parts), DIALECT)
    assert damages >= 0
    assert all(m.definition in DIALECT.by_id.values() for m in found)


@settings(max_examples=100)
@given(st.binary(max_size=60), st.data())
def test_altered_frames_never_raise(tail, data):
    good = bytearray(pymavlink_frame(ATTITUDE) + pymavlink_frame(PING))
    for place in data.draw(st.lists(st.integers(0, len(good) - 1), max_size=4)):
        good[place] = data.draw(st.integers(0, 255))
    split(bytes(good) + tail, DIALECT)


def test_thousands_of_magic_bytes_are_one_damage():
    assert split(bytes(itertools.islice(itertools.cycle((0xFD, 0xFE)), 8000)), DIALECT)[1] == 1
