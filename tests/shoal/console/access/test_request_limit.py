"""The limit to the requests of a session."""

import asyncio
from collections import Counter

from starlette.types import Receive, Scope, Send

from shoal.console.access.request_limit import BURST, COSTS, RequestLimit


async def answer(scope: Scope, receive: Receive, send: Send) -> None:
    await send({"type": "http.response.start", "status": 200})


def statuses(limit: RequestLimit, path: str, number: int, session: int = 1) -> Counter[int]:
    found: Counter[int] = Counter()

    async def send(message: dict) -> None:
        if message["type"] == "http.response.start":
            found[message["status"]] += 1

    async def run() -> None:
        for _ in range(number):
            await limit({"type": "http", "path": path, "session": session}, None, send)

    asyncio.run(run())
    return found


def make_limit() -> tuple[RequestLimit, list[float]]:
    now = [0.0]
    return RequestLimit(answer, lambda scope: scope["session"], lambda: now[0]), now


def test_a_session_that_asks_too_much_waits_and_no_other_one_does() -> None:
    limit, now = make_limit()
    assert statuses(limit, "/api/unknown", 1000) == {200: BURST, 429: 1000 - BURST}
    assert statuses(limit, "/api/unknown", 1, session=2) == {200: 1}
    now[0] = 1.0
    assert statuses(limit, "/api/unknown", 10) == {200: 10}


def test_what_costs_more_is_answered_less_often() -> None:
    limit, _ = make_limit()
    assert statuses(limit, "/api/checks", 1000) == {200: BURST // COSTS["/api/checks"], 429: 980}


def test_abort_passes_whatever_else_a_session_asks() -> None:
    limit, _ = make_limit()
    statuses(limit, "/api/plans", 1000)
    assert statuses(limit, "/api/order", 1) == {200: 1}
    assert statuses(limit, "/files/page.js", 100) == {200: 100}
