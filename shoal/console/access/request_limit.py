"""A limit to the requests of each session, so that none takes the processor from the vehicle and from others."""

import time
from collections.abc import Callable, Hashable
from types import MappingProxyType

from starlette.responses import PlainTextResponse
from starlette.types import ASGIApp, Receive, Scope, Send
from starlette.websockets import WebSocketClose

from support.token_bucket import TokenBuckets

RATE, BURST = 40.0, 200.0  # of the costs below: in a second, and at once after a pause
ORDER_RATE, ORDER_BURST = 20.0, 60.0  # orders, which nothing else uses up: Abort is among them
MOST_CLIENTS = 256
FREE = frozenset({"/", "/healthz", "/register_service", "/api/login"})
"""Constant answers, and logins, which have a limit of their own."""
FREE_FOLDER = "/files/"
ORDERS = frozenset({"/api/order", "/steering"})
TILES, COST_OF_TILE = "/tiles/", 0.1
COSTS = MappingProxyType(
    {
        "/api/cameras": 0.5,
        "/api/checks": 10.0,
        "/api/contours": 4.0,
        "/api/flight": 4.0,
        "/api/lease": 4.0,
        "/api/limits": 4.0,
        "/api/log-file": 4.0,
        "/api/log-report": 4.0,
        "/api/log-report-make": 10.0,
        "/api/logs": 10.0,
        "/api/overlay": 10.0,
        "/api/parameter-details": 10.0,
        "/api/parameters": 4.0,
        "/api/picture": 0.5,
        "/api/plan-draw": 2.0,
        "/api/plan-export": 4.0,
        "/api/plan-import": 4.0,
        "/api/plan-text": 4.0,
        "/api/plans": 4.0,
        "/api/replay": 0.5,
        "/api/resume": 10.0,
        "/api/series": 10.0,
        "/foxglove": 4.0,
        "/frames": 2.0,
        "/layout.json": 4.0,
    }
)
"""Costs of requests that ask a vehicle, read the disk, compute or are logged, and of those that live views repeat; of
others 1."""
TOO_MANY = "too many requests: wait a moment"


class RequestLimit:
    """An ASGI application around another one; too many requests of `client(scope)` are answered with 429.

    A WebSocket is one request; a client that opens too many is closed with 1013.

    `clock` returns seconds.
    """

    def __init__(
        self, app: ASGIApp, client: Callable[[Scope], Hashable], clock: Callable[[], float] = time.monotonic
    ) -> None:
        self._app, self._client, self._clock = app, client, clock
        self._requests = TokenBuckets(RATE, BURST, MOST_CLIENTS)
        self._orders = TokenBuckets(ORDER_RATE, ORDER_BURST, MOST_CLIENTS)

    async def __call__(self, scope: Scope, receive: Receive, send: Send) -> None:
        if scope["type"] not in ("http", "websocket") or self._admits(scope):
            await self._app(scope, receive, send)
        elif scope["type"] == "websocket":
            await WebSocketClose(1013, TOO_MANY)(scope, receive, send)
        else:
            await PlainTextResponse(TOO_MANY, 429, headers={"Retry-After": "1"})(scope, receive, send)

    def _admits(self, scope: Scope) -> bool:
        path: str = scope["path"]
        if path in FREE or path.startswith(FREE_FOLDER):
            return True
        buckets = self._orders if path in ORDERS else self._requests
        cost = COST_OF_TILE if path.startswith(TILES) else COSTS.get(path, 1.0)
        return buckets[self._client(scope)].try_acquire(self._clock(), cost)
