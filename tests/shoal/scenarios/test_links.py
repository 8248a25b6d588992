"""Links between vehicles: what arrives, when, and what is counted."""

import math

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

import imc
from runtime import Task, consume, param, periodic
from runtime.kernel import SECOND, VirtualClock
from runtime.testing import START, NoProfile
from runtime.vehicle import Fleet, FleetError, Vehicle
from shoal.scenarios.links import LinkModel
from shoal.scenarios.run_context import RunContext
from support.wgs84 import displace
from tests.runtime.bus.transport_contract import FIRST, SECOND_, TransportContract
from tests.runtime.bus.transport_contract import Link as Buses


class Talker(Task):
    """Says numbers, tells where it is, and notes what it hears of others, and when."""

    rate: float = param(4.0, "Hz", "Rate of numbers.", minimum=0)
    north: float = param(0.0, "m", "Place.", minimum=-1e6)
    speed: float = param(0.0, "m/s", "Speed to the north.", minimum=-1e3)
    moves_origin: bool = param(False, "", "Whether the reference of its place differs from that of others.")

    vanishes_after: float = param(1e9, "s", "Time after which its place is no number.")

    def start(self) -> None:
        self.said, self.heard = 0, []

    @periodic(20.0)
    def move(self) -> None:
        north = self.north + self.speed * (self.now - START)
        lat, lon = (0.7, -0.1)
        if self.moves_origin:
            lat, lon, _ = displace(lat, lon, 0.0, north, 0.0)
            north = 0.0
        north = north if self.now - START < self.vanishes_after else math.nan
        self.publish(imc.SimulatedState(lat=lat, lon=lon, x=north))

    @periodic("rate")
    def speak(self) -> None:
        self.said += 1
        self.publish(imc.Depth(value=self.said))

    @consume(others=True)
    def hear(self, depth: imc.Depth) -> None:
        if depth.src != self.system:
            self.heard.append((depth.src, int(depth.value), self.now - depth.timestamp))


def talk(*links, seconds=10.0, seed=0, places=((0.0, 0.0), (100.0, 0.0)), rate=4.0, **more):
    """Vehicles a, b, ... with links: their tasks, and the channels."""
    with Fleet(VirtualClock(START * SECOND)) as fleet:
        tasks = []
        for number, (north, speed) in enumerate(places):
            vehicle = Vehicle("abcdef"[number], number + 1, fleet=fleet, profile=NoProfile())
            tasks.append(vehicle.add(Talker, "Test.Talker", north=north, speed=speed, rate=rate, **more))
        context = RunContext(fleet, {vehicle.name: vehicle for vehicle in fleet.vehicles}, seed)
        channels = [link.open_channel(context) for link in links]
        fleet.start()
        fleet.run(seconds)
    return tasks, channels


def link(**values):
    return LinkModel("radio", ("a", "b"), messages=("Depth",), **values)


def delays(task):
    return {round(delay, 6) for _, _, delay in task.heard}


def test_without_limits_all_arrives_at_once():
    (a, b), (channel,) = talk(link())
    assert [value for _, value, _ in b.heard] == list(range(1, a.said + 1))
    assert delays(b) == {0.0}
    assert channel.metrics() == {
        "radio: sent": a.said + b.said,
        "radio: received": a.said + b.said,
        "radio: lost": 0.0,
        "radio: out of range": 0.0,
        "radio: cut": 0.0,
        "radio: dropped": 0.0,
    }


def test_without_a_link_nothing_arrives():
    (a, b), _ = talk()
    assert (a.heard, b.heard) == ([], [])


def test_latency_and_the_way_at_the_speed_of_sound():
    (_, b), _ = talk(link(latency=0.4, propagation=1500.0), places=((0.0, 0.0), (300.0, 0.0)))
    assert delays(b) == {0.6}
    (_, b), _ = talk(link(propagation=1500.0), places=((0.0, 0.0), (300.0, 0.0)), moves_origin=True)
    assert [delay for _, _, delay in b.heard] == pytest.approx([0.2] * len(b.heard), abs=1e-3)
    assert len(b.heard) > 30


