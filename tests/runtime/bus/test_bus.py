"""The bus: messages from and to other processes."""

import threading

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

import imc
from runtime import Task, consume, param, periodic
from runtime.bus import Bus, Request, Subscription
from runtime.kernel import Kernel, VirtualClock
from runtime.profile import load_profile
from runtime.testing import simulate
from runtime.vehicle import build
from tests.runtime.bus.transport_contract import FIRST, SECOND_, Link, TransportContract, Wire

OWN, OTHER = 0x1A, 0x1B


@pytest.fixture
def bus():
    kernel = Kernel(VirtualClock(0))
    bus = Bus(kernel, OWN)
    bus.release_backlog()
    yield bus
    kernel.close()


def depth(value, src=OWN):
    message = imc.Depth(value=value, src=src, timestamp=1.0)
    return message, imc.encode(message)


def test_what_is_published_here_goes_out_as_the_same_bytes(bus):
    wire = Wire()
    bus.attach_transport(wire)
    message, packet = depth(1.0)
    bus.deliver_and_send(message, packet, None)
    assert wire.sent[0] is packet


def test_what_is_published_as_of_other_definitions_is_received_by_those_of_its_message(bus, tmp_path):
    (tmp_path / "IMC.xml.gz").write_bytes(imc.dump(imc.builtin()) + b"\n")
    strange, heard = imc.load(tmp_path / "IMC.xml.gz")["Depth"], []
    assert strange is not imc.Depth
    bus.subscribe(Subscription(imc.Depth, heard.append))
    for message in (strange(value=1.5), imc.Unknown(id=imc.Depth.ID, payload=b"\0\0\0\x40")):
        bus.publish(message, 1.0, OWN, 7, None)
    bus.kernel.run()
    assert [(type(message), message.value) for message in heard] == [(imc.Depth, 1.5), (imc.Depth, 2.0)]


def test_what_comes_in_is_delivered_and_not_sent_back(bus):
    wire, heard = Wire(), []
    bus.attach_transport(wire)
    bus.subscribe(Subscription(imc.Depth, heard.append))
    bus.subscribe(Subscription(imc.Message, lambda message, packet: heard.append(packet), others=True, packets=True))
    message, packet = depth(2.0)
    wire.receive(packet + b"behind the packet")
    bus.kernel.run()
    assert heard == [message, packet]
    assert wire.sent == []


@pytest.mark.parametrize("junk", [b"", b"junk", b"T\xfe", bytes(100), depth(1.0)[1][:-1], depth(1.0)[1][:-1] + b"x"])
def test_junk_from_outside_is_counted_and_harms_nobody(bus, junk):
    wire, heard = Wire(), []
    bus.attach_transport(wire)
    bus.subscribe(Subscription(imc.Depth, heard.append))
    bus.on_malformed = lambda source, reason: heard.append(reason)
    wire.receive(junk)
    wire.receive(depth(3.0)[1])
    bus.kernel.run()
    assert bus.malformed == 1
    reason, message = heard
    assert reason.startswith(("truncated", "synchronization number", "wrong CRC"))
    assert message.value == 3.0


def test_until_resume_everything_is_kept_in_order():
    kernel = Kernel(VirtualClock(0))
    bus, heard = Bus(kernel, OWN), []
    bus.deliver_and_send(*depth(1.0), None)
    bus.subscribe(Subscription(imc.Depth, heard.append))
    bus.deliver_and_send(*depth(2.0), None)
    kernel.run()
    assert heard == []
    bus.release_backlog()
    kernel.run()
    assert [message.value for message in heard] == [1.0, 2.0]
    kernel.close()


