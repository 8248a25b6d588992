"""Commands of a page that come too often reach no vehicle, and none that lets go is late."""

import asyncio
import json
from collections.abc import Iterable

import pytest
from starlette.websockets import WebSocketDisconnect

from shoal.console.steering.remote_steering import NEUTRAL, StickPosition
from shoal.console.steering.steering_routes import BURST, RATE, SHORTEST_PERIOD, _StickLink
from support.token_bucket import TokenBucket

AHEAD = StickPosition(ahead=1.0)


class Page:
    """Sends commands, each after a pause (s), and closes."""

    def __init__(self, commands: Iterable[tuple[float, bool]]) -> None:
        self.commands = iter(commands)
        self.tick = 0

    async def receive_text(self) -> str:
        found = next(self.commands, None)
        if found is None:
            raise WebSocketDisconnect
        pause, held = found
        await asyncio.sleep(pause)
        return json.dumps({"tick": self.tick, "held": held, "ahead": 1.0})

    async def send_text(self, text: str) -> None:
        self.tick = json.loads(text)["tick"]


class Steering:
    offer: frozenset[str] = frozenset()

    def __init__(self) -> None:
        self.sent: list[StickPosition] = []

    def send(self, stick: StickPosition) -> None:
        self.sent.append(stick)

    def check(self) -> None:
        pass


def steer(commands: Iterable[tuple[float, bool]]) -> tuple[str, list[StickPosition]]:
    """The reason of the end, and what has reached the vehicle."""

    async def run() -> tuple[str, list[StickPosition]]:
        steering = Steering()
        link = _StickLink(Page(commands), steering, TokenBucket(RATE, BURST), lambda: None)
        return await link.run(), steering.sent

    return asyncio.run(run())


def test_a_flood_of_commands_ends_the_steering_and_is_not_relayed() -> None:
    reason, sent = steer((0.0, False) for _ in range(10_000))
    assert reason == "its page sends more than 50 commands a second"
    assert len(sent) < 5
    assert sent[-1] == NEUTRAL


@pytest.mark.parametrize("pause", [0.0, SHORTEST_PERIOD / 4])
def test_the_vehicle_is_let_go_at_once_and_not_again_and_again(pause: float) -> None:
    steady = [(SHORTEST_PERIOD * 1.5, True)] * 3
    reason, sent = steer([*steady, *[(pause, False)] * 8, (0.0, True)])
    assert reason == "its page is closed"
    assert sent.index(NEUTRAL) == len(steady), sent
    assert sent[: len(steady)] == [AHEAD] * len(steady)
    assert len(sent) < len(steady) + 5
