"""Signatures: the same as pymavlink's, and what is not accepted."""

import hashlib
import struct

import pytest
from pymavlink.dialects.v20 import ardupilotmega as upstream

from mavlink import Signing, SigningTime, encode, load_dialect, parse_key, split
from mavlink.signing import BEHIND, LATEST, MOST_STREAMS

DIALECT = load_dialect()
KEY = bytes(range(32))
NOW = 1_790_000_000.0  # s since 1970
TICKS = round((NOW - 1420070400) * 1e5)


class Peer:
    """A sender with pymavlink's own signatures."""

    def __init__(self, key=KEY, time=TICKS, link=3, system=255, component=190):
        self.mav = upstream.MAVLink(None, srcSystem=system, srcComponent=component)
        self.mav.signing.secret_key = key
        self.mav.signing.sign_outgoing = True
        self.mav.signing.link_id, self.mav.signing.timestamp = link, time

    def frame(self, message=None):
        return bytes((message or upstream.MAVLink_heartbeat_message(6, 8, 0, 0, 4, 3)).pack(self.mav))


def signing(key=KEY, latest=0, clock=lambda: NOW):
    return Signing(key, SigningTime(clock, latest))


def received(frame):
    (message,), damages = split(frame, DIALECT)
    assert not damages
    return message


def faults(ours, *frames):
    return [ours.reject_reason(received(frame)) for frame in frames]


def test_pymavlink_accepts_our_signatures_and_we_accept_its():
    peer, ours = Peer(), signing()
    assert faults(ours, *(peer.frame() for _ in range(5))) == [""] * 5
    definition = DIALECT.by_name["ATTITUDE"]
    for sequence in range(5):
        payload = definition.pack({"time_boot_ms": sequence, "roll": 0.5})
        frame = encode(definition, payload, sequence, 26, 1, ours.signer(2))
        (message,) = peer.mav.parse_buffer(frame)
        assert (message.get_type(), message.roll, message.get_signed(), message.get_link_id()) == (
            "ATTITUDE",
            0.5,
            True,
            2,
        )
    assert (peer.mav.signing.goodsig_count, peer.mav.signing.badsig_count) == (5, 0)


def test_what_was_recorded_is_not_accepted_again_on_any_link():
    peer, ours = Peer(), signing()
    first, second = peer.frame(), peer.frame()
    assert faults(ours, first, second, first, second) == ["", "", "replayed", "replayed"]
    assert faults(ours, peer.frame()) == [""]


def test_another_key_and_a_changed_frame_are_forged():
    stranger, peer, ours = Peer(bytes(32)), Peer(), signing()
    frame = bytearray(peer.frame())
    frame[-1] ^= 1
    assert faults(ours, stranger.frame(), frame) == ["forged", "forged"]
    later = bytearray(peer.frame())
    later[-12] ^= 1  # its time
    assert faults(ours, later, peer.frame()) == ["forged", ""]


def test_a_forged_time_locks_nobody_out():
    peer, forger, ours = Peer(), Peer(bytes(32), time=LATEST), signing()
    assert faults(ours, peer.frame(), forger.frame(), peer.frame()) == ["", "forged", ""]
    assert faults(ours, Peer(system=254).frame()) == [""]


def test_a_new_sender_may_be_a_minute_behind_and_not_more():
    ours = signing()
    assert faults(ours, Peer(time=TICKS - BEHIND - 1).frame()) == ["replayed"]
    assert faults(ours, Peer(time=TICKS - BEHIND + 1000).frame()) == [""]
    assert faults(ours, Peer(system=254, time=TICKS + 10 * BEHIND).frame()) == [""]
    assert faults(ours, Peer(system=253).frame()) == ["replayed"], "the others are ten minutes ahead of it"


def test_what_came_before_a_restart_is_not_new():
    peer, time = Peer(time=TICKS - 100_000), SigningTime(lambda: NOW)
    recorded = peer.frame()
    assert faults(Signing(KEY, time), recorded) == [""]
    again = Signing(KEY, SigningTime(lambda: NOW, known=time.now))
    assert faults(again, recorded) == ["replayed"]
    peer.mav.signing.timestamp = time.now + 1
    assert faults(again, peer.frame()) == [""]


def test_only_what_radios_send_may_be_unsigned():
    plain = upstream.MAVLink(None, srcSystem=51, srcComponent=68)
    status = upstream.MAVLink_radio_status_message(100, 100, 50, 20, 20, 0, 0)
    beat = upstream.MAVLink_heartbeat_message(6, 8, 0, 0, 4, 3)
    old = upstream.MAVLink(None, srcSystem=255)
    frames = status.pack(plain), beat.pack(plain), beat.pack(old, force_mavlink1=True)
    assert faults(signing(), *map(bytes, frames)) == ["", "unsigned", "unsigned"]


def test_times_grow_also_if_the_clock_was_never_set():
    time = SigningTime(lambda: 0.0, latest=TICKS)
    assert [time.next(), time.next()] == [TICKS + 1, TICKS + 2]
    assert SigningTime(lambda: 0.0).next() == 1
    time.advance_to(TICKS + BEHIND)
    assert time.next() == TICKS + BEHIND + 1
    followed = SigningTime(lambda: NOW)
    assert (followed.next(), followed.next()) == (TICKS, TICKS + 1)


def test_a_time_at_the_end_of_all_times_does_not_stop_the_vehicle():
    peer, ours = Peer(time=LATEST - 1), signing()
    assert faults(ours, peer.frame()) == [""]
    sign = ours.signer(0)
    times = [struct.unpack("<Q", sign(b"frame")[1:7] + b"\0\0")[0] for _ in range(3)]
    assert times == sorted(set(times))
    assert times[-1] < LATEST


def test_streams_are_bounded_and_none_can_be_replayed():
    clock = [NOW]
    ours = signing(clock=lambda: clock[0])
    peers = [Peer(system=1 + n % 250, component=n // 250) for n in range(MOST_STREAMS + 1)]
    frames = [peer.frame() for peer in peers]
    assert faults(ours, *frames) == [""] * MOST_STREAMS + ["replayed"]
    clock[0] += 100.0
    late = Peer(system=7, component=77, time=TICKS + 100 * 100_000).frame()
    assert faults(ours, late, *frames) == ["", *["replayed"] * len(frames)]


@pytest.mark.parametrize(
    ("content", "key"),
    [
        (KEY, KEY),
        (KEY.hex().encode() + b"\n", KEY),
        (KEY.hex().upper().encode(), KEY),
        (b"sardines\r\n", hashlib.sha256(b"sardines").digest()),
        (b"a sentence of 31 letters, i.e.,\n", hashlib.sha256(b"a sentence of 31 letters, i.e.,").digest()),
        ("Maré".encode(), hashlib.sha256("Maré".encode()).digest()),
    ],
)
def test_keys(content, key):
    assert parse_key(content) == key


@pytest.mark.parametrize("content", [b"", b"\n", b"secret\nsecond", bytes(31), bytes(range(200, 233))])
def test_what_is_no_key_is_refused_and_not_repeated(content):
    with pytest.raises(ValueError, match="neither 32 bytes") as caught:
        parse_key(content)
    assert "secret" not in str(caught.value)
