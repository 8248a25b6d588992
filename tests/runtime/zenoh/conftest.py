"""Fixtures of tests with zenoh sessions in several processes."""

from collections.abc import Iterator

import pytest

from tests.runtime.zenoh.processes import Network


@pytest.fixture
def network() -> Iterator[Network]:
    network = Network()
    yield network
    for process in network.processes:
        process.end()
