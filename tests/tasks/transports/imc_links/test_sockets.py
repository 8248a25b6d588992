"""Sockets of announcements on the loopback interface, and services as two sides of a network see them."""

import contextlib
import socket
import time

import pytest

import imc
from imc.discovery import MULTICAST, Endpoint, Service, Services
from runtime.network_interfaces import interfaces
from runtime.udp_sockets import bind_udp_socket
from tasks.transports.imc_links.own_announce import EXTERNAL, LOCAL, announcement, external_services, loopback_services
from tasks.transports.imc_links.recvmmsg import make_datagram_reader, read_one_by_one
from tasks.transports.imc_links.sockets import open_announce_receivers, open_announce_sender
from tests.outside import IN_USE


@pytest.fixture
def port():
    with bind_udp_socket("127.0.0.1", 0) as probe:
        return probe.getsockname()[1]


def test_the_port_of_announcements_is_shared_with_nobody(port):
    with contextlib.ExitStack() as stack:
        for each in open_announce_receivers("127.0.0.1", port):
            stack.enter_context(each)
        with pytest.raises(OSError, match=IN_USE):
            open_announce_receivers("127.0.0.1", port)
        with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as other:
            other.setsockopt(socket.SOL_SOCKET, socket.SO_REUSEADDR, 1)
            with pytest.raises(OSError, match=IN_USE):
                other.bind(("", port))


def test_an_announcement_to_the_group_on_loopback_arrives(port):
    with contextlib.ExitStack() as stack:
        receivers = [stack.enter_context(each) for each in open_announce_receivers("127.0.0.1", port)]
        sender = stack.enter_context(open_announce_sender("127.0.0.1"))
        sender.setsockopt(socket.IPPROTO_IP, socket.IP_MULTICAST_LOOP, 1)
        sender.sendto(b"group", (MULTICAST, port))
        sender.sendto(b"own", ("127.0.0.1", port))
        time.sleep(0.05)
        assert sorted(d for each in receivers for d, _, _ in read_one_by_one(each)) == [b"group", b"own"]


def test_every_way_of_reading_gives_the_same_datagrams():
    sent = [bytes([i]) * (i * 500) for i in range(100)] + [b"", bytes(65507)]
    for read in (make_datagram_reader(), read_one_by_one):
        with bind_udp_socket("127.0.0.1", 0) as receiver, bind_udp_socket("127.0.0.1", 0) as sender:
            found = []
            for data in sent:
                sender.sendto(data, receiver.getsockname())
                found += read(receiver)
            assert found == [(data, *sender.getsockname()) for data in sent]
            for _ in range(100):
                sender.sendto(b"x", receiver.getsockname())
            counts = [len(read(receiver)) for _ in range(3)]
            assert counts == [64, 36, 0]


def test_the_loopback_interface_is_found():
    assert any(each.is_loopback and each.address == "127.0.0.1" for each in interfaces())


def test_services_are_shown_as_each_side_reaches_them():
    offered = [
        (Service("imc+udp", "0.0.0.0", 6002), LOCAL | EXTERNAL),
        (Service("imc+tcp", "127.0.0.1", 6006), LOCAL | EXTERNAL),
        (Service("ftp", "10.0.0.7", 30021), LOCAL | EXTERNAL),
        (Service("http", "0.0.0.0", 8080, "/dune"), EXTERNAL),
    ]
    local = Services(tuple(loopback_services(offered)))
    assert local.endpoints("imc+udp") == (Endpoint("127.0.0.1", 6002),)
    assert local.endpoints("imc+tcp") == (Endpoint("127.0.0.1", 6006),)
    assert local.endpoints("http") == ()
    external = Services(tuple(external_services(offered, ["10.0.0.7", "10.1.0.7"])))
    assert external.endpoints("imc+udp") == (Endpoint("10.0.0.7", 6002), Endpoint("10.1.0.7", 6002))
    assert external.endpoints("imc+tcp") == (), "nobody else reaches the loopback address"
    assert external.endpoints("ftp") == (Endpoint("10.0.0.7", 30021),)
    assert "http://10.1.0.7:8080/dune" in str(external)


def test_an_announce_without_a_position_says_unknown():
    message = announcement("otter", "usv", imc.EstimatedState(), "")
    assert (message.lat, message.lon, message.sys_type, message.owner) == (0.0, 0.0, imc.SystemType.USV, 0xFFFF)
    assert announcement("otter", "usv", imc.EstimatedState(lat=0.7, x=10.0), "").lat > 0.7
