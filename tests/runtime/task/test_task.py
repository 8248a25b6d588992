"""Tasks: subscriptions, publishing, random numbers, and testing without a vehicle."""

import socket
import struct

import numpy as np
import pytest

import imc
from runtime import Frame, ParameterError, State, Task, consume, periodic
from runtime.testing import START, simulate
from tests.runtime.task.clockwork import Clockwork

OTHER = 0x4001


class Echo(Task):
    """Repeats depths and temperatures."""

    @consume
    def echo(self, message: imc.Depth | imc.Temperature) -> None:
        self.publish(imc.Pressure(value=message.value))


class Gossip(Task):
    """Counts the messages of all systems."""

    def configure(self):
        self.heard = []

    @consume(others=True, packets=True)
    def hear(self, message: imc.Message, packet: bytes) -> None:
        self.heard.append((message, packet))


def test_a_union_is_received_and_other_types_and_other_systems_are_not():
    feed = [
        imc.Depth(value=1.0, timestamp=1.0),
        imc.Temperature(value=2.0, timestamp=2.0),
        imc.Depth(value=3.0, timestamp=3.0, src=OTHER),
        imc.SoundSpeed(value=4.0, timestamp=4.0),
    ]
    assert [p.value for p in simulate(Echo, feed).of(imc.Pressure)] == [1.0, 2.0]


def test_publishing_fills_the_header_and_rounds_to_the_wire():
    run = simulate(Echo, [imc.Depth(value=0.1, timestamp=2.5)])
    reply = run.of(imc.Pressure)[0]
    assert reply.value == struct.unpack("<f", struct.pack("<f", 0.1))[0]
    assert reply.timestamp == START + 2.5
    assert (reply.src, reply.src_ent, reply.dst) == (0x1A, run.task.entity.id, 0xFFFF)
    assert imc.decode(run.packets[0]) == reply


def test_everybody_is_received_where_it_is_asked_for_with_the_packet():
    run = simulate([Gossip, Echo], [imc.Depth(value=1.0, src=OTHER), imc.Depth(value=2.0)])
    gossip = run.tasks[0]
    depths = [m.value for m, _ in gossip.heard if isinstance(m, imc.Depth)]
    assert depths == [1.0, 2.0]
    assert all(imc.decode(packet) == message for message, packet in gossip.heard)


def test_a_task_does_not_hear_itself():
    class Loud(Task):
        """Publishes and receives Depth."""

        def start(self):
            self.heard = 0
            self.publish(imc.Depth(value=1.0))

        @consume
        def hear(self, depth: imc.Depth) -> None:
            self.heard += 1

    assert simulate(Loud, seconds=1).task.heard == 0
    assert simulate(Loud, seconds=1, loopback_internal_messages=True).task.heard == 1


class Listener(Task):
    """Fails on data from its socket, and has no stop()."""

    def start(self):
        self.sockets = [*getattr(self, "sockets", ()), *socket.socketpair()]
        ours = self.sockets[-2]
        self.sockets[-1].send(b"nonsense")
        self.watch(ours, lambda: self.read(ours))

    def read(self, ours):
        raise ValueError(f"malformed: {ours.recv(100)!r}")


def test_an_error_in_what_watches_is_the_tasks_error_and_its_restart_watches_anew():
    with pytest.raises(ValueError, match="nonsense") as caught:
        simulate(Listener, seconds=1.0)
    assert "Listener" in caught.value.__notes__[0]
    run = simulate(Listener, seconds=5.0, keep_going=True)
    assert len(run.task.sockets) >= 4
    assert run.vehicle.kernel._sources.count == 0
    for end in run.task.sockets:
        end.close()


def test_random_numbers_depend_on_seed_and_task_and_on_nothing_else():
    class Dice(Task):
        """Throws dice."""

        def start(self):
            self.publish(imc.Depth(value=self.random.standard_normal()))

    def throw(tasks, seed):
        return [d.value for d in simulate(tasks, seconds=1, seed=seed).of(imc.Depth)]

    first = throw([Dice], 1)
    assert throw([Dice], 1) == first
    assert throw([Dice], 2) != first
    assert throw([Dice, Clockwork], 1) == first
    both = throw([Dice, Dice], 1)
    assert both[0] == first[0] != both[1]


