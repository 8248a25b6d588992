"""What waits of other processes: bounded for each source, and taken in turn."""

import sys
import threading

import pytest

import imc
from runtime.bus import packet_inbox
from runtime.bus.packet_inbox import PacketInbox, packet_queue_key

ALL, VEHICLE, CONSOLE = 0xFFFF, 0x1A, 0x4001


def packet(source: int, number: int = 0, **header: int) -> bytes:
    return imc.encode(imc.Temperature(src=source, value=number, **header))


def all_of(box: PacketInbox) -> list[bytes]:
    return box.take_packets(len(box))


@pytest.mark.parametrize(
    ("message", "apart"),
    [
        (imc.Temperature(src=CONSOLE), False),
        (imc.Temperature(src=CONSOLE, dst=VEHICLE), True),
        (imc.Announce(src=CONSOLE, dst=0), False),
        (imc.Abort(src=CONSOLE), True),
    ],
)
def test_commands_and_aborts_do_not_wait_behind_telemetry(message: imc.Message, apart: bool) -> None:
    assert packet_queue_key(imc.encode(message)) == (CONSOLE, apart)


def test_what_is_no_packet_has_no_source() -> None:
    assert packet_queue_key(b"T\xfe") == (ALL, False)


def test_a_source_that_floods_loses_its_own_packets_and_waits_for_its_turn(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(packet_inbox, "MOST_OF_ONE", 10)
    box = PacketInbox()
    asked = [box.put(packet(1, number)) for number in range(100)]
    assert asked == [True] + [False] * 99, "one call serves all that waits"
    box.put(packet(2))
    box.put(packet(1, dst=VEHICLE))
    assert box.dropped.drain() == {1: 90}
    order = [imc.decode(each) for each in all_of(box)]
    assert [(m.src, m.dst) for m in order[:3]] == [(1, ALL), (2, ALL), (1, VEHICLE)]
    assert [m.value for m in order if (m.src, m.dst) == (1, ALL)] == list(range(10)), "in order"
    assert not box.has_more()
    assert box.put(packet(1)), "the next one asks again"


def test_many_names_and_large_packets_cannot_fill_the_memory(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(packet_inbox, "MOST_OF_ONE", 2)
    monkeypatch.setattr(packet_inbox, "MOST_SOURCES", 4)
    box = PacketInbox()
    for source in range(1000):
        box.put(packet(source))
    assert len(box) == 6, "four sources, and two of all others"
    assert box.dropped.total == 994
    assert len(all_of(box)) == 6

    monkeypatch.setattr(packet_inbox, "MOST_BYTES_OF_ONE", 10_000)
    large = imc.encode(imc.DevDataText(src=7, value="x" * 3000))
    for _ in range(5):
        box.put(large)
    monkeypatch.setattr(packet_inbox, "MOST_OF_ONE", 100)
    for _ in range(5):
        box.put(large)
    assert len(box) == 3
    assert box.dropped.total == 994 + 7


def test_no_drop_is_uncounted_while_others_are_read(monkeypatch: pytest.MonkeyPatch) -> None:
    """Packets come in any thread; the kernel's thread reads the counts."""
    monkeypatch.setattr(packet_inbox, "MOST_OF_ONE", 0)
    box, sent, counted = PacketInbox(), [packet(source) for source in range(1, 400)] * 25, 0
    senders = [threading.Thread(target=lambda: [box.put(each) for each in sent]) for _ in range(2)]
    interval = sys.getswitchinterval()
    sys.setswitchinterval(1e-6)
    try:
        for sender in senders:
            sender.start()
        while any(sender.is_alive() for sender in senders):
            counted += sum(number for _, number in box.drain_dropped().items())
    finally:
        sys.setswitchinterval(interval)
        for sender in senders:
            sender.join()
    assert counted + box.drain_dropped().total() == box.dropped.total == 2 * len(sent)