def test_beyond_the_range_nothing_arrives():
    (a, b), (channel,) = talk(link(range=120.0), places=((0.0, 0.0), (100.0, 5.0)))
    assert max(value for _, value, _ in b.heard) == pytest.approx(4.0 * 4.0, abs=1.0)
    assert channel.counts["out of range"] == a.said + b.said - channel.counts["received"]


def test_a_place_that_is_not_finite_is_out_of_range():
    (a, b), (channel,) = talk(link(propagation=1500.0), vanishes_after=5.0)
    assert max(value for _, value, _ in b.heard) == pytest.approx(20, abs=1)
    assert channel.counts["out of range"] == a.said + b.said - channel.counts["received"]
    assert channel.counts["out of range"] == pytest.approx(40, abs=4)


def test_one_that_moves_does_not_change_the_order():
    (_, b), _ = talk(link(propagation=5.0), rate=20.0, places=((0.0, 0.0), (100.0, -9.0)), seconds=30.0)
    heard = [value for _, value, _ in b.heard]
    assert len(heard) > 200
    assert heard == list(range(heard[0], heard[0] + len(heard)))


def test_loss_is_that_share_and_follows_from_the_seed():
    def losses(seed, share=0.3):
        (_, b), (channel,) = talk(link(loss=share), rate=50.0, seconds=20.0, seed=seed)
        return [value for _, value, _ in b.heard], channel.counts["lost"] / channel.counts["sent"]

    heard, share = losses(1)
    assert share == pytest.approx(0.3, abs=0.05)
    assert losses(1) == (heard, share)
    assert losses(2)[0] != heard
    assert losses(1, 1.0)[1] == 1.0


def test_each_direction_and_link_has_its_own_losses():
    second = LinkModel("other", ("a", "b"), loss=0.5, messages=("Depth",))
    alone = talk(link(loss=0.5), seconds=20.0)[1][0].counts
    (a, b), channels = talk(link(loss=0.5), second, seconds=20.0)
    assert channels[0].counts == alone
    assert [value for _, value, _ in a.heard] != [value for _, value, _ in b.heard]


def test_at_a_rate_messages_wait_and_what_finds_no_place_is_dropped():
    size = len(imc.encode(imc.Depth()))
    (_, b), (channel,) = talk(link(rate=2.0 * size, queue=3), seconds=20.0)
    heard = [value for _, value, _ in b.heard]
    times = [delay for _, _, delay in b.heard]
    assert heard[:5] == [1, 2, 3, 4, 5]
    assert heard == sorted(set(heard))
    assert len(heard) == pytest.approx(40, abs=1)
    assert times[0] == pytest.approx(0.5)
    assert max(times) <= 2.0 + 1e-6, "three wait, and the one that is being sent"
    waiting = sum(len(end._waiting) + end._sending for end in channel.ends)
    assert channel.counts["sent"] + channel.counts["dropped"] + waiting <= 160
    assert channel.counts["dropped"] == pytest.approx(80, abs=8)


def test_only_the_named_messages_are_sent():
    (_, b), _ = talk(LinkModel("radio", ("a", "b"), messages=("Temperature",)))
    assert b.heard == []
    _, (channel,) = talk(LinkModel("radio", ("a", "b")), seconds=1.0)
    assert channel.counts["sent"] > 50, "all: states and heartbeats, too"


