"""A server that waits less long than on a vehicle before it takes a silent peer for a console."""

import pytest

from tests.tasks.transports.tcp.peers import SILENT_FOR


@pytest.fixture(autouse=True)
def impatient(monkeypatch):
    monkeypatch.setattr("tasks.transports.tcp.server.SILENT_FOR", SILENT_FOR)
