"""How often a console gets what a shipped vehicle sends, over UDP and TCP."""

import time

import pytest

import imc
from imc.discovery import Services
from tests.tasks.transports.imc_station import Station, afloat
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
