"""The end of a link to zenoh."""

import asyncio
import threading

import pytest
import zenoh

from shoal.network import Network, ZenohLink
from tests.outside import PATIENCE
from tests.runtime.zenoh.processes import local_port


def test_no_thread_is_in_zenoh_when_a_command_ends(monkeypatch: pytest.MonkeyPatch) -> None:
    """Else the exit status of a command that looks for a vehicle over UDP is often 134, an abort."""
    join, enters, may_leave = zenoh.open, threading.Event(), threading.Event()

    def join_slowly(config: zenoh.Config) -> zenoh.Session:
        enters.set()
        assert may_leave.wait(PATIENCE)
        return join(config)

    async def look() -> None:
        async with Network([ZenohLink([f"tcp/127.0.0.1:{local_port()}"])]):
            assert await asyncio.to_thread(enters.wait, PATIENCE)
            asyncio.get_running_loop().call_later(0.1, may_leave.set)  # while the link closes

    monkeypatch.setattr("shoal.network.zenoh_link.LAST_TRY", PATIENCE)
    monkeypatch.setattr(zenoh, "open", join_slowly)
    asyncio.run(look())
    assert not [thread.name for thread in threading.enumerate() if thread.name == "zenoh open"]
