"""Streams with damage: stored cases with their ideal result, and the losses that the parser reports."""

import gzip
import json
from pathlib import Path
from typing import Any, Literal

import pytest

import imc

DATA = Path(__file__).parents[1] / "data" / "imc"
with gzip.open(DATA / "streams.jsonl.gz", "rt", encoding="utf-8") as file:
    CASES: list[dict[str, Any]] = [json.loads(line) for line in file]

BEAT = imc.encode(imc.Heartbeat(timestamp=1.0, src=1, src_ent=2))


@pytest.mark.parametrize("step", [1, 5, 1000])
@pytest.mark.parametrize("case", CASES, ids=lambda case: case["case"])
def test_stored_case(case: dict[str, Any], step: int) -> None:
    stream = bytes.fromhex(case["hex"])
    parser, messages = imc.StreamParser(), imc.StreamParser()
    packets: list[bytes] = []
    read: list[imc.Message] = []
    for start in range(0, len(stream), step):
        packets += parser.feed_packets(stream[start : start + step])
        read += messages.feed(stream[start : start + step])
    packets += parser.close_packets()
    read += messages.close()
    assert packets == [stream[offset : offset + length] for offset, _, length in case["ideal"]]
    ids = [message.id if isinstance(message, imc.Unknown) else message.ID for message in read]
    assert ids == [number for _, number, _ in case["ideal"]]
    assert parser.lost == len(stream) - sum(map(len, packets))


def test_losses_say_where_and_why() -> None:
    parser = imc.StreamParser()
    damaged = BEAT[:-1] + bytes([BEAT[-1] ^ 1])
    assert len(parser.feed(b"abc" + BEAT + damaged + b"xy" + BEAT)) == 2
    assert list(parser.losses) == [(0, 3, "no synchronization number"), (25, 24, "wrong CRC")]
    parser.feed(BEAT[:10])
    assert parser.close() == []
    assert parser.losses[-1] == (71, 10, "truncated")
    assert parser.lost == 37
    assert parser.feed(BEAT) == [imc.decode(BEAT)]


def test_packet_that_cannot_be_decoded_is_a_loss_of_its_own() -> None:
    short = imc.encode(imc.Unknown(id=imc.EstimatedState.ID, payload=b"too short"))
    parser = imc.StreamParser()
    assert len(parser.feed(BEAT + short + short + BEAT)) == 2
    reason = "EstimatedState: payload of 9 bytes is too short"
    assert list(parser.losses) == [(22, 31, reason), (53, 31, reason)]


@pytest.mark.parametrize("claim", [200, 2000, 60000])
@pytest.mark.parametrize("order", ["little", "big"])
def test_a_damaged_length_hides_no_packet_for_long(claim: int, order: Literal["little", "big"]) -> None:
    parser = imc.StreamParser()
    damaged = bytearray(imc.encode(imc.Heartbeat(timestamp=1.0, src=1), order))
    damaged[4:6] = claim.to_bytes(2, order)
    large = imc.encode(imc.DevDataText(value="x" * 100))
    assert parser.feed_packets(bytes(damaged) + BEAT[:5]) == []
    assert parser.resync_packets() == []
    assert parser.incomplete_offset == 0
    assert parser.feed_packets(BEAT[5:] + b"T" + BEAT + large[:60]) == []
    assert parser.resync_packets() == [BEAT, BEAT]
    assert parser.feed_packets(large[60:]) == [large], "it had only begun"
    assert parser.lost == len(damaged) + 1
    assert parser.incomplete_offset is None


def test_a_large_packet_on_a_slow_link_is_waited_for() -> None:
    parser = imc.StreamParser()
    large = imc.encode(imc.DevDataText(value="T\xfe" * 2000))
    found = []
    for start in range(0, len(large), 100):
        found += parser.feed_packets(large[start : start + 100]) + parser.resync_packets()
    assert found == [large]
    assert parser.lost == 0


@pytest.mark.heavy
def test_memory_is_bounded() -> None:
    parser = imc.StreamParser()
    for _ in range(200):
        parser.feed(b"\x54\xfe\x01\x00\xe9\xff" * 1000)
    assert len(parser._waiting) < 65536 + 6000
    parser.close()
    for _ in range(1500):
        parser.feed(BEAT + b"?")
    assert len(parser.losses) == 1000


@pytest.mark.heavy
def test_garbage_of_synchronization_numbers_ends() -> None:
    parser = imc.StreamParser()
    stream = b"\x54\xfe" * 100_000 + BEAT
    found = parser.feed(stream) + parser.close()
    assert found == [imc.decode(BEAT)]
    assert parser.lost == 200_000


def test_parser_of_another_schema() -> None:
    schema = imc.load(Path(imc.__file__).parent / "definitions" / "imc-5.4.31.yaml")
    message = schema["GpioStateGet"](name="led")
    parser = imc.StreamParser(schema.codec)
    assert parser.feed(schema.encode(message)) == [message]


def test_datagram() -> None:
    assert imc.decode_datagram(BEAT + b"surplus") == imc.decode(BEAT)
    assert imc.datagram_packet(BEAT + b"surplus") == BEAT
    for wrong in (b"", BEAT[:-1], b"x" + BEAT):
        with pytest.raises(imc.DecodeError):
            imc.decode_datagram(wrong)
        with pytest.raises(imc.DecodeError):
            imc.datagram_packet(wrong)
