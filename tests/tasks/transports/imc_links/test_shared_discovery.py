"""Who leads and who follows, where one listens for all."""

import errno
import os
import resource
import socket

import pytest

from runtime import Task
from runtime.kernel import WallClock
from runtime.testing import NoProfile
from runtime.vehicle import Vehicle
from tasks.transports.imc_links import shared_discovery
from tasks.transports.imc_links.shared_discovery import DiscoveryFollower, DiscoveryLeader
from tests.outside import until


class Listening(Task):
    """Owns sockets."""


@pytest.fixture
def task():
    vehicle = Vehicle("pole", 1, clock=WallClock(), profile=NoProfile())
    found = vehicle.add(Listening, "Listening")
    vehicle.start()
    yield found
    vehicle.close()


@pytest.fixture
def name():
    return f"test-{os.getpid()}"


def run(task, condition=lambda: True):
    """Run the vehicle until a condition holds, at least for a moment."""
    until(lambda: (task.vehicle.run(0.05), condition())[1])


def test_all_followers_get_each_packet_and_one_that_goes_is_forgotten(task, name):
    leader, heard, ended = DiscoveryLeader(task, name), [], []
    followers = [
        DiscoveryFollower(task, name, lambda *words: heard.append(words), lambda: ended.append(1)) for _ in range(3)
    ]
    run(task)
    leader.forward("10.0.0.7", b"packet")
    run(task, lambda: len(heard) >= 3)
    assert heard == [(b"packet", "10.0.0.7")] * 3
    followers[0].close()
    leader.forward("10.0.0.7", b"another")
    run(task, lambda: len(heard) >= 5)
    assert heard[3:] == [(b"another", "10.0.0.7")] * 2
    leader.close()
    run(task, lambda: len(ended) >= 2)
    assert ended == [1, 1]


def test_only_one_leads_and_without_one_nobody_follows(task, name):
    with pytest.raises(ConnectionRefusedError):
        DiscoveryFollower(task, name, print, print)
    leader = DiscoveryLeader(task, name)
    with pytest.raises(FileExistsError):
        DiscoveryLeader(task, name)
    leader.close()
    DiscoveryLeader(task, name).close()


def test_a_follower_that_does_not_read_stops_nobody(task, name):
    leader, heard = DiscoveryLeader(task, name), []
    deaf = DiscoveryFollower(task, name, print, print)
    task.vehicle.kernel.unwatch(deaf._socket)
    DiscoveryFollower(task, name, lambda packet, _: heard.append(packet), print)
    run(task)
    for number in range(200):
        leader.forward("127.0.0.1", bytes(4000) + bytes([number]))
        task.vehicle.run(0.001)
    run(task, lambda: len(heard) >= 200)
    assert [packet[-1] for packet in heard] == list(range(200))
    deaf._socket.close()


def test_without_file_descriptors_the_leader_waits(task, name, monkeypatch):
    tries, accept = [], DiscoveryLeader._accept
    monkeypatch.setattr(DiscoveryLeader, "_accept", lambda leader: (tries.append(1), accept(leader)))
    DiscoveryLeader(task, name)
    follower = DiscoveryFollower(task, name, print, print)
    run(task)
    assert follower.welcome
    limits = resource.getrlimit(resource.RLIMIT_NOFILE)
    surplus = DiscoveryFollower(task, name, print, print)
    tries.clear()
    os.close(first_free := os.dup(0))
    resource.setrlimit(resource.RLIMIT_NOFILE, (first_free, limits[1]))
    try:
        task.vehicle.run(0.25)
    finally:
        resource.setrlimit(resource.RLIMIT_NOFILE, limits)
    assert 1 <= len(tries) <= 4
    task.vehicle.run(0.25)
    assert surplus.welcome


def test_a_follower_counts_the_silence_since_the_last_sign_of_life(task, name):
    leader, heard = DiscoveryLeader(task, name), []
    follower = DiscoveryFollower(task, name, lambda *words: heard.append(words), print)
    assert not follower.welcome
    run(task)
    assert follower.welcome
    assert [follower.count_silence(), follower.count_silence()] == [1, 2]
    leader.pulse()
    run(task)
    assert follower.count_silence() == 1
    assert not heard


def test_a_program_of_another_user_is_not_followed(task, name, monkeypatch):
    DiscoveryLeader(task, name)
    place = shared_discovery._place(name)
    monkeypatch.setattr(shared_discovery, "_place", lambda _: place)
    monkeypatch.setattr(os, "getuid", lambda: 4711)
    monkeypatch.setattr(shared_discovery, "ROOT", 4712)
    with pytest.raises(PermissionError):
        DiscoveryFollower(task, name, print, print)


def test_where_there_are_no_such_sockets_that_is_said(task, name, monkeypatch):
    def refuse(*_):
        raise OSError(errno.EPROTONOSUPPORT, "not supported")

    monkeypatch.setattr(socket, "socket", refuse)
    with pytest.raises(OSError, match="not supported"):
        DiscoveryLeader(task, name)
