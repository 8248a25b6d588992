"""A part of the console that fails ends it: a page that stands still would look alive."""

import asyncio

import pytest

from shoal.console import ConsoleServer
from shoal.console.page_feed import PageFeed
from shoal.network import Network


async def serve(server: ConsoleServer) -> None:
    await asyncio.wait_for(server.serve(asyncio.Event()), 10.0)


def test_frames_that_fail_end_the_server(monkeypatch):
    def fail(feed):
        raise ZeroDivisionError

    monkeypatch.setattr(PageFeed, "_read_messages", fail)

    async def run() -> None:
        async with Network([]) as network:
            await serve(ConsoleServer(network))

    with pytest.raises(ZeroDivisionError):
        asyncio.run(run())


def test_the_server_ends_when_it_is_stopped():
    async def run() -> None:
        stopped = asyncio.Event()
        stopped.set()
        async with Network([]) as network:
            await asyncio.wait_for(ConsoleServer(network).serve(stopped), 10.0)

    asyncio.run(run())