def test_a_link_of_three_and_chains_of_two():
    tasks, _ = talk(LinkModel("radio", ("a", "b", "c"), messages=("Depth",)), places=((0, 0), (1, 0), (2, 0)))
    for task in tasks:
        assert {source for source, _, _ in task.heard} == {1, 2, 3} - {task.system}
    chain = [LinkModel(f"{x}{y}", (x, y), messages=("Depth",)) for x, y in ("ab", "bc")]
    a, b, c = talk(*chain, places=((0, 0), (1, 0), (2, 0)))[0]
    assert [{source for source, _, _ in task.heard} for task in (a, b, c)] == [{2}, {1, 3}, {2}]


def test_what_is_on_its_way_to_one_that_leaves_is_not_delivered():
    with Fleet(VirtualClock(START * SECOND)) as fleet:
        made = [Vehicle(name, number, fleet=fleet, profile=NoProfile()) for number, name in enumerate("ab")]
        tasks = [vehicle.add(Talker, "Test.Talker") for vehicle in made]
        channel = link(latency=0.5, rate=100.0).open_channel(RunContext(fleet, dict(zip("ab", made, strict=True)), 0))
        fleet.start()
        fleet.run(2.0)
        made[1].stop()
        fleet.run(5.0)
        assert tasks[0].heard
        assert tasks[1].heard[-1][1] < 8
        assert channel.counts["sent"] > channel.counts["received"]
        assert tasks[0].said == 28


def test_vehicles_with_one_id_cannot_be_linked():
    with Fleet(VirtualClock(0)) as fleet:
        made = {name: Vehicle(name, 1, fleet=fleet, profile=NoProfile()) for name in "ab"}
        with pytest.raises(FleetError, match="radio joins vehicles with the same IMC id"):
            link().open_channel(RunContext(fleet, made, 0))


@settings(max_examples=40, deadline=None)
@given(
    latency=st.floats(0.0, 2.0),
    loss=st.sampled_from([0.0, 0.2, 1.0]),
    rate=st.sampled_from([math.inf, 20.0, 100.0, 1000.0]),
    queue=st.integers(0, 4),
    range_=st.sampled_from([math.inf, 50.0, 110.0]),
    propagation=st.sampled_from([math.inf, 30.0, 1500.0]),
    speed=st.floats(-20.0, 20.0),
    seed=st.integers(0, 3),
)
def test_any_link_delivers_at_most_once_in_order_and_never_to_the_sender(
    latency, loss, rate, queue, range_, propagation, speed, seed
):
    values = {"latency": latency, "loss": loss, "rate": rate, "queue": queue}
    any_link = link(**values, range=range_, propagation=propagation)
    places = ((0.0, 0.0), (100.0, speed))
    (a, b), (channel,) = talk(any_link, places=places, seed=seed)
    for task, other in ((a, b), (b, a)):
        heard = [value for _, value, _ in task.heard]
        assert {source for source, _, _ in task.heard} <= {other.system}
        assert heard == sorted(set(heard))
        assert all(1 <= value <= other.said for value in heard)
        assert all(delay >= latency - 1e-6 for _, _, delay in task.heard)
    counts = channel.counts
    done = counts["received"] + counts["lost"] + counts["out of range"]
    assert counts["received"] == len(a.heard) + len(b.heard)
    assert done <= counts["sent"] <= a.said + b.said
    again, (repeated,) = talk(any_link, places=places, seed=seed)
    assert ([task.heard for task in again], repeated.counts) == ([a.heard, b.heard], counts)


class TestChannel(TransportContract):
    @pytest.fixture
    def link(self):
        with Fleet(VirtualClock(0)) as fleet:
            made = {
                name: Vehicle(name, system, fleet=fleet, profile=NoProfile())
                for name, system in (("a", FIRST), ("b", SECOND_))
            }
            channel = LinkModel("radio", ("a", "b"), latency=0.1, rate=1e4, queue=1000).open_channel(
                RunContext(fleet, made, 0)
            )
            for vehicle in fleet.vehicles:
                vehicle.bus.release_backlog()
            yield Buses(*(vehicle.bus for vehicle in fleet.vehicles), channel.ends[0], fleet.kernel.run)
