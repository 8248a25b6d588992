"""A slow page loses old frames, and then gets everything anew; a track is complete although nobody looked."""

import asyncio
import json
from contextlib import suppress

import pytest

import imc
from imc.coordinates import absolute_position
from shoal.console.page_feed import PageFeed, Viewer
from shoal.network import Network, ReceivedPacket


class Link:
    """A network that brings nothing by itself."""

    name, delivers_all, fragment_size, trouble, awaits_answers, discovery_timeout = "bus", True, 0, "", False, 0.1

    async def open(self, listener, console):
        listener.on_appeared(self, "lauv-noptilus-1", "bus", "", 0x1A)

    def subscribe(self, system, messages):
        pass

    def unsubscribe(self, system, messages):
        return True

    def send(self, system, message, packet):
        pass

    async def close(self):
        pass


def test_a_page_that_misses_a_frame_gets_everything_anew():
    viewer = Viewer()
    viewer.needs_all = False
    for frame in (b"1", b"2"):
        viewer.put(frame)
    assert (viewer.needs_all, viewer.dropped) == (False, 0)
    viewer.put(b"3")
    assert (viewer.needs_all, viewer.dropped) == (True, 2)
    viewer.put(b"all")
    assert asyncio.run(viewer.next()) == b"all"


def test_the_first_frame_has_the_track_of_the_time_when_nobody_looked():
    async def first_frame():
        link, viewer = Link(), Viewer()
        async with Network([link]) as network:
            feed = PageFeed(network)
            run = asyncio.create_task(feed.run())
            await asyncio.sleep(0.1)
            for number in range(50):  # of 5 s
                state = imc.EstimatedState(lat=0.7, lon=-0.1, x=float(number))
                packet = imc.encode_with_header(state, 1000.0 + number / 10.0, 0x1A, 1, 0xFFFF, 0xFF)
                network.on_packet(link, ReceivedPacket(packet, "lauv-noptilus-1"))
            feed.add(viewer)
            frame = json.loads(await asyncio.wait_for(viewer.next(), 10.0))
            run.cancel()
            with suppress(asyncio.CancelledError):
                await run
            return frame

    (track,) = asyncio.run(first_frame())["tracks"].values()
    north = [imc.EstimatedState(lat=0.7, lon=-0.1, x=float(number)) for number in range(0, 50, 10)]
    assert [lat for lat, _, _ in track] == pytest.approx([absolute_position(s)[0] * 57.29578 for s in north], abs=1e-5)
