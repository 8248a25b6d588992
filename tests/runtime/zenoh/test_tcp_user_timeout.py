"""A link to a computer that falls silent ends in seconds, and is made again as soon as it can be."""

import socket
from pathlib import Path

import pytest

from runtime.zenoh import tcp_user_timeout
from tests.outside import lacking
from tests.runtime.zenoh.test_security import certificates
from tests.runtime.zenoh.test_strangers import played


@pytest.fixture(autouse=True)
def possible() -> None:
    if not tcp_user_timeout.POSSIBLE:
        lacking("the system has no TCP_USER_TIMEOUT")


def test_the_limit_is_set_at_the_wanted_sockets_only() -> None:
    with (
        socket.create_server(("127.0.0.1", 0)) as server,
        socket.create_server(("::1", 0), family=socket.AF_INET6) as six,
    ):
        near, six_near = (socket.create_connection(each.getsockname()[:2]) for each in (server, six))
        far, six_far = (each.accept()[0] for each in (server, six))
        here, there = socket.socketpair()  # without addresses
        wanted = {(each.getsockname()[:2], each.getpeername()[:2]) for each in (near, six_near)}
        assert tcp_user_timeout.set_timeout(wanted) == wanted
        options = [s.getsockopt(socket.IPPROTO_TCP, socket.TCP_USER_TIMEOUT) for s in (near, six_near, far, six_far)]
        assert options == [tcp_user_timeout.LONGEST, tcp_user_timeout.LONGEST, 0, 0]
        for each in (near, far, six_near, six_far, here, there):
            each.close()


@pytest.mark.heavy
def test_a_cut_between_the_computers_of_a_vehicle_is_reported_in_10_s_and_forgotten_5_s_after_its_end(
    namespace: list[str], openssl: str, tmp_path: Path
) -> None:
    certificates(openssl, tmp_path, "lauv-noptilus-1", address="10.99.0.1")
    seen = played(namespace, "cut", str(tmp_path))
    assert seen["noticed"] < 10.0
    assert seen["back"] < 5.0
