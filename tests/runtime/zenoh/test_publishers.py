"""Telemetry that nobody receives is numbered, but not put."""

import json
from collections.abc import Iterator
from typing import Any

import pytest
import zenoh

from runtime.zenoh import publishers
from runtime.zenoh.publishers import NumberedPublisher
from tests.outside import until
from tests.runtime.zenoh.processes import local_port


class Recorded:
    """A publisher, and how often it was used."""

    def __init__(self, publisher: zenoh.Publisher) -> None:
        self.puts = 0
        self.id = publisher.id
        self.declare_matching_listener: Any = publisher.declare_matching_listener
        self._put: Any = publisher.put

    def put(self, packet: bytes, **more: Any) -> None:
        self.puts += 1
        self._put(packet, **more)


def session(mode: str, **endpoints: str) -> zenoh.Session:
    config: Any = zenoh.Config()
    config.insert_json5("mode", json.dumps(mode))
    config.insert_json5("scouting/multicast/enabled", "false")
    for way, place in endpoints.items():
        config.insert_json5(f"{way}/endpoints", json.dumps([place]))
    return zenoh.open(config)


@pytest.fixture
def recorded() -> Iterator[tuple[Any, zenoh.Session]]:
    """A publisher, and a session elsewhere that may subscribe."""
    place = f"tcp/127.0.0.1:{local_port()}"
    with session("peer", listen=place) as ours, session("client", connect=place) as theirs:
        declare: Any = ours.declare_publisher
        yield Recorded(declare("imc/pole/Temperature/Tank", allowed_destination=zenoh.Locality.REMOTE)), theirs


def test_packets_that_nobody_receives_are_numbered_but_not_put(
    recorded: tuple[Any, zenoh.Session], monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(publishers, "SETTLING", 0.0)
    publisher, elsewhere = recorded
    numbered, heard, sent = NumberedPublisher(publisher), list[int](), 0

    def put() -> int:
        """How many packets this one made the publisher put."""
        nonlocal sent
        sent, before = sent + 1, publisher.puts
        numbered.put(b"20.5")
        return publisher.puts - before

    def take(sample: zenoh.Sample) -> None:
        assert sample.source_info is not None
        heard.append(sample.source_info.source_sn)

    for _ in range(2):
        until(lambda: not put())
        heard.clear()
        assert sum(put() for _ in range(10)) == 0
        subscriber = elsewhere.declare_subscriber("imc/pole/**", take)
        until(lambda: bool(put()))
        assert all(put() for _ in range(10))
        until(lambda: heard[-1:] == [sent])
        assert heard == list(range(sent - 10, sent + 1))
        subscriber.undeclare()


def test_a_new_publisher_puts_all_since_it_may_not_know_its_receivers_yet(
    recorded: tuple[Any, zenoh.Session],
) -> None:
    publisher, _ = recorded
    numbered = NumberedPublisher(publisher)
    for _ in range(10):
        numbered.put(b"20.5")
    assert publisher.puts == 10
