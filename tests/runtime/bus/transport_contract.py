"""The contract of every transport: subclass TransportContract and make a `link` of two buses joined by a transport."""

import time
from collections.abc import Callable
from dataclasses import dataclass

import imc
from runtime.bus import Bus, Subscription, Transport

FIRST, SECOND_ = 0x1A, 0x1B
PATIENCE = 10.0  # s


class Wire:
    """A transport that keeps what it is sent, and delivers on request."""

    def __init__(self) -> None:
        self.sent: list[bytes] = []
        self.receive: Callable[[bytes], None] | None = None
        self.closed = 0

    @property
    def systems(self) -> tuple[int, ...]:
        return ()

    def open(self, receive: Callable[[bytes], None]) -> None:
        self.receive = receive

    def send(self, message: imc.Message, packet: bytes) -> None:
        if self.receive is not None:
            self.sent.append(packet)

    def close(self) -> None:
        self.receive = None
        self.closed += 1


@dataclass
class Link:
    """Two buses joined by a transport. `run` lets both kernels work for a moment."""

    first: Bus
    second: Bus
    first_transport: Transport
    run: Callable[[], object]

    def until(self, condition: Callable[[], bool]) -> None:
        deadline = time.monotonic() + PATIENCE
        while not condition():
            assert time.monotonic() < deadline, "nothing arrived"
            self.run()

    def settle(self) -> None:
        """Wait until sent messages have arrived."""
        for _ in range(10):
            self.run()


def publish(bus: Bus, value: float, **header: int) -> bytes:
    message = imc.Depth(value=value, timestamp=1.0, **{"src": bus.system, "src_ent": 7, **header})
    packet = imc.encode(message)
    bus.deliver_and_send(message, packet, None)
    return packet


def listen(bus: Bus) -> list[float]:
    heard: list[float] = []
    bus.subscribe(Subscription(imc.Depth, lambda message: heard.append(message.value), others=True))
    return heard


class TransportContract:
    """Tests that all transports pass."""

    def test_packets_arrive_in_order_and_once(self, link: Link) -> None:
        heard = listen(link.second)
        for number in range(200):
            publish(link.first, number)
        link.until(lambda: len(heard) >= 200)
        link.settle()
        assert heard == list(range(200))
        assert link.second.malformed == 0

    def test_packets_travel_both_ways_and_never_return_to_their_sender(self, link: Link) -> None:
        first, second = listen(link.first), listen(link.second)
        publish(link.first, 1.0)
        publish(link.second, 2.0)
        link.until(lambda: len(first) >= 2 and len(second) >= 2)
        link.settle()
        assert (sorted(first), sorted(second)) == ([1.0, 2.0], [1.0, 2.0])

    def test_the_bytes_are_those_that_were_published(self, link: Link) -> None:
        packets: list[bytes] = []
        wanted = Subscription(imc.Message, lambda _, packet: packets.append(packet), others=True, packets=True)
        link.second.subscribe(wanted)
        sent = [publish(link.first, 3.0, dst=SECOND_), publish(link.first, 4.0)]
        unknown = imc.Unknown(id=0xFFF0, payload=b"\1\2\3", src=FIRST, timestamp=1.0)
        sent.append(imc.encode(unknown))
        link.first.deliver_and_send(unknown, sent[-1], None)
        link.until(lambda: len(packets) >= 3)
        assert sorted(packets) == sorted(sent)

    def test_a_second_transport_is_added_to_the_first(self, link: Link) -> None:
        heard, wire = listen(link.second), Wire()
        link.first.attach_transport(wire)
        packet = publish(link.first, 5.0)
        link.until(lambda: heard == [5.0])
        assert wire.sent == [packet]

    def test_what_is_received_is_not_sent_on(self, link: Link) -> None:
        heard, wire = listen(link.second), Wire()
        link.second.attach_transport(wire)
        publish(link.first, 6.0)
        link.until(lambda: heard == [6.0])
        assert wire.sent == []

    def test_after_close_nothing_is_sent_or_received(self, link: Link) -> None:
        first, second, wire = listen(link.first), listen(link.second), Wire()
        link.first.attach_transport(wire)
        publish(link.first, 7.0)
        link.until(lambda: second == [7.0])
        link.first.close_transports()
        assert (wire.closed, link.first.has_transports) == (1, False)
        publish(link.first, 8.0)
        publish(link.second, 9.0)
        message = imc.Depth(value=10.0, src=FIRST)
        link.first_transport.send(message, imc.encode(message))
        link.first_transport.close()
        link.settle()
        assert (first, second) == ([7.0, 8.0], [7.0, 9.0])
