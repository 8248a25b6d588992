"""Packets in pieces."""

import random

import pytest

import imc
from imc.fragments import MOST, MOST_OF_ONE, OVERHEAD, FragmentAssembler, split_packet

PACKET = imc.encode(imc.LogBookEntry(text="long " * 300, src=7, dst=9, timestamp=3.0))


def parts(packet=PACKET, limit=200, uid=3, src=0x4000, dst=0x001A):
    return [part.replace(src=src, dst=dst) for part in split_packet(packet, limit, uid)]


def test_each_piece_fits_and_together_they_are_the_packet():
    for limit in (28, 32, 200, 1400, 65535):
        if len(PACKET) > 255 * (limit - OVERHEAD):
            continue
        pieces = split_packet(PACKET, limit, 254)
        assert all(len(imc.encode(piece)) <= limit for piece in pieces)
        assert b"".join(piece.data for piece in pieces) == PACKET
        assert [piece.frag_number for piece in pieces] == list(range(len(pieces)))
        assert {(piece.uid, piece.num_frags) for piece in pieces} == {(254, len(pieces))}


@pytest.mark.parametrize("limit", [0, 27, 33])
def test_too_small_pieces_are_refused(limit):
    with pytest.raises(imc.EncodeError, match="255 pieces"):
        split_packet(PACKET, limit, 0)


def test_pieces_in_any_order_and_twice_make_one_packet_with_their_sender():
    pieces = parts() * 2
    random.Random(1).shuffle(pieces)
    assembler = FragmentAssembler()
    found = [packet for piece in pieces if (packet := assembler.add(piece, 0.0))]
    message = imc.decode(found[0])
    assert (message.src, message.dst, message.text) == (0x4000, 0x001A, "long " * 300)
    assert assembler.counts["complete"] == len(found)


def test_imcjava_makes_pieces_two_bytes_larger():
    """Its data leave no room for the CRC; the pieces of both are put together."""
    pieces = [piece.replace(src=1, dst=2) for piece in split_packet(PACKET, 202, 0)]
    assembler = FragmentAssembler()
    assert [bool(assembler.add(piece, 0.0)) for piece in pieces] == [False] * (len(pieces) - 1) + [True]


def test_big_endian_packets_come_through():
    pieces = parts(imc.encode(imc.decode(PACKET), "big"))
    assembler = FragmentAssembler()
    (whole,) = [packet for piece in pieces if (packet := assembler.add(piece, 0.0))]
    assert imc.decode(whole).text == "long " * 300


def test_a_uid_may_come_again_with_another_message():
    other = imc.encode(imc.LogBookEntry(text="other " * 300))
    assembler = FragmentAssembler()
    for piece in parts()[:-1]:
        assert assembler.add(piece, 0.0) is None
    found = [packet for piece in parts(other) if (packet := assembler.add(piece, 1.0))]
    assert imc.decode(found[0]).text.startswith("other")
    assert assembler.counts == {"given up by the sender": 1, "complete": 1}
    assert len(assembler) == 0


def test_messages_of_several_systems_do_not_mix():
    assembler = FragmentAssembler()
    one, two = parts(src=1, uid=23), parts(src=12, uid=3)  # imcjava takes these for the same
    found = [assembler.add(piece, 0.0) for pair in zip(one, two, strict=True) for piece in pair]
    assert [imc.header(packet).src for packet in found if packet] == [1, 12]


@pytest.mark.parametrize(
    "change",
    [{"num_frags": 0}, {"frag_number": 9}, {"data": b""}, {"frag_number": 255, "num_frags": 255}],
)
def test_pieces_that_cannot_be_are_refused(change):
    assembler = FragmentAssembler()
    with pytest.raises(imc.DecodeError):
        assembler.add(parts()[0].replace(**change), 0.0)
    assert (len(assembler), assembler.counts["malformed"]) == (0, 1)


def test_pieces_that_are_no_packet_are_refused():
    for data in (b"not a packet at all, but long enough", PACKET[:-9], PACKET[:-1] + b"?", PACKET[:2]):
        assembler = FragmentAssembler()
        *first, last = parts(data)
        assert not any(assembler.add(piece, 0.0) for piece in first)
        with pytest.raises(imc.DecodeError):
            assembler.add(last, 0.0)
        assert (len(assembler), assembler.counts["malformed"]) == (0, 1)


def test_what_is_never_complete_costs_little_and_is_forgotten():
    assembler = FragmentAssembler()
    for source in range(100):
        for uid in range(20):
            piece = imc.MessagePart(uid=uid, num_frags=255, data=b"x" * 60_000, src=source, dst=9)
            assembler.add(piece, float(source))
            assert sum(each.size for each in assembler._waiting.values()) <= 1 << 20
    assert len(assembler) <= MOST
    small = [imc.MessagePart(uid=uid, num_frags=2, data=b"x", src=7, dst=9) for uid in range(20)]
    for piece in small:
        assembler.add(piece, 200.0)
    assert sum(key[0] == 7 for key in assembler._waiting) == MOST_OF_ONE
    assembler.expire(150.0)
    assert len(assembler) == MOST_OF_ONE
    assembler.expire(250.0)
    assert (len(assembler), assembler._bytes) == (0, 0)


def test_more_than_a_packet_is_refused_before_it_is_complete():
    assembler = FragmentAssembler()
    pieces = [imc.MessagePart(uid=1, frag_number=n, num_frags=255, data=b"x" * 40_000, src=7) for n in range(2)]
    assembler.add(pieces[0], 0.0)
    with pytest.raises(imc.DecodeError, match="larger"):
        assembler.add(pieces[1], 0.0)
    assert len(assembler) == 0


@pytest.mark.parametrize(("present", "wanted"), [([0], "!0"), ([0, 1, 2], "3"), ([1, 3], "0,2"), ([0, 2], "1,3")])
def test_the_shorter_list_asks_for_the_missing_pieces(present, wanted):
    assembler = FragmentAssembler()
    for number in present:
        assembler.add(imc.MessagePart(uid=1, frag_number=number, num_frags=4, data=b"x", src=7), 0.0)
    ((system, uid, message),) = assembler.overdue_messages(1.0)
    assert (system, uid, message.format_missing_parts()) == (7, 1, wanted)
