"""A viewer that does not read, beside one that does, on a server in this process."""

import asyncio
import json
import socket
from itertools import count

import pytest
from websockets.asyncio.client import connect

import imc
from shoal.console import ConsoleServer
from shoal.network import Network
from tests.outside import PATIENCE
from tests.shoal.console.foxglove.packet_radio import Radio

HEADER = {"src": 0x1A, "src_ent": 7, "timestamp": 1.7e9}
LABELS = imc.EntityList(op=imc.EntityList.Op.REPORT, list="Navigation=7", **HEADER)
SUBSCRIBE = json.dumps({"op": "subscribe", "subscriptions": [{"id": 5, "channelId": 1}]})
LONG = "x" * 1000


def connected(server, **options):
    return connect(server.foxglove_link(), subprotocols=["foxglove.sdk.v1"], compression=None, **options)


async def subscribe(viewer):
    while "advertise" not in (frame := await viewer.recv()) or "EntityList" not in frame:
        pass
    await viewer.send(SUBSCRIBE)
    while not isinstance(await viewer.recv(), bytes):
        pass


async def read(viewer, received):
    async for frame in viewer:
        received.append(frame)


async def drop_messages():
    """Send to both until the slow one loses messages; returns what it then reads, and what the other has received."""
    radio, stopped, received = Radio(), asyncio.Event(), []
    async with Network([radio]) as network:
        server = ConsoleServer(network)
        serving = asyncio.create_task(server.serve(stopped))
        radio.bring(LABELS)
        near = socket.socket()
        near.setsockopt(socket.SOL_SOCKET, socket.SO_RCVBUF, 4096)
        near.connect(("127.0.0.1", server.port))
        async with connected(server) as other, connected(server, sock=near, max_queue=1) as slow:
            await subscribe(other)
            await subscribe(slow)
            reading = asyncio.create_task(read(other, received))
            for number in count():
                radio.bring(LABELS.replace(list=f"Navigation=7;{LONG}{number}=8"))
                await asyncio.sleep(0.0 if number % 50 else 0.01)
                if number > 10_000:
                    break
            found = [frame async for frame in first_dropped(slow)]
            reading.cancel()
        stopped.set()
        await serving
    return found, received


async def first_dropped(viewer):
    """Frames up to the one that names the messages that were dropped."""
    async for frame in viewer:
        yield frame
        if isinstance(frame, str) and "dropped" in frame:
            return


@pytest.mark.heavy
def test_a_viewer_that_does_not_read_loses_the_oldest_and_delays_no_other():
    found, received = asyncio.run(asyncio.wait_for(drop_messages(), PATIENCE))
    said = json.loads(found[-1])
    assert (said["op"], said["level"], said["id"]) == ("status", 1, "dropped")
    assert int(said["message"].split()[0]) > 0
    assert len([frame for frame in received if isinstance(frame, bytes) and frame[0] == 1]) > 5000
