"""Rates of all messages of a vehicle, by entity: counted only while a page asks for them."""

import asyncio
import time
from collections import deque
from collections.abc import Mapping
from typing import NamedTuple, Protocol

from starlette.requests import Request
from starlette.responses import Response

import imc
from runtime.logs import LogSummary, summarize, type_name
from shoal.console.json_request import Answer, json_response, refusal_response
from shoal.console.logs.log_link import LogLink
from shoal.console.page_part import PagePart
from shoal.network import Network
from support.terminal_text import printable

PERIOD = 1.0  # s between two looks at the counts
WINDOW = 10  # looks that a rate is made from
ASKED = 6.0  # s after a question in which counting continues
MOST_KINDS = 4096  # of messages and entities, of all vehicles
MOST_ROWS = 1000


class KindCount(NamedTuple):
    """Number of messages of a kind that were counted, and when the last one came (s since 1970 UTC)."""

    number: int
    last: float


Counts = Mapping[tuple[str, str, int], KindCount]
"""Counts by vehicle, message, and id of the entity."""


class MessageCounter(Protocol):
    """Counts the messages of vehicles between `start` and `stop`; `now` is the time by which it counts (s)."""

    def start(self) -> None: ...
    def stop(self) -> None: ...
    def counts(self) -> Counts: ...
    def now(self) -> float: ...


class NetworkCounter:
    """Counts what arrives from a network, which then sends all that it has."""

    def __init__(self, network: Network) -> None:
        self._network = network
        self._counts: dict[tuple[str, str, int], KindCount] = {}
        self._task: asyncio.Task[None] | None = None

    def start(self) -> None:
        self._counts = {}
        self._task = asyncio.create_task(self._count())

    def stop(self) -> None:
        if self._task is not None:
            self._task.cancel()

    def counts(self) -> Counts:
        return dict(self._counts)

    def now(self) -> float:
        return time.time()

    async def _count(self) -> None:
        listener = self._network.listen()
        try:
            while True:
                system, message = await listener.next()
                if message.src not in system.ids:
                    continue
                place = system.name, type(message).__name__, message.src_ent
                known = self._counts.get(place)
                if known is not None or len(self._counts) < MOST_KINDS:
                    self._counts[place] = KindCount(1 if known is None else known.number + 1, time.time())
        finally:
            self._network.close_listener(listener)


class RateRoutes(PagePart):
    """Answers about the rates of a vehicle's messages, now or in the whole log that `player` plays."""

    def __init__(self, network: Network, counter: MessageCounter | None = None, player: LogLink | None = None) -> None:
        self._network, self._player = network, player
        self._counter: MessageCounter = counter or NetworkCounter(network)
        self._looks: deque[tuple[float, Counts]] = deque(maxlen=WINDOW + 1)
        self._asked = 0.0
        self._task: asyncio.Task[None] | None = None
        self._summary: asyncio.Task[LogSummary] | None = None
        self.questions: Mapping[str, Answer] = {"/api/rates": self._answer if player is None else self._answer_of_log}

    def close(self) -> None:
        """End counting."""
        for task in (self._task, self._summary):
            if task is not None:
                task.cancel()

    async def _answer(self, request: Request) -> Response:
        """Rows of message, entity, count, rate (Hz, null in the first second), and age of the last one (s)."""
        self._asked = time.monotonic()
        if self._task is None:
            self._task = asyncio.create_task(self._look())
        system = self._network.systems.get(request.query_params.get("vehicle", ""))
        if system is None:
            return refusal_response("there is no such vehicle")
        if len(self._looks) < 2:
            return json_response({"ok": True, "rows": [], "seconds": 0})
        (began, before), (ended, now) = self._looks[0], self._looks[-1]
        seconds = max(ended - began, 1e-3)
        rows: list[list[object]] = []
        for place, found in now.items():
            if place[0] == system.name:
                earlier = before.get(place)
                rate = (found.number - (0 if earlier is None else earlier.number)) / seconds
                age = max(0.0, ended - found.last)
                rows.append([place[1], printable(system.label(place[2])), found.number, round(rate, 2), round(age, 1)])
        rows.sort(key=lambda row: (str(row[0]), str(row[1])))
        return json_response({"ok": True, "rows": rows[:MOST_ROWS], "seconds": round(seconds, 1)})

    async def _look(self) -> None:
        """Look at the counts until nobody asks any more."""
        self._looks.clear()
        self._counter.start()
        self._looks.append((self._counter.now(), {}))  # it may still have the counts of the time before
        try:
            while time.monotonic() - self._asked < ASKED:
                await asyncio.sleep(PERIOD)
                self._looks.append((self._counter.now(), self._counter.counts()))
        finally:
            self._counter.stop()
            self._task = None

    async def _answer_of_log(self, request: Request) -> Response:
        """The same over the whole log; ages are those at its present time, null if the last message is to come."""
        player, name = self._player, request.query_params.get("vehicle", "")
        assert player is not None
        if self._summary is None:
            self._summary = asyncio.create_task(asyncio.to_thread(_summarize, player))
        try:
            summary = await asyncio.shield(self._summary)
        except (OSError, ValueError) as error:
            self._summary = None
            return refusal_response(f"the log cannot be read: {error}")
        rows: list[list[object]] = []
        for (kind, source, entity), found in summary.tallies.items():
            if player.system_name(source) == name:
                label = summary.names.labels.get((source, entity), str(entity))
                rate, age = found.rate, player.now - found.last
                numbers = found.count, round(rate, 2) if rate == rate else None, round(age, 1) if age >= 0.0 else None
                rows.append([printable(type_name(summary.schema, kind)), printable(label), *numbers])
        rows.sort(key=lambda row: (str(row[0]), str(row[1])))
        return json_response({"ok": True, "rows": rows[:MOST_ROWS], "seconds": round(summary.duration, 1)})


def _summarize(player: LogLink) -> LogSummary:
    return summarize(imc.Log(player.states.path))
