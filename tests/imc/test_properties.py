"""Properties that hold for any message, any damage and any stream."""

import itertools
import math
import struct
from typing import Any

import pytest
from fastcrc.crc16 import arc
from hypothesis import given, settings
from hypothesis import strategies as st

import imc
from imc.messages import BY_ID

INTEGERS = {"b": (-128, 127), "B": (0, 255), "h": (-32768, 32767), "H": (0, 65535)} | {
    "i": (-(2**31), 2**31 - 1),
    "I": (0, 2**32 - 1),
}
BYTES = st.binary(max_size=40)
NUMBERS: dict[str, st.SearchStrategy[Any]] = {
    **{code: st.integers(*limits) for code, limits in INTEGERS.items()},
    "f": st.floats(width=32),
    "d": st.floats(),
    "T": BYTES.map(lambda data: data.decode("utf-8", "surrogateescape")),
    "R": BYTES,
}
HEADERS = st.fixed_dictionaries(
    {
        "timestamp": st.floats(allow_nan=False),
        "src": st.integers(0, 65535),
        "src_ent": st.integers(0, 255),
        "dst": st.integers(0, 65535),
        "dst_ent": st.integers(0, 255),
    }
)


@st.composite
def bodies(draw: st.DrawFn, depth: int = 2) -> imc.Message:
    """A message of any type with the default header."""
    cls = draw(st.sampled_from(list(BY_ID.values())))
    inner = st.none() if depth == 0 else st.none() | bodies(depth - 1)
    kinds = {**NUMBERS, "M": inner, "L": st.lists(inner, max_size=3).map(tuple)}
    names = [info.name for info in imc.fields(cls)]
    return cls(**{name: draw(kinds[code]) for name, code in zip(names, cls.WIRE, strict=True)})


MESSAGES = st.builds(lambda body, header: body.replace(**header), bodies(), HEADERS)
ORDERS = st.sampled_from(["little", "big"])
GARBAGE = st.binary(max_size=60) | st.lists(
    st.sampled_from([b"\x54", b"\xfe", b"\x54\xfe", b"\xfe\x54", b"\x54\xfe\x01\x00\x20\x00", b"\x00"]), max_size=20
).map(b"".join)


def same(first: imc.Message, second: imc.Message) -> bool:
    """Equality in which NaN equals NaN."""
    return type(first) is type(second) and first.to_json() == second.to_json()


@settings(max_examples=300)
@given(MESSAGES, ORDERS)
def test_message_returns(message: imc.Message, order: Any) -> None:
    packet = imc.encode(message, order)
    read = imc.decode(packet)
    assert same(read, message)
    assert imc.encode(read, order) == packet
    assert imc.header(packet) == (message.ID, len(packet) - 22, *packet_header(message))
    assert same(imc.from_json(message.to_json()), message)
    assert same(imc.from_dict(message.to_dict()), message)


def packet_header(message: imc.Message) -> tuple[Any, ...]:
    return message.timestamp, message.src, message.src_ent, message.dst, message.dst_ent


@settings(max_examples=100)
@given(MESSAGES, MESSAGES, ORDERS)
def test_other_header(message: imc.Message, other: imc.Message, order: Any) -> None:
    header = packet_header(other)
    names = ("timestamp", "src", "src_ent", "dst", "dst_ent")
    wanted = message.replace(**dict(zip(names, header, strict=True)))
    assert imc.encode_with_header(message, *header) == imc.encode(wanted)
    assert imc.with_header(imc.encode(message, order), **dict(zip(names, header, strict=True))) == imc.encode(
        wanted, order
    )


def passed(message: imc.Message) -> tuple[imc.Message, bytes, imc.Message]:
    """What receivers of a published message see, its packet, and what they see if nobody wants a packet."""
    codec, header = imc.builtin().codec, packet_header(message)
    seen, packet = codec.round_trip_function(type(message), encodes=True)(message, *header)
    return seen, packet, codec.round_trip_function(type(message), encodes=False)(message, *header)


@pytest.mark.heavy
@settings(max_examples=300)
@given(MESSAGES, st.floats(-1e30, 1e30), st.sampled_from([b"", b"more"]))
def test_messages_are_rounded_alike_with_and_without_a_packet(
    message: imc.Message, number: float, surplus: bytes
) -> None:
    names = [info.name for info, code in zip(imc.fields(type(message)), message.WIRE, strict=True) if code in "fd"]
    exact = message.replace(**dict.fromkeys(names, number), surplus=surplus)
    seen, packet, alone = passed(exact)
    assert packet == imc.encode(exact)
    assert same(seen, imc.decode(packet))
    assert same(alone, seen)


