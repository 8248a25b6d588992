"""Large answers of a shipped vehicle go to the console that has asked for them, and to no other one."""

import pytest

import imc
from imc.reserved_ids import UNKNOWN_ENTITY
from tests.tasks.transports.imc_station import Station, afloat
from tests.tasks.transports.tcp.peers import Peer, packet

OWN = 0x001A
REQUEST = imc.ImageTxSettings(fps=2, dst=OWN, dst_ent=UNKNOWN_ENTITY)
FAR = 0x4201  # a console that is connected by TCP


@pytest.fixture
def vessel(tmp_path):
    with afloat(tmp_path, "Transports.TCP.Server:Port=0") as vehicle:
        yield vehicle


def connect(vessel, system):
    """A console that is connected by TCP, and gets what is sent."""
    peer = Peer.of(vessel.vehicle.task("Transports.TCP.Server").open_port)
    peer.send(packet(imc.Heartbeat(), system))
    vessel.until(lambda: peer.of_type(imc.EstimatedState))
    return peer


def take_pictures(vessel, got):
    """Publish pictures until `got`."""
    camera = vessel.vehicle.task("Transports.LogBook")

    def publish():
        camera.publish(imc.CompressedImage(data=b"picture"))

    vessel.until(lambda: vessel.vehicle.kernel.post(publish) or got())


def test_pictures_go_to_who_has_asked_over_udp_and_tcp(vessel):
    near, other = Station(vessel, 0x4200).join(), Station(vessel, 0x4202).join()
    far, silent, seen = connect(vessel, FAR), connect(vessel, 0x4203), []
    near.send(REQUEST)
    take_pictures(vessel, lambda: seen.extend(near.messages(imc.CompressedImage)) or seen)
    assert other.messages(imc.CompressedImage) + far.of_type(imc.CompressedImage) == []
    far.send(packet(REQUEST, FAR))
    take_pictures(vessel, lambda: far.of_type(imc.CompressedImage))
    assert other.messages(imc.CompressedImage) + silent.of_type(imc.CompressedImage) == []


def test_pictures_that_were_asked_for_over_udp_come_by_the_connection_of_the_console(vessel):
    station, peer = Station(vessel, FAR).join(), connect(vessel, FAR)
    station.send(REQUEST)
    take_pictures(vessel, lambda: peer.of_type(imc.CompressedImage))
    assert station.messages(imc.CompressedImage) == []


def test_the_log_book_goes_to_who_has_asked_for_it(vessel):
    near, other, far = Station(vessel, 0x4200).join(), Station(vessel, 0x4202).join(), connect(vessel, FAR)
    near.send(imc.LogBookControl(command=imc.LogBookControl.Command.GET, dst=OWN))
    assert near.get(imc.LogBookControl).dst == near.system
    far.send(packet(imc.LogBookControl(command=imc.LogBookControl.Command.GET), FAR))
    vessel.until(lambda: far.of_type(imc.LogBookControl))
    assert [reply.dst for reply in far.of_type(imc.LogBookControl)] == [FAR]
    assert other.messages(imc.LogBookControl) == []
