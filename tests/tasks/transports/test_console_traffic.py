"""How often a console gets what a shipped vehicle sends, over UDP and TCP."""

import socket
import time

import pytest

import imc
from imc.discovery import Services
from tasks.transports.imc_links.stream_links import QUIET
from tests.tasks.transports.imc_station import CONSOLE, Station, afloat
from tests.tasks.transports.tcp.peers import Peer, packet

SECONDS = 3.0


@pytest.fixture(scope="module")
def vessel(tmp_path_factory):
    with afloat(tmp_path_factory.mktemp("console"), "Transports.TCP.Server:Port=0") as vehicle:
        yield vehicle


@pytest.mark.heavy
def test_one_heartbeat_a_second_comes_over_udp_and_over_tcp(vessel):
    peer = Peer.of(vessel.vehicle.task("Transports.TCP.Server").open_port)
    peer.send(packet(imc.Heartbeat()))
    console = Station(vessel).join()
    console.get(imc.Heartbeat)
    vessel.until(lambda: peer.of_type(imc.Heartbeat))
    peer.heard.clear()
    over_udp = console.during(SECONDS, imc.Heartbeat)
    assert 2 <= len(over_udp) <= 4
    assert 2 <= len(peer.of_type(imc.Heartbeat)) <= 4


def test_the_announce_that_begins_a_log_stays_in_the_log(vessel):
    """It names no run of the vehicle: Neptus took it for a second vehicle with the same id."""
    announced = vessel.hears(imc.Announce)
    peer = Peer.of(vessel.vehicle.task("Transports.TCP.Server").open_port)
    request = imc.LoggingControl(op=imc.LoggingControl.Op.REQUEST_START, name="next")
    time.sleep(0.1)
    peer.send(packet(request))
    vessel.until(lambda: [other for other in announced if not Services.parse(other.services).uid])
    vessel.until(lambda: peer.of_type(imc.Announce))
    assert all(Services.parse(other.services).uid for other in peer.of_type(imc.Announce))


class DoubleConsole:
    """A console on UDP and TCP, with a Heartbeat over each of `alive` every half second, as Neptus sends them."""

    def __init__(self, vessel, tcp_address="127.0.0.1"):
        self.alive = {"udp", "tcp"}
        self.station = Station(vessel).join()
        port = vessel.vehicle.task("Transports.TCP.Server").open_port
        self.peer = Peer(socket.create_connection(("127.0.0.1", port), source_address=(tcp_address, 0)))
        self.peer.send(packet(imc.Heartbeat(), CONSOLE))
        vessel.until(lambda: self.peer.of_type(imc.EstimatedState))

    def during(self, seconds):
        """The messages of some seconds: over UDP, over TCP."""
        self.peer.take()
        self.peer.heard.clear()
        over_udp = []
        self.station.packets()
        for _ in range(round(seconds / 0.5)):
            if "udp" in self.alive:
                self.station.send(imc.Heartbeat())
            if "tcp" in self.alive:
                self.peer.send(packet(imc.Heartbeat(), CONSOLE))
            over_udp += self.station.during(0.5)
        return over_udp, list(self.peer.take())


def kinds(messages):
    return {type(message) for message in messages}


@pytest.mark.heavy
def test_a_console_on_udp_and_tcp_gets_everything_once(vessel):
    console = DoubleConsole(vessel)
    over_udp, over_tcp = console.during(4.0)
    both = {imc.EstimatedState, imc.EntityState, imc.Heartbeat, imc.PlanControlState, imc.VehicleState}
    assert both <= kinds(over_tcp)
    assert not kinds(over_udp) & {*both, imc.LogBookEntry}
    assert imc.AngularVelocity in kinds(over_udp) - kinds(over_tcp)  # the server does not list it

    console.alive.remove("tcp")  # its connection stays open, and is read no longer, for all that is known
    console.during(QUIET)
    assert both <= kinds(console.during(2.0)[0])

    console.alive.add("tcp")
    console.during(0.5)
    assert not kinds(console.during(2.0)[0]) & both
    console.peer.socket.close()
    console.alive.remove("tcp")
    assert both <= kinds(console.during(2.0)[0])
    console = DoubleConsole(vessel)  # it has started again
    over_udp, over_tcp = console.during(2.0)
    assert both <= kinds(over_tcp)
    assert not kinds(over_udp) & both


@pytest.mark.heavy
def test_a_stranger_with_the_id_of_a_console_takes_nothing_from_it(vessel):
    console = DoubleConsole(vessel, tcp_address="127.0.0.2")
    over_udp, over_tcp = console.during(2.0)
    assert {imc.EstimatedState, imc.VehicleState} <= kinds(over_udp) & kinds(over_tcp)
