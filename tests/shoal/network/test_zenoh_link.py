"""The end of a link to zenoh."""

import asyncio
import threading
import time

import pytest
import zenoh

from shoal.network import Network, ZenohLink
from tests.runtime.zenoh.processes import local_port


def test_no_thread_is_in_zenoh_when_a_command_ends(monkeypatch: pytest.MonkeyPatch) -> None:
    """Else the exit status of a command that looks for a vehicle over UDP is often 134, an abort."""
    join = zenoh.open

    def join_slowly(config: zenoh.Config) -> zenoh.Session:
        time.sleep(0.1)
        return join(config)

    async def look() -> None:
        async with Network([ZenohLink([f"tcp/127.0.0.1:{local_port()}"])]):
            await asyncio.sleep(0.5)  # it has been refused, and is tried again

    monkeypatch.setattr(zenoh, "open", join_slowly)
    asyncio.run(look())
    assert not [thread.name for thread in threading.enumerate() if thread.name == "zenoh open"]
