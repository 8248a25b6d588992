"""A viewer that sends too many frames waits; nothing that it asks for is lost."""

import asyncio
import json
import time
from contextlib import suppress

import pytest

from shoal.console.foxglove.routes import _read
from support.token_bucket import TokenBucket
from tests.shoal.console.foxglove.packet_radio import Radio
from tests.shoal.console.foxglove.viewer import Viewer
from tests.shoal.console.page_of_nobody import served_page

TEXT = json.dumps({"op": "getParameters", "parameterNames": []})


class Flood:
    """A socket on which frames never end; also the session that takes them."""

    def __init__(self, frame: str | bytes) -> None:
        self.frame = frame
        self.taken = 0

    async def receive(self) -> dict[str, object]:
        await asyncio.sleep(0)
        kind = "bytes" if isinstance(self.frame, bytes) else "text"
        return {"type": "websocket.receive", kind: self.frame}

    def take(self, frame: str | bytes) -> None:
        assert frame == self.frame
        self.taken += 1


@pytest.mark.parametrize(("frame", "cost"), [(TEXT, 1.0), (b"\x02" + bytes(10), 1.0), ("x" * 10_240, 11.0)])
def test_frames_that_come_without_a_pause_are_taken_at_the_rate_of_a_viewer(frame: str | bytes, cost: float) -> None:
    flood, rate, burst, seconds = Flood(frame), 100.0, 50.0, 0.5

    async def run() -> None:
        with suppress(TimeoutError):
            async with asyncio.timeout(seconds):
                await _read(flood, flood, TokenBucket(rate, burst))

    began = time.monotonic()
    asyncio.run(run())
    most = (burst + rate * (time.monotonic() - began)) / cost
    assert burst / cost / 2 < flood.taken <= most + 1


def test_the_frames_of_a_large_layout_are_taken_at_once_and_the_next_ones_a_little_later() -> None:
    with served_page(Radio()) as page:
        page.log_in()
        words = {"origin": f"http://{page.host}", "additional_headers": {"Cookie": page.cookie}}
        with Viewer(f"ws://{page.host}/foxglove", **words) as viewer:
            viewer.until(lambda: viewer.of("serverInfo"))
            for _ in range(2500):
                viewer.send("unsubscribeConnectionGraph")  # which has no answer
            viewer.send("unsubscribe", subscriptionIds=[7])
            began = time.monotonic()
            viewer.until(lambda: viewer.of("status"))
            assert time.monotonic() - began > 1.0
