"""Lines and frames come out the same however the bytes arrive, and memory is bounded."""

import struct

import pytest
from hypothesis import given
from hypothesis import strategies as st

from runtime.devices import FrameSplitter, LineSplitter, RawChunks, Splitter, line_size_function, parse_number

portions = st.lists(st.integers(0, 40), max_size=30)
noise = st.binary(max_size=60)


def fed(splitter: Splitter, data: bytes, cuts: list[int]) -> list[bytes]:
    """What comes out if the data arrive in portions of these sizes, and the rest at once."""
    found: list[bytes] = []
    for size in cuts:
        found += splitter.feed(data[:size])
        data = data[size:]
    return found + splitter.feed(data)


def size_of(head: bytes) -> int | None:
    """A frame: S, the length of the payload, the payload, the sum of it."""
    return head[1] + 3 if len(head) > 1 else None


def is_valid(frame: bytes) -> bool:
    return frame[:1] != b"S" or frame[-1] == sum(frame[2:-1]) & 0xFF


def frame_of(payload: bytes) -> bytes:
    return b"S" + bytes([len(payload)]) + payload + bytes([sum(payload) & 0xFF])


def frames() -> FrameSplitter:
    return FrameSplitter({b"S": size_of, b"$G": line_size_function(50)}, valid=is_valid, longest=300)


@given(st.lists(st.binary(max_size=50)), portions)
def test_lines_do_not_depend_on_portions(lines: list[bytes], cuts: list[int]) -> None:
    data = b"\r\n".join([*lines, b""])
    wanted = [line.strip() for line in data.split(b"\n")]
    assert fed(LineSplitter(), data, cuts) == [line for line in wanted if line]


@given(st.binary(max_size=400), portions, st.booleans())
def test_lines_are_bounded_and_every_byte_is_accounted_for(data: bytes, cuts: list[int], midway: bool) -> None:
    at_once, lines = LineSplitter(longest=20), LineSplitter(longest=20)
    for splitter in (at_once, lines):
        splitter.reset(midway=midway)
    found = fed(lines, data, cuts)
    assert found == at_once.feed(data)
    assert (lines.skipped_bytes, lines.damaged, lines.unfinished_bytes) == (
        at_once.skipped_bytes,
        at_once.damaged,
        at_once.unfinished_bytes,
    )
    assert lines.unfinished_bytes <= 20
    assert all(0 < len(line) <= 20 for line in found)
    assert lines.skipped_bytes + sum(map(len, found)) <= len(data)


def test_a_line_that_is_too_long_costs_only_itself() -> None:
    lines = LineSplitter(longest=8)
    assert fed(lines, b"one\n" + b"x" * 1000 + b"\ntwo\n", [3, 100, 100]) == [b"one", b"two"]
    assert (lines.skipped_bytes, lines.damaged) == (1000, 1)


def test_the_second_half_of_a_line_is_none() -> None:
    lines = LineSplitter()
    lines.reset(midway=True)
    assert lines.feed(b"0.123\r\n 1500.124\r\n") == [b"1500.124"]


def test_an_end_of_two_bytes_may_be_cut() -> None:
    assert fed(LineSplitter(end=b"\r\n"), b"a\rb\r\nc\r\n", [4, 3]) == [b"a\rb", b"c"]
    assert fed(LineSplitter(end=b"\r\n", longest=3), b"abcdefgh\r\nc\r\n", [9]) == [b"c"]


@given(st.lists(st.one_of(st.binary(max_size=40).map(frame_of), noise), max_size=12), portions)
def test_frames_do_not_depend_on_portions(pieces: list[bytes], cuts: list[int]) -> None:
    data = b"".join(pieces)
    at_once, cut = frames(), frames()
    assert fed(cut, data, cuts) == at_once.feed(data)
    assert (cut.skipped_bytes, cut.damaged, cut.unfinished_bytes) == (
        at_once.skipped_bytes,
        at_once.damaged,
        at_once.unfinished_bytes,
    )


@given(st.lists(st.binary(max_size=40), max_size=12), st.binary(max_size=40).filter(lambda b: not {*b} & {*b"S$"}))
def test_no_good_frame_is_lost_in_noise(payloads: list[bytes], between: bytes) -> None:
    cut = frames()
    data = between.join([b"", *map(frame_of, payloads), b""])
    assert cut.feed(data) == [*map(frame_of, payloads)]
    assert cut.skipped_bytes == len(data) - sum(len(frame_of(payload)) for payload in payloads)


@given(st.binary(max_size=2000), portions)
def test_frames_are_bounded_and_every_byte_is_accounted_for(data: bytes, cuts: list[int]) -> None:
    cut = FrameSplitter(
        {b"\xb5\x62": lambda head: int.from_bytes(head[2:4], "little") if len(head) > 3 else None}, longest=64
    )
    found = fed(cut, data, cuts)
    assert cut.unfinished_bytes < 64
    assert cut.skipped_bytes + cut.unfinished_bytes + sum(map(len, found)) == len(data)


def test_a_good_frame_inside_a_damaged_one_is_found() -> None:
    good = frame_of(b"inside")
    cut = frames()
    assert cut.feed(b"S\x20" + good + bytes(40)) == [good]
    assert cut.damaged >= 1


def test_a_size_that_is_too_large_does_not_make_it_wait() -> None:
    cut = FrameSplitter({b"S": lambda head: struct.unpack(">xI", head[:5])[0] if len(head) > 4 else None}, longest=32)
    assert cut.feed(b"S\xff\xff\xff\xffS\x00\x00\x00\x06!") == [b"S\x00\x00\x00\x06!"]


def test_a_frame_has_a_beginning() -> None:
    with pytest.raises(ValueError, match="at least one byte"):
        FrameSplitter({b"": size_of})


def test_datagrams_stay_as_they_are() -> None:
    assert RawChunks().feed(b"\n\n") == [b"\n\n"]


@pytest.mark.parametrize("text", ["nan", "-inf", "1e999", "1_5", "1,5", ""])
def test_what_is_no_number_of_a_device_is_refused(text: str) -> None:
    with pytest.raises(ValueError):
        parse_number(text)
    assert parse_number(" -1.5e1 ") == -15.0
