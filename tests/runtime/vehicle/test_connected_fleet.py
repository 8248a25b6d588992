"""Vehicles of one process that hear each other."""

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

import imc
from runtime import Task, consume, param, periodic
from runtime.bus import Bus
from runtime.kernel import SECOND, Kernel, VirtualClock
from runtime.testing import START, NoProfile
from runtime.vehicle import Fleet, FleetError, Vehicle
from runtime.vehicle.fleet import InProcessTransport
from shoal.missions import Mission, parse_plan, prepare
from tests.runtime.bus.transport_contract import FIRST, SECOND_, Link, TransportContract, Wire
from tests.runtime.vehicle.members import recorded, vehicle


class Gossip(Task):
    """Publishes numbers, and remembers those of others."""

    rate: float = param(10.0, "Hz", "Rate.")

    def configure(self) -> None:
        self.told = 0
        self.heard = []

    def start(self) -> None:
        self.tick()

    @periodic("rate")
    def tick(self) -> None:
        self.told += 1
        self.publish(imc.Depth(value=self.told))

    @consume(others=True)
    def hear(self, depth: imc.Depth) -> None:
        self.heard.append((depth.src, depth.value))
        if depth.value % 3 == 0:
            self.publish(imc.Temperature(value=depth.value))


def gossips(rates, *kinds, seconds=1.0):
    with Fleet(VirtualClock(0)) as fleet:
        tasks = []
        for number, rate in enumerate(rates):
            made = Vehicle(f"v{number}", number, fleet=fleet, profile=NoProfile())
            tasks.append(made.add(Gossip, "Test.Gossip", rate=rate))
        fleet.connect(*kinds)
        packets = [recorded(one) for one in fleet.vehicles]
        fleet.start()
        fleet.run(seconds)
    return tasks, packets


@settings(max_examples=30)
@given(st.lists(st.sampled_from([1.0, 3.0, 7.0, 50.0]), min_size=2, max_size=5), st.booleans())
def test_connected_vehicles_lose_nothing_and_keep_the_order(rates, everything):
    kinds = () if everything else (imc.Depth,)
    tasks, packets = gossips(rates, *kinds)
    for task in tasks:
        assert {source for source, _ in task.heard} == {other.system for other in tasks if other is not task}
        for other in tasks:
            if other is not task:
                assert [value for source, value in task.heard if source == other.system] == list(
                    range(1, other.told + 1)
                )
    strangers = {
        type(m) for system, mine in enumerate(packets) for m in map(imc.decode, mine) if m.src not in (system, 0xFFFF)
    }
    assert strangers >= {imc.Depth, imc.Heartbeat} if everything else strangers == {imc.Depth}
    assert gossips(rates, *kinds)[1] == packets


def test_one_that_joins_or_leaves_a_connected_fleet():
    with Fleet(VirtualClock(0)) as fleet:
        fleet.connect(imc.Depth)
        with pytest.raises(FleetError, match="already connected"):
            fleet.connect()
        first = Vehicle("first", 1, fleet=fleet, profile=NoProfile())
        task = first.add(Gossip, "Test.Gossip")
        with pytest.raises(FleetError, match=r"second and first have the same IMC id, 0x0001: .*\[IMC Addresses\]"):
            Vehicle("second", 1, fleet=fleet, profile=NoProfile())
        first.start()
        fleet.run(1.0)
        assert task.heard == []
        late = Vehicle("late", 2, fleet=fleet, profile=NoProfile())
        other = late.add(Gossip, "Test.Gossip", rate=0.0)
        late.start()
        fleet.run(0.05)
        late.stop()
        fleet.run(1.0)
    assert task.heard == [(2, 1.0)]
    assert [value for _, value in other.heard] == [12.0]


@pytest.mark.heavy
def test_whole_vehicles_that_hear_everything_of_each_other_do_their_own_plans(tmp_path):
    with Fleet(VirtualClock(START * SECOND)) as fleet:
        missions = []
        for number, name in enumerate(("lauv-noptilus-1", "lauv-noptilus-2")):
            made = prepare("lauv-noptilus-1", vehicle=name, seed=number, fleet=fleet, log_root=tmp_path)
            goto = f"{{north: {15 + 10 * number}, depth: 1, speed: 1.2 m/s}}"
            plan = parse_plan(f"plan: line {number}\norigin: 41.185°, -8.7062°\nmaneuvers: [goto: {goto}]")
            missions.append(Mission(made.vehicle, plan))
        fleet.connect()
        for mission in missions:
            mission.begin()
        fleet.run(120.0)
    first, second = (mission.report for mission in missions)
    assert first.completed
    assert second.completed
    assert second.distance - first.distance == pytest.approx(10.0, abs=2.0)


def test_a_fleet_is_not_connected_where_a_bus_reaches_further():
    with Fleet(VirtualClock(0)) as fleet:
        vehicle("far", fleet=fleet).bus.attach_transport(Wire())
        with pytest.raises(FleetError, match="bus of far is already connected to other processes"):
            fleet.connect()


class TestNeighbor(TransportContract):
    @pytest.fixture
    def link(self):
        kernel, buses = Kernel(VirtualClock(0)), []
        ends = [Bus(kernel, system) for system in (FIRST, SECOND_)]
        transports = [InProcessTransport(bus, buses, (imc.Message,)) for bus in ends]
        for bus, transport in zip(ends, transports, strict=True):
            bus.release_backlog()
            bus.attach_transport(transport)
        yield Link(*ends, transports[0], kernel.run)
        kernel.close()
