"""Packets of every message: encoding and decoding, the header, and values that do not fit."""

import math
from typing import Any, Literal

import msgspec
import pytest
from fastcrc.crc16 import arc

import imc
from imc.codec import Codec
from imc.codec_compiler import DEEPEST
from imc.messages import BY_ID


def test_default_message_returns() -> None:
    for cls in BY_ID.values():
        message = cls(timestamp=1.5, src=1, src_ent=2, dst=3, dst_ent=4)
        assert imc.decode(imc.encode(message)) == message
        assert imc.decode(imc.encode(message, "big")) == message


def test_encode_as_writes_another_header() -> None:
    message = imc.EntityState(state=imc.EntityState.State.NORMAL, description="fine")
    packet = imc.encode_with_header(message, 2.5, 30, 7, 31, 8)
    assert imc.decode(packet) == message.replace(timestamp=2.5, src=30, src_ent=7, dst=31, dst_ent=8)
    assert imc.header(packet) == (1, len(packet) - 22, 2.5, 30, 7, 31, 8)
    back = imc.with_header(packet, timestamp=-1.0, src=0xFFFF, src_ent=0xFF, dst=0xFFFF, dst_ent=0xFF)
    assert back == imc.encode(message)


def test_overlay_replaces_the_message_with_id_2001() -> None:
    packet = imc.encode(imc.EstimatedMugState(id=-1, x=1.5, y=-2.0))
    assert imc.header(packet)[:2] == (2001, 12)
    assert not hasattr(imc, "GpioStateGet")
    assert len(BY_ID) == 350


def test_messages_are_immutable_values() -> None:
    state = imc.EstimatedState(lat=0.7)
    with pytest.raises(AttributeError):
        state.lat = 0.8
    assert state == imc.EstimatedState(lat=0.7)
    assert hash(state) == hash(imc.EstimatedState(lat=0.7))
    assert state != imc.EstimatedState(lat=0.7, src=1)
    assert repr(state) == "EstimatedState(lat=0.7)"
    with pytest.raises(TypeError):
        imc.EstimatedState(latitude=0.7)


def test_lists_become_tuples() -> None:
    plan = imc.PlanSpecification(maneuvers=[imc.PlanManeuver(data=imc.Goto(speed=1.5)), None])
    assert isinstance(plan.maneuvers, tuple)
    assert imc.decode(imc.encode(plan)) == plan
    assert plan.replace(maneuvers=[]).maneuvers == ()


@pytest.mark.parametrize("order", ["little", "big"])
def test_unknown_id_is_kept(order: Any) -> None:
    packet = imc.encode(imc.Unknown(id=64000, payload=b"abc", src=30, byteorder=order))
    message = imc.decode(packet)
    assert isinstance(message, imc.Unknown)
    assert (message.id, message.payload, message.src) == (64000, b"abc", 30)
    assert imc.encode(message) == packet
    assert imc.with_header(packet, src=31) == imc.encode_with_header(message, -1.0, 31, 0xFF, 0xFFFF, 0xFF)


@pytest.mark.parametrize("kind", [bytes, bytearray, memoryview])
def test_any_bytes_can_be_decoded(kind: Any) -> None:
    for message in (imc.Heartbeat(src=1), imc.EntityState(description="a"), imc.DevDataBinary(value=b"abc")):
        for _ in range(2):
            assert imc.decode(kind(imc.encode(message))) == message


def test_changed_byte_is_refused() -> None:
    imc.decode(imc.encode(imc.Heartbeat()))
    packet = bytearray(imc.encode(imc.Heartbeat()))
    packet[7] ^= 1
    with pytest.raises(imc.DecodeError, match="wrong CRC") as caught:
        imc.decode(bytes(packet))
    assert caught.value.reason == "wrong CRC"


@pytest.mark.parametrize(
    ("message", "text"),
    [
        (imc.EntityState(state=300), "EntityState.state: 300 is not within 0 to 255 (uint8_t)"),
        (imc.EntityState(state=1.5), "EntityState.state: 1.5 is not within 0 to 255 (uint8_t)"),
        (imc.EntityState(description=b"x"), "EntityState.description: b'x' is not text"),
        (imc.EntityState(description="\ud800"), "EntityState.description: '\\ud800' is not text"),
        (imc.EntityState(description="a" * 65536), "65535 bytes at most"),
        (imc.EntityState(description="a" * 65510), "EntityState: packet of 65536 bytes, 65535 at most"),
        (imc.DevDataBinary(value="text"), "DevDataBinary.value: 'text' is not bytes"),
        (imc.Temperature(value=1e39), "Temperature.value: 1e+39 is not within the range of fp32_t"),
        (imc.Temperature(value="warm"), "Temperature.value: 'warm' is not a number"),
        (imc.RamUsage(src=70000), "RamUsage.src: 70000 is not within 0 to 65535 (uint16_t)"),
        (imc.PlanDB(arg="plan"), "PlanDB.arg: 'plan' is not a message or None"),
        (imc.PlanDB(arg=imc.Unknown(id=3)), "cannot be put inside another"),
        (imc.MsgList(msgs=[imc.EntityState(flags=-1)]), "MsgList.msgs[0].flags: -1 is not within 0 to 255"),
        (imc.MsgList(msgs=[None] * 65536), "MsgList.msgs: "),
        (imc.PlanDB(arg=imc.PlanManeuver(data=imc.Goto(lat=None))), "PlanDB.arg.data.lat: None is not a number"),
    ],
)
def test_what_does_not_fit_is_named(message: imc.Message, text: str) -> None:
    for order in ("little", "big"):
        with pytest.raises(imc.EncodeError) as caught:
            imc.encode(message, order)
        assert text in str(caught.value)


