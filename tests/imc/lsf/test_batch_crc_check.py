"""Garbage full of false packets: the result equals a byte-by-byte search, in linear time."""

from typing import Any

import numpy as np
import pytest
from fastcrc.crc16 import arc
from hypothesis import example, given, settings
from hypothesis import strategies as st

import imc
from imc.lsf import scanner as packet_scan
from imc.lsf.batch_crc_check import valid_crcs

SYNC = 0xFE54
PACKETS = [
    imc.encode(message, order)
    for message in (
        imc.Abort(),
        imc.Rpm(value=7),
        imc.LogBookEntry(text="\ufe54 T\u00fe" * 9),
        imc.SonarData(data=b"T\xfe" * 40),
    )
    for order in ("little", "big")
]
FRAGMENTS = st.one_of(
    st.sampled_from(PACKETS),
    st.sampled_from(
        [b"\x54\xfe", b"\xfe\x54", b"\x54", b"\xfe", b"\x54\xfe\x01\x00\x30\x00", b"\xfe\x54\x00\x01\x00\x07"]
    ),
    st.binary(max_size=40),
    st.sampled_from(PACKETS).map(lambda packet: packet[:-3]),
)
CONTENTS = st.lists(st.tuples(FRAGMENTS, st.integers(1, 5)), max_size=30).map(
    lambda parts: b"".join(fragment * times for fragment, times in parts)
)


def found(data: bytes, step: int) -> Any:
    """Packets and losses."""
    losses: list[tuple[int, int, str]] = []
    chunks = (data[begin : begin + step] for begin in range(0, len(data), step))
    batches = packet_scan.scan(chunks, SYNC, lambda *loss: losses.append(loss))
    return [packet for batch in batches for packet in batch.packets()], losses


def one_by_one(data: bytes) -> list[tuple[int, bytes]]:
    """Packets and losses of a byte-by-byte search."""
    packets, place = list[tuple[int, bytes]](), 0
    while place < len(data):
        order = {b"\x54\xfe": "little", b"\xfe\x54": "big"}.get(data[place : place + 2])
        end = place + 22 + int.from_bytes(data[place + 4 : place + 6], order) if order else len(data) + 1
        if order and end <= len(data) and arc(data[place : end - 2]) == int.from_bytes(data[end - 2 : end], order):
            packets.append((place, data[place:end]))
            place = end
        else:
            place += 1
    return packets


@pytest.mark.heavy
@settings(max_examples=80)
@given(CONTENTS, st.integers(1, 300))
@example(b"\x54\xfe" * 40_000 + PACKETS[1] + b"\xfe\x54" * 40_000 + PACKETS[0], 70_000)
def test_all_ways_find_the_same_packets(data: bytes, step: int) -> None:
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(packet_scan, "PIECE", step)
        usual = found(data, step)
        patch.setattr(packet_scan, "COST_OF_ONE", 1 << 40)
        together = found(data, step)
    assert together == usual
    assert together[0] == one_by_one(data)
    assert sum(len(packet) for _, packet in together[0]) + sum(length for _, length, _ in together[1]) == len(data)


@settings(max_examples=60)
@given(st.binary(min_size=22, max_size=300), st.data())
def test_parts_are_right_where_their_crc_is(data: bytes, draw: st.DataObject) -> None:
    size = st.integers(0, len(data) - 22)
    starts = draw.draw(st.lists(size, min_size=1, max_size=8))
    ends = [draw.draw(st.integers(start + 22, len(data))) for start in starts]
    big = draw.draw(st.lists(st.booleans(), min_size=len(starts), max_size=len(starts)))
    mended = bytearray(data)
    for start, end, swapped in zip(starts, ends, big, strict=True):
        mended[end - 2 : end] = arc(bytes(mended[start : end - 2])).to_bytes(2, "big" if swapped else "little")
    content = bytes(mended)
    expected = [
        arc(content[start : end - 2]) == int.from_bytes(content[end - 2 : end], "big" if swapped else "little")
        for start, end, swapped in zip(starts, ends, big, strict=True)
    ]
    arrays = np.array(starts), np.array(ends), np.array(big)
    assert valid_crcs(content, *arrays).tolist() == expected
    assert expected[-1]


def test_long_parts_reach_over_periods() -> None:
    data = bytearray(np.random.default_rng(1).bytes(200_000))
    starts, ends = np.array([5, 40_000, 100_001]), np.array([65_541, 100_000, 165_558])
    for start, end in zip(starts[1:], ends[1:], strict=True):
        data[end - 2 : end] = arc(bytes(data[start : end - 2])).to_bytes(2, "little")
    assert valid_crcs(bytes(data), starts, ends, np.zeros(3, np.bool_)).tolist() == [False, True, True]


def test_few_candidates_have_crcs_of_their_own(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(packet_scan, "valid_crcs", None)
    data = b"garbage".join(PACKETS * 50)
    assert len(found(data, 1 << 19)[0]) == len(PACKETS) * 50
    monkeypatch.undo()
    calls: list[int] = []
    monkeypatch.setattr(packet_scan, "arc", lambda packet: calls.append(len(packet)) or arc(packet))
    assert found(b"\x54\xfe" * 100_000, 1 << 19)[0] == []
    assert sum(calls) < 100 * 200_000
