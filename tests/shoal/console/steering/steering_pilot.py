"""A page's side of steering: commands that name the newest tick."""

import json
from collections.abc import Iterator
from contextlib import contextmanager
from threading import Event, Thread
from typing import Any

from websockets.exceptions import ConnectionClosed
from websockets.sync.client import ClientConnection, connect

from tests.outside import until

PERIOD = 0.2  # s


class SteeringPilot:
    """Sends `words` five times a second while it is not `frozen`; `news` is what the console has sent."""

    def __init__(self, socket: ClientConnection, vehicle: str) -> None:
        self._socket = socket
        self.news: list[dict[str, Any]] = []
        self.words: dict[str, object] = {"held": False}
        self.frozen, self.answers_ticks = False, True
        self._tick: int | None = None
        self._ended = Event()
        socket.send(json.dumps({"vehicle": vehicle}))
        for work in (self._read, self._send):
            Thread(target=work, daemon=True).start()

    def _read(self) -> None:
        try:
            for text in self._socket:
                self.news.append(json.loads(text))
                if self.answers_ticks:
                    self._tick = self.news[-1].get("tick", self._tick)
        except ConnectionClosed:
            pass
        self._ended.set()

    def _send(self) -> None:
        while not self._ended.wait(PERIOD):
            if self._tick is not None and not self.frozen:
                self.say(tick=self._tick, **self.words)

    def say(self, **words: object) -> None:
        try:
            self._socket.send(json.dumps(words))
        except ConnectionClosed:
            self._ended.set()

    def hold(self, **axes: float) -> None:
        self.words = {"held": True, **axes}

    @property
    def newest(self) -> dict[str, Any]:
        return self.news[-1] if self.news else {}

    def wait_until_steered(self) -> None:
        until(lambda: self.newest, told=lambda: self.news)
        assert self.newest["state"] == "steered", self.news

    def wait_for_end(self) -> str:
        """Why the steering has ended."""
        until(lambda: self.newest.get("state") == "ended", told=lambda: self.news[-3:])
        return self.newest["text"]

    def close(self) -> None:
        self._socket.close()


@contextmanager
def steering_pilot(page: Any, vehicle: str) -> Iterator[SteeringPilot]:
    """Steers in the name of who is logged in at a page."""
    with connect(
        f"ws://{page.host}/steering",
        origin=f"http://{page.host}",
        additional_headers={"Cookie": page.cookie},
        ping_interval=None,
    ) as socket:
        yield SteeringPilot(socket, vehicle)
