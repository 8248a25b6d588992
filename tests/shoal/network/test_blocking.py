"""The connection for programs without asyncio, and its end while another thread uses it."""

import asyncio
import threading

import pytest

from shoal.network.blocking import LoopThread
from shoal.network.link import NetworkError
from tests.outside import until


def test_who_waits_in_another_thread_learns_that_the_connection_is_closed() -> None:
    portal, told, ended = LoopThread(), list[str](), list[str]()
    waits = threading.Event()

    async def wait_for_ever() -> None:
        waits.set()
        try:
            await asyncio.Event().wait()
        finally:
            await asyncio.sleep(0.01)
            ended.append("in order")

    def ask() -> None:
        try:
            portal.call(wait_for_ever())
        except NetworkError as error:
            told.append(str(error))

    thread = threading.Thread(target=ask, daemon=True)
    thread.start()
    assert waits.wait(10.0)
    portal.close()
    until(lambda: told)
    assert told == ["the connection to the vehicle has been closed"]
    assert ended == ["in order"]
    thread.join()
    with pytest.raises(NetworkError, match="has been closed"):
        portal.call(wait_for_ever())
