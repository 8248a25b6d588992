"""The limit to the requests of a session."""

import asyncio
from collections import Counter

from starlette.types import Receive, Scope, Send

from shoal.console.access.request_limit import BURST, COSTS, RequestLimit


async def answer(scope: Scope, receive: Receive, send: Send) -> None:
    await send(
        {"type": "http.response.start", "status": 200} if scope["type"] == "http" else {"type": "websocket.accept"}
    )


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


def accepted(limit: RequestLimit, path: str, number: int) -> int:
    """How many WebSockets of so many are opened, one after the other."""
    found: list[dict] = []

    async def run() -> None:
        for _ in range(number):
            await limit({"type": "websocket", "path": path, "session": 1}, None, send)

    async def send(message: dict) -> None:
        found.append(message)

    asyncio.run(run())
    assert all(each["code"] == 1013 for each in found if each["type"] == "websocket.close")
    return sum(each["type"] == "websocket.accept" for each in found)


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


def test_a_session_that_opens_the_page_again_and_again_waits_and_may_steer() -> None:
    limit, _ = make_limit()
    assert accepted(limit, "/frames", 1000) == BURST // COSTS["/frames"]
    assert statuses(limit, "/api/unknown", 1) == {429: 1}
    assert accepted(limit, "/steering", 1) == 1