@pytest.mark.parametrize(
    ("message", "end"),
    [
        (imc.LogBookEntry(text="x" * 70000), "is not 65535 bytes at most (plaintext)"),
        (
            imc.MsgList(msgs=[imc.PlanSpecification(plan_id="p" * 999)] * 65536),
            "is not at most 65535 messages or None",
        ),
        (imc.Temperature(value=imc.MsgList(msgs=[imc.Goto()] * 1000)), "is not a number (fp32_t)"),
        (imc.DevDataBinary(value=b"\0" * 70000), "is not bytes, 65535 at most (rawdata)"),
    ],
)
def test_the_error_names_what_does_not_fit_without_all_its_content(message: imc.Message, end: str) -> None:
    with pytest.raises(imc.EncodeError) as caught:
        imc.encode(message)
    assert str(caught.value).startswith(f"{type(message).__name__}.")
    assert str(caught.value).endswith(end)
    assert len(str(caught.value)) < 500


def test_byte_order_has_two_values() -> None:
    wrong: Any = "middle"
    with pytest.raises(imc.EncodeError, match="byteorder 'middle'"):
        imc.encode(imc.Heartbeat(), wrong)


@pytest.mark.parametrize("order", ["little", "big"])
def test_id_and_source_are_read_without_decoding(order: Literal["little", "big"]) -> None:
    packet = imc.encode(imc.Heartbeat(src=0x1234, dst=0x5678), order)
    assert (imc.packet_id(packet), imc.packet_source(packet)) == (imc.Heartbeat.ID, 0x1234)


def test_header_that_does_not_fit_is_named() -> None:
    with pytest.raises(imc.EncodeError, match=r"Heartbeat.src_ent: 256 is not within 0 to 255"):
        imc.encode_with_header(imc.Heartbeat(), 1.0, 1, 256, 1, 1)
    with pytest.raises(imc.EncodeError):
        imc.with_header(imc.encode(imc.Heartbeat()), src=-1)


def test_largest_packet() -> None:
    packet = imc.encode(imc.EntityState(description="a" * 65509))
    assert len(packet) == 65535
    assert imc.encode(imc.decode(packet)) == packet


def test_special_numbers() -> None:
    for value in (math.inf, -math.inf, -0.0, 5e-324):
        message = imc.decode(imc.encode(imc.RamUsage()))
        assert isinstance(message, imc.RamUsage)
        returned = imc.decode(imc.encode(message.replace(value=value)))
        assert isinstance(returned, imc.RamUsage)
        assert math.copysign(1.0, returned.value) == math.copysign(1.0, value)
        assert returned.value == value


def nested(depth: int) -> imc.Message:
    message: imc.Message = imc.Heartbeat()
    for _ in range(depth):
        message = imc.MsgList(msgs=(message,))
    return message


def test_nesting_has_an_end() -> None:
    packet = imc.encode(nested(DEEPEST))
    assert imc.encode(imc.decode(packet)) == packet
    with pytest.raises(imc.DecodeError, match="nested deeper"):
        imc.decode(imc.encode(nested(DEEPEST + 1)))
    with pytest.raises(imc.EncodeError, match="nested too deeply"):
        imc.encode(nested(5000))


def test_shared_names_do_not_collide() -> None:
    assert len(set(imc.__all__)) == len(imc.__all__)
    assert all(hasattr(imc, name) for name in imc.__all__)
    for cls in BY_ID.values():
        assert issubclass(cls, msgspec.Struct)
        assert getattr(imc, cls.__name__) is cls


@pytest.mark.parametrize("byteorder", ["little", "big"])
@pytest.mark.parametrize("message", [imc.Depth(value=2.0, src=7), imc.LogBookEntry(text="here", src=7)])
def test_a_datagram_gives_its_first_message_and_that_packet_alone(message: imc.Message, byteorder: Any) -> None:
    packet, codec = imc.encode(message, byteorder), imc.builtin().codec
    for rest in (b"", b"more", packet):
        assert codec.decode_first(packet + rest) == (message, packet)
    for damaged in (packet[:-1], packet[:-1] + b"\0\0", b""):
        with pytest.raises(imc.DecodeError):
            codec.decode_first(damaged)


def outcome(codec: Codec, data: bytes) -> object:
    try:
        return codec.decode_first(data)
    except imc.DecodeError as error:
        return str(error)


@pytest.mark.parametrize(
    "message",
    [
        imc.LogBookEntry(htime=1.0, text="hier: ä", src=7),
        imc.PlanSpecification(plan_id="a", maneuvers=(imc.PlanManeuver(data=imc.Goto(speed=1.5)),)),
        imc.MessagePart(data=b"abc"),
    ],
)
def test_a_codec_that_has_read_a_message_judges_the_next_packets_like_one_that_has_not(message: imc.Message) -> None:
    packet, used = imc.encode(message), Codec(BY_ID.__getitem__, imc.Message.SYNC)
    assert used.decode_first(packet)[0] == message
    longer = imc.encode(message.replace(surplus=b"more"))
    wrong = [bytes([*packet[:at], packet[at] ^ 1 << at % 8, *packet[at + 1 :]]) for at in range(len(packet))]
    with_good_crc = [data[:-2] + arc(data[:-2]).to_bytes(2, "little") for data in wrong]
    for data in (*wrong, *with_good_crc, packet[:-1], packet + b"more", longer, imc.encode(message, "big"), packet):
        fresh = outcome(Codec(BY_ID.__getitem__, imc.Message.SYNC), data)
        assert outcome(used, data) == fresh
        assert not isinstance(fresh, tuple) or used.decode(data) == fresh[0]