def test_frames_are_shared_as_they_are_and_not_published():
    class Camera(Task):
        """Takes one picture."""

        def start(self):
            self.publish_frame(Frame(self.now, "Camera", 0, np.zeros((2, 3, 4), np.uint8), {}))

    class Viewer(Task):
        """Looks."""

        def start(self):
            self.seen = []

        @consume
        def look(self, frame: Frame) -> None:
            self.seen.append(frame)

    run = simulate([Camera, Viewer], seconds=1.0)
    assert run.tasks[1].seen[0] is run.frames[0]
    assert run.messages == []


def test_the_log_book_cuts_and_keeps_debug_for_those_who_ask():
    class Talker(Task):
        """Writes to the log book."""

        def start(self):
            self.log.info("ä" * 2000)
            self.log.debug("detail")

    assert [len(t.encode()) for t in simulate(Talker, seconds=1).log] == [1022]
    assert simulate(Talker, seconds=1, debug_level="Debug").log[1] == "detail"


def test_entity_states_are_published_when_they_change():
    class Moody(Task):
        """Changes its entity state."""

        def start(self):
            self.set_entity_state(State.NORMAL, "fine")
            self.set_entity_state(State.NORMAL, "still fine")
            self.set_entity_state(State.FAULT, "not fine")

    states = simulate(Moody, seconds=0.5).of(imc.EntityState)
    reports = dict.fromkeys((s.state, s.description) for s in states)
    assert list(reports) == [(State.NORMAL, "fine"), (State.FAULT, "not fine")]


def test_values_that_a_parameter_cannot_have_are_refused():
    with pytest.raises(ParameterError, match=r"Rate: -1 is below the minimum .*0 or more, Hz"):
        simulate(Clockwork, rate=-1.0)
    with pytest.raises(ParameterError, match="has no such parameter"):
        simulate(Clockwork, speed=1.0)


def test_a_handler_without_a_message_type_is_an_error_that_names_it():
    class Vague(Task):
        """Has a handler without a message type."""

        @consume
        def hear(self, message) -> None: ...

    with pytest.raises(TypeError, match=r"Vague\.hear: annotate"):
        simulate(Vague)


def test_settings_stand_in_for_the_profile() -> None:
    run = simulate(Echo, settings={"General": {"Absolute Maximum Depth": "50", "Recovery Plan": ""}})
    settings = run.vehicle.profile
    assert settings.value("General", "Absolute Maximum Depth") == "50"
    assert settings.value("General", "Recovery Plan", "dislodge") == "dislodge"
    assert (settings.value("VSIM", "Mass"), settings.value("General", "None", "1")) == ("", "1")


def test_an_async_handler_is_an_error_that_names_it():
    class Hasty(Task):
        """Waits in a handler."""

        @consume
        async def hear(self, depth: imc.Depth) -> None: ...

    class Ticking(Task):
        """Waits in a tick."""

        @periodic(1.0)
        async def tick(self) -> None: ...

    with pytest.raises(TypeError, match=r"Hasty\.hear: handlers are not async"):
        simulate(Hasty)
    with pytest.raises(TypeError, match=r"Ticking\.tick: handlers are not async"):
        simulate(Ticking)


@pytest.mark.parametrize("dst", [0x1A, 0xFFFF, 0xFFF0, 0x1B])
@pytest.mark.parametrize("src", [0x1A, 0x4001, 0x5FFF, 0x6000, 0x1B])
def test_a_request_concerns_a_vehicle_that_it_is_addressed_to_or_an_operators_broadcast(src, dst):
    class Clerk(Task):
        """Asks itself whether requests are its own."""

    task = simulate(Clerk, seconds=0.0).task
    from_outside = src not in (0x1A, 0x4001, 0x5FFF)
    assert task.is_for_me(imc.Abort(src=src, dst=dst)) == (dst == 0x1A or (dst != 0x1B and not from_outside))


def test_a_task_does_not_tap_the_bus():
    class Spy(Task):
        """Taps the bus."""

        def start(self):
            self.vehicle.observe(imc.Depth, self.note)

        def note(self, depth):
            """Never called."""

    with pytest.raises(TypeError, match="part of the vehicle"):
        simulate(Spy, seconds=1.0)