def test_who_sent_a_request_knows_when_its_handlers_run_also_if_it_came_before_the_vehicle_had_started():
    kernel = Kernel(VirtualClock(0))
    bus, told, wire = Bus(kernel, OWN), [], Wire()
    bus.attach_transport(wire)
    bus.subscribe(Subscription(imc.Message, lambda message, packet: told.append(packet), others=True, packets=True))
    for value in (1.0, 2.0):
        request = Request(depth(value, OTHER)[1] + b"behind the packet")
        request.handled = lambda begins, value=value: told.append((value, begins))
        wire.receive(request)
    wire.receive(depth(3.0, OTHER)[1])
    kernel.run()
    assert told == []
    bus.release_backlog()
    kernel.run()
    first, second, third = (depth(value, OTHER)[1] for value in (1.0, 2.0, 3.0))
    assert told == [(1.0, True), first, (1.0, False), (2.0, True), second, (2.0, False), third]
    kernel.close()


def test_a_relayed_packet_keeps_its_header_and_loses_what_follows_it():
    class Link(Task):
        """Relays."""

        def start(self):
            self.relay(depth(4.0, OTHER)[1] + b"rest")

    class Ear(Task):
        """Keeps what it receives from others."""

        def configure(self):
            self.heard = []

        @consume(others=True, packets=True)
        def hear(self, message: imc.Depth, packet: bytes) -> None:
            self.heard.append((message, packet))

    run = simulate([Link, Ear], seconds=1.0)
    assert run.tasks[1].heard == [depth(4.0, OTHER)]


def test_a_peer_that_is_faster_than_this_process_costs_packets_and_no_memory(bus, monkeypatch):
    monkeypatch.setattr("runtime.bus.packet_inbox.MOST_OF_ONE", 100)
    wire, heard = Wire(), []
    bus.attach_transport(wire)
    bus.subscribe(Subscription(imc.Depth, heard.append))
    for number in range(250):
        wire.receive(depth(number)[1])
    assert len(bus.inbox) == 100
    bus.kernel.run()
    assert [message.value for message in heard] == list(range(100))
    assert bus.inbox.dropped.drain() == {OWN: 150}
    wire.receive(depth(7.0)[1])
    bus.kernel.run()
    assert heard[-1].value == 7.0


class Speaker(Task):
    """Publishes numbered messages, and fails on demand."""

    rate: float = param(7.0, "Hz", "How often.")

    def configure(self):
        self.number = 0

    @periodic("rate")
    def speak(self) -> None:
        self.number += 1
        self.publish(imc.Depth(value=self.number))

    @consume
    def stumble(self, message: imc.Temperature) -> None:
        if message.value == self.rate:
            raise ValueError("stumbled")


class Clerk(Task):
    """Keeps what it receives."""

    def configure(self):
        self.heard = []

    @consume
    def hear(self, message: imc.Depth) -> None:
        self.heard.append(message)


@settings(max_examples=40)
@given(
    st.lists(st.tuples(st.floats(0.0, 9.0), st.sampled_from([3.0, 5.0])), max_size=5),
    st.permutations([3.0, 5.0, 8.0]),
)
def test_nothing_is_lost_doubled_or_swapped_while_others_restart(stumbles, rates):
    feed = [imc.Temperature(value=rate, timestamp=at) for at, rate in stumbles]
    tasks = [(Speaker, {"rate": rate, "entity_label": f"Speaker {rate}"}) for rate in rates]
    run = simulate([Clerk, *tasks, (Clerk, {"entity_label": "Second"})], feed, seconds=15.0, keep_going=True)
    first, second = run.tasks[0].heard, run.tasks[-1].heard
    assert first == second == run.of(imc.Depth)
    assert [m.timestamp for m in first] == sorted(m.timestamp for m in first)
    for task in run.tasks[1:-1]:
        said = [m.value for m in first if m.src_ent == task.entity.id]
        assert said == list(range(1, task.number + 1))
        if task.rate == 8.0:
            assert task.number == 120


class Pipe:
    """The simplest transport: the other end receives what this one sends."""

    def __init__(self):
        self.other = self.receive = None

    def open(self, receive):
        self.receive = receive

    def send(self, message, packet):
        if self.receive is not None and self.other.receive is not None:
            self.other.receive(packet)

    def close(self):
        self.receive = None


