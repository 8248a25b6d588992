"""UDP sockets as tasks, devices and consoles open them."""

import errno
import os
import socket

import pytest

from runtime.network_interfaces import LOOPBACK
from runtime.udp_sockets import bind_udp_socket, join_multicast_group, source_address


def test_a_port_has_one_socket_that_does_not_wait():
    with bind_udp_socket(LOOPBACK, 0, 1 << 16) as opened:
        assert opened.getsockopt(socket.SOL_SOCKET, socket.SO_RCVBUF) >= 1 << 16
        with pytest.raises(BlockingIOError):
            opened.recv(1)
        with pytest.raises(OSError, match=os.strerror(errno.EADDRINUSE)):
            bind_udp_socket(*opened.getsockname())


def test_what_is_no_address_or_port_is_an_error():
    with pytest.raises(OSError, match=os.strerror(errno.EADDRNOTAVAIL)):
        bind_udp_socket("192.0.2.1", 0)
    with pytest.raises(OverflowError):
        bind_udp_socket(LOOPBACK, 65536)


def test_an_interface_that_is_not_there_keeps_no_other_from_joining():
    group = "239.255.77.77"
    with bind_udp_socket("0.0.0.0", 0) as receiver, bind_udp_socket(LOOPBACK, 0) as sender:
        join_multicast_group(receiver, group, ["192.0.2.1", LOOPBACK])
        sender.setsockopt(socket.IPPROTO_IP, socket.IP_MULTICAST_IF, socket.inet_aton(LOOPBACK))
        sender.sendto(b"hello", (group, receiver.getsockname()[1]))
        receiver.settimeout(5.0)
        assert receiver.recv(10) == b"hello"


def test_the_way_to_this_computer_is_loopback():
    assert source_address(LOOPBACK, 9) == LOOPBACK
