"""A vehicle on zenoh sends what a view needs only while somebody looks at it."""

import asyncio
import json
import threading
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from types import SimpleNamespace

import pytest
import zenoh

import imc
from shoal.console.cameras.live_pictures import LivePictures
from shoal.console.health.dive_check_routes import DiveCheckRoutes
from shoal.console.page_feed import PageFeed, Viewer
from shoal.network import Network, NetworkSystem, ZenohLink
from tests.outside import PATIENCE
from tests.runtime.zenoh.processes import local_port

NAME = "pole"
SENT = (imc.Heartbeat(), imc.Temperature(value=4.0), imc.CompressedImage(), imc.GpsFix())


class Pole:
    """A system that sends four messages all the time, to those who have subscribed to them."""

    def __init__(self, session: zenoh.Session) -> None:
        self._publishers = {
            type(each).__name__: session.declare_publisher(f"imc/{NAME}/{type(each).__name__}/Sensor") for each in SENT
        }

    def send(self) -> None:
        for each in SENT:
            packet = imc.encode_with_header(each, time.time(), 0x0B01, 0, 0xFFFF, 0xFF)
            self._publishers[type(each).__name__].put(packet)

    def has_subscribers(self, name: str) -> bool:
        return self._publishers[name].matching_status.matching


@contextmanager
def running_pole() -> Iterator[tuple[Pole, str]]:
    endpoint, ended = f"tcp/127.0.0.1:{local_port()}", threading.Event()
    listen = {"mode": "peer", "listen": {"endpoints": [endpoint]}, "scouting": {"multicast": {"enabled": False}}}
    with zenoh.open(zenoh.Config.from_json5(json.dumps(listen))) as session:
        pole = Pole(session)

        def run() -> None:
            while not ended.wait(0.02):
                pole.send()

        thread = threading.Thread(target=run)
        thread.start()
        try:
            yield pole, endpoint
        finally:
            ended.set()
            thread.join()


async def until(is_true: Callable[[], object]) -> None:
    async with asyncio.timeout(PATIENCE):
        while not is_true():
            await asyncio.sleep(0.02)


def look(work: Callable[[Pole, Network, NetworkSystem], object]) -> None:
    async def act(pole: Pole, endpoint: str) -> None:
        async with Network([ZenohLink([endpoint])]) as network:
            with network.subscribe(None, (imc.Heartbeat,)):
                await until(lambda: NAME in network.systems)
                await work(pole, network, network.systems[NAME])

    with running_pole() as (pole, endpoint):
        asyncio.run(act(pole, endpoint))


@pytest.fixture(autouse=True)
def short_linger(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("shoal.network.message_requests.LINGER", 0.1)


def test_a_plot_ends_with_its_last_page_or_when_that_chooses_another_field() -> None:
    async def work(pole: Pole, network: Network, system: NetworkSystem) -> None:
        feed, pages = PageFeed(network), [Viewer(), Viewer()]
        for page in pages:
            feed.add(page)
            feed.set_fields(page, [f"{NAME}/Temperature.value"])
        await until(feed._values)
        feed.remove(pages[0])
        await asyncio.sleep(0.3)
        assert pole.has_subscribers("Temperature")
        feed.set_fields(pages[1], [f"{NAME}/GpsFix.hdop"])
        await until(lambda: not pole.has_subscribers("Temperature"))
        assert pole.has_subscribers("GpsFix")
        feed.remove(pages[1])
        await until(lambda: not pole.has_subscribers("GpsFix"))
        assert system.latest_message(imc.GpsFix) is not None
        feed.add(pages[0])
        feed.set_fields(pages[0], [f"{NAME}/GpsFix.hdop"])
        assert feed._values() == {}, "an old value is not a new one"
        assert pole.has_subscribers("Heartbeat")

    look(work)


def test_pictures_end_with_the_last_question(monkeypatch: pytest.MonkeyPatch) -> None:
    async def work(pole: Pole, network: Network, system: NetworkSystem) -> None:
        pictures = LivePictures(network)
        await pictures.describe(system)
        await until(lambda: pole.has_subscribers("CompressedImage"))
        await until(lambda: not pole.has_subscribers("CompressedImage"))

    monkeypatch.setattr("shoal.console.cameras.live_pictures.UNSEEN", 0.3)
    look(work)


def test_checks_end_with_their_answer() -> None:
    async def question() -> bytes:
        return json.dumps({"vehicle": NAME}).encode()

    async def work(pole: Pole, network: Network, system: NetworkSystem) -> None:
        request = SimpleNamespace(body=question, state=SimpleNamespace(refusal=""))
        asking = asyncio.create_task(DiveCheckRoutes(network)._answer(request))
        await until(lambda: pole.has_subscribers("GpsFix"))
        await asking
        await until(lambda: not pole.has_subscribers("GpsFix"))

    look(work)