class TestPipe(TransportContract):
    @pytest.fixture
    def link(self):
        kernels = Kernel(VirtualClock(0)), Kernel(VirtualClock(0))
        first, second = Bus(kernels[0], FIRST), Bus(kernels[1], SECOND_)
        ends = Pipe(), Pipe()
        ends[0].other, ends[1].other = ends[1], ends[0]
        for bus, end in zip((first, second), ends, strict=True):
            bus.release_backlog()
            bus.attach_transport(end)
        yield Link(first, second, ends[0], lambda: [kernel.run() for kernel in kernels])
        for kernel in kernels:
            kernel.close()


def test_a_transport_that_does_not_open_leaves_the_others(bus):
    class Refusing(Wire):
        def open(self, receive):
            raise ConnectionError("no network")

    wire = Wire()
    bus.attach_transport(wire)
    with pytest.raises(ConnectionError):
        bus.attach_transport(Refusing())
    message, packet = depth(1.0)
    bus.deliver_and_send(message, packet, None)
    assert wire.sent == [packet]


def test_all_transports_are_closed_even_if_one_fails(bus):
    class Failing(Wire):
        def close(self):
            super().close()
            raise OSError("cable is gone")

    wires = Wire(), Failing(), Wire()
    for wire in wires:
        bus.attach_transport(wire)
    with pytest.raises(OSError, match="cable is gone"):
        bus.close_transports()
    assert [wire.closed for wire in wires] == [1, 1, 1]
    assert not bus.has_transports


def test_instruments_observe_every_subscription(bus):
    class Observer:
        def __init__(self):
            self.types = []

        def on_subscribe(self, subscription):
            self.types.append(subscription.type)

        def on_reconfigure(self, owner):
            """Not of interest here."""

    observers = Observer(), Observer()
    bus.observers.extend(observers)
    bus.subscribe(Subscription(imc.Depth, print))
    bus.subscribe(Subscription(imc.Rpm, print))
    assert [observer.types for observer in observers] == [[imc.Depth, imc.Rpm]] * 2


def test_all_transports_of_a_shipped_vehicle_carry_the_same_packets(tmp_path):
    profile = load_profile("lauv-noptilus-1")
    clock = VirtualClock(profile.start_time_ns)
    vehicle = build(profile, profile.parse_modes("Simulation"), clock=clock, log_root=tmp_path).vehicle
    wires = Wire(), Wire()
    for wire in wires:
        vehicle.bus.attach_transport(wire)
    vehicle.start()
    vehicle.run(3.0)
    wires[0].receive(b"junk of a stranger")
    wires[1].receive(imc.encode(imc.Depth(value=1.0, src=OTHER, timestamp=1.0)))
    vehicle.run(3.0)
    vehicle.close()
    assert len(wires[0].sent) > 2000
    assert wires[0].sent == wires[1].sent, "what comes in on one is not sent on"
    assert (vehicle.bus.malformed, [wire.closed for wire in wires]) == (1, [1, 1])


class StandingClock:
    """A wall clock that has stopped: no pause ends on it."""

    virtual = False
    speed = 1.0

    def read(self):
        return 0

    def advance(self, target, wait):
        wait(0.001 if target is None or target > 0 else 0.0)
        return 0


def test_strangers_wait_for_the_vehicle_only_while_it_has_something_to_do():
    kernel = Kernel(StandingClock())
    bus, wire, heard, own = Bus(kernel, OWN), Wire(), [], []
    bus.release_backlog()
    bus.attach_transport(wire)
    bus.subscribe(Subscription(imc.Depth, lambda message: heard.append(message.value), others=True))
    for number in range(1000):
        wire.receive(depth(number, src=OTHER)[1])

    def work():
        own.append(len(heard))
        if len(own) < 2000:
            kernel.soon(work)
        elif len(heard) < 1000:
            kernel.post(work)  # looks again when there is nothing else to do
        else:
            kernel.stop()

    kernel.soon(work)
    watchdog = threading.Timer(10.0, kernel.post, [kernel.stop])
    watchdog.start()
    kernel.run()
    watchdog.cancel()
    kernel.close()
    assert heard == list(range(1000))
    assert own[10] == own[1999] == 64, "one turn, and then a pause"