@pytest.mark.parametrize("cls", BY_ID.values(), ids=lambda cls: cls.__name__)
def test_each_class_is_rounded_alike_with_and_without_a_packet(cls: type[imc.Message]) -> None:
    inner = imc.Goto(lat=0.1, speed=0.1, custom="\xe4\udcff")
    values = {"f": 0.1, "d": 0.1, "T": "\udcc3\udca9", "R": b"\x00\xff", "M": inner, "L": [inner, None]}
    names = [info.name for info in imc.fields(cls)]
    seen, packet, alone = passed(cls(**{name: values.get(code, 1) for name, code in zip(names, cls.WIRE, strict=True)}))
    assert seen == alone == imc.decode(packet)
    assert [type(getattr(alone, name)) for name in names] == [type(getattr(seen, name)) for name in names]


@settings(max_examples=60)
@given(MESSAGES, ORDERS)
def test_every_truncation_is_refused(message: imc.Message, order: Any) -> None:
    packet = imc.encode(message, order)
    for length in range(len(packet)):
        with pytest.raises(imc.DecodeError):
            imc.decode(packet[:length])


@settings(max_examples=25)
@given(MESSAGES, ORDERS)
def test_every_flipped_bit_is_noticed(message: imc.Message, order: Any) -> None:
    packet = imc.encode(message, order)
    for bit in range(len(packet) * 8):
        damaged = bytearray(packet)
        damaged[bit // 8] ^= 1 << bit % 8
        with pytest.raises(imc.DecodeError):
            imc.decode(bytes(damaged))


@pytest.mark.heavy
@settings(max_examples=150)
@given(MESSAGES, st.data())
def test_damaged_payload_with_a_right_crc_never_crashes(message: imc.Message, data: st.DataObject) -> None:
    packet = bytearray(imc.encode(message)[:-2])
    for _ in range(data.draw(st.integers(1, 4))):
        packet[data.draw(st.integers(6, len(packet) - 1))] = data.draw(st.integers(0, 255))
    size = data.draw(st.integers(20, len(packet)))
    packet = packet[:size]
    packet[4:6] = struct.pack("<H", size - 20)
    whole = bytes(packet) + struct.pack("<H", arc(bytes(packet)))
    try:
        read = imc.decode(whole)
    except imc.DecodeError:
        return
    if not has_signalling_nan(whole):
        assert imc.encode(read) == whole


def has_signalling_nan(packet: bytes) -> bool:
    """Whether bytes at any place could be a signaling fp32 NaN: it becomes a quiet one in a Python float."""
    return any(packet[i] & 0x7F == 0x7F and packet[i - 1] & 0xC0 == 0x80 for i in range(1, len(packet)))


@pytest.mark.heavy
@settings(max_examples=120)
@given(st.lists(st.tuples(GARBAGE, MESSAGES, ORDERS), max_size=5), GARBAGE, st.data())
def test_stream_loses_nothing_good(parts: list[Any], end: bytes, data: st.DataObject) -> None:
    packets = [imc.encode(message, order) for _, message, order in parts]
    stream = b"".join(garbage + packet for (garbage, _, _), packet in zip(parts, packets, strict=True)) + end
    parser = imc.StreamParser()
    found: list[bytes] = []
    position = 0
    while position < len(stream):
        step = data.draw(st.integers(1, 1 + len(stream) // 3))
        found += parser.feed_packets(stream[position : position + step])
        position += step
    found += parser.close_packets()
    assert found == packets
    assert sum(map(len, found)) + parser.lost == len(stream)
    covered = sorted([(loss.offset, loss.length) for loss in parser.losses])
    assert sum(length for _, length in covered) == parser.lost
    assert all(a + n < b for (a, n), (b, _) in itertools.pairwise(covered))


@given(st.booleans(), st.integers(1, 0x7FFFFF))
def test_fp32_nan_keeps_sign_and_payload(negative: bool, payload: int) -> None:
    bits = negative << 31 | 0x7F800000 | payload
    body = imc.encode(imc.Temperature())[:20] + struct.pack("<I", bits)
    message = imc.decode(body + struct.pack("<H", arc(body)))
    assert isinstance(message, imc.Temperature)
    assert math.isnan(message.value)
    assert imc.encode(message)[20:24] == struct.pack("<I", bits | 0x400000)


@given(st.integers(0, 2**64 - 1))
def test_fp64_keeps_all_bits(bits: int) -> None:
    body = imc.encode(imc.RamUsage())[:20] + struct.pack("<Q", bits)
    packet = body + struct.pack("<H", arc(body))
    assert imc.encode(imc.decode(packet)) == packet
