"""What tests use of the world outside them is there for them alone."""

import itertools
import socket

import pytest

from tests import outside
from tests.outside import free_ports


@pytest.mark.parametrize("kind", [socket.SOCK_DGRAM, socket.SOCK_STREAM])
def test_a_free_port_is_used_neither_with_udp_nor_with_tcp(
    kind: socket.SocketKind, monkeypatch: pytest.MonkeyPatch
) -> None:
    with socket.socket(type=kind) as other:
        other.bind(("127.0.0.1", 0))
        taken = other.getsockname()[1]
        monkeypatch.setattr(outside, "PORTS", itertools.chain([taken], outside.PORTS))
        ports = free_ports(2)
    assert len(set(ports)) == 2
    assert taken not in ports


def test_a_free_port_is_none_that_the_system_gives_to_the_client_of_another_test() -> None:
    with socket.create_server(("127.0.0.1", 0)) as server, socket.create_connection(server.getsockname()) as client:
        assert max(free_ports(20)) < min(server.getsockname()[1], client.getsockname()[1])
