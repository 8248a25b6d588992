"""Detections of a vehicle get places for the map."""

import asyncio
import json
import math
from types import SimpleNamespace

import imc
from shoal.console.charts.detections import MOST, Detections
from shoal.network import MessageListener
from support.wgs84 import offset

LAT, LON = math.radians(41.185), math.radians(-8.7062)
HERE = imc.EstimatedState(lat=LAT, lon=LON, x=10.0)


class FakeNetwork:
    """Gives what is put into its listener, and counts the listeners that are open."""

    def __init__(self) -> None:
        self.opened = 0

    def listen(self, system: object, kinds: tuple) -> MessageListener:
        self.opened += 1
        self.listener = MessageListener(None, kinds, None)
        return self.listener

    def close_listener(self, listener: MessageListener) -> None:
        self.opened -= 1

    def bring(self, *messages: imc.Message, name: str = "a") -> None:
        for message in messages:
            self.listener.put(SimpleNamespace(name=name, id=1), message, b"")


def ask(*messages: imc.Message, of: str = "a") -> list[dict]:
    async def act() -> list[dict]:
        network = FakeNetwork()
        detections = Detections(network)
        request = SimpleNamespace(query_params={"vehicle": of})
        await detections.answer(request)
        network.bring(*messages)
        answer = json.loads((await detections.answer(request)).body)
        assert network.opened == 1
        detections.close()
        assert network.opened == 0
        return answer["objects"]

    return asyncio.run(act())


def test_an_offset_counts_from_the_vehicle_and_the_latest_place_counts():
    (found,) = ask(HERE, imc.EstimatedMugState(id=3, x=9.0), HERE, imc.EstimatedMugState(id=3, x=5.0, y=-2.0))
    north, east = offset(LAT, LON, math.radians(found["lat"]), math.radians(found["lon"]))
    assert (round(north, 1), round(east, 1), found["label"]) == (15.0, -2.0, "glider 3")
    assert 0.0 <= found["age"] < 5.0


def test_targets_have_their_label_and_bad_ones_are_left_out():
    nowhere = imc.Target(label="x", lat=math.nan)
    bad = imc.EstimatedMugState(id=1, x=math.inf)
    early = imc.EstimatedMugState(id=2)
    (found,) = ask(early, nowhere, HERE, bad, imc.Target(label="<b>mine\x1b", lat=LAT, lon=LON))
    assert found["label"].startswith("<b>mine")
    assert "\x1b" not in found["label"]
    assert ask(HERE, imc.EstimatedMugState(id=3), of="another") == []


def test_so_many_objects_are_kept_and_no_more():
    found = ask(HERE, *(imc.EstimatedMugState(id=number) for number in range(MOST + 5)))
    assert len(found) == MOST
    assert found[-1]["label"] == f"glider {MOST + 4}"
