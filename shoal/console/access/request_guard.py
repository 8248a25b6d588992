"""Rejects requests of other sites and other names of this computer, and forbids the page what it does not need."""

from collections.abc import Collection
from contextlib import suppress

from starlette.datastructures import Headers, MutableHeaders
from starlette.requests import ClientDisconnect
from starlette.responses import PlainTextResponse
from starlette.types import ASGIApp, Message, Receive, Scope, Send
from starlette.websockets import WebSocketClose

MOST_BODY = 1 << 20  # bytes of a request
SAFE = ("GET", "HEAD")
HEADERS = {
    "Content-Security-Policy": (
        "default-src 'self'; img-src 'self' data: blob:; frame-ancestors 'none'; base-uri 'none'; form-action 'none'"
    ),
    "X-Content-Type-Options": "nosniff",
    "Referrer-Policy": "no-referrer",
    "Cross-Origin-Opener-Policy": "same-origin",
    "Cache-Control": "no-cache",
}


class RequestGuard:
    """An ASGI application around another one.

    A request names one of `hosts` (name and port, in any case: browsers send small letters), which a name of another
    site that leads here does not; what changes something, and a WebSocket, come from a page of this host. Otherwise
    403. The routes of the paths in `own_origins` check the origins of their WebSockets themselves.
    """

    def __init__(self, app: ASGIApp, hosts: Collection[str], own_origins: Collection[str] = ()) -> None:
        self._app, self._own_origins = app, frozenset(own_origins)
        self._hosts = frozenset(map(str.lower, hosts))

    async def __call__(self, scope: Scope, receive: Receive, send: Send) -> None:
        if scope["type"] not in ("http", "websocket"):
            await self._app(scope, receive, send)
            return
        reason = self._refusal(scope)
        if reason and scope["type"] == "websocket":
            await WebSocketClose(code=1008, reason=reason)(scope, receive, send)
        elif reason:
            await PlainTextResponse(reason, 403, headers=HEADERS)(scope, receive, send)
        else:
            with suppress(ClientDisconnect):  # in the middle of a request
                await self._app(scope, receive, _with_headers(send))

    def _refusal(self, scope: Scope) -> str:
        headers = Headers(scope=scope)
        host, origin = headers.get("host", "").lower(), headers.get("origin", "").lower()
        if host not in self._hosts:
            return f"this console is not {host or 'without a name'}: use the address that it has printed"
        if scope["type"] == "http" and scope["method"] in SAFE:
            return ""
        if scope["type"] == "websocket" and scope["path"] in self._own_origins:
            return ""
        schemes = ("https",) if scope["scheme"] in ("https", "wss") else ("http", "https")
        if origin not in [f"{scheme}://{host}" for scheme in schemes]:
            return "this request does not come from the page of the console"
        length = headers.get("content-length", "0")
        if "transfer-encoding" in headers or not length.isdecimal() or int(length) > MOST_BODY:
            return f"a request has at most {MOST_BODY} bytes"
        return ""


def _with_headers(send: Send) -> Send:
    async def add(message: Message) -> None:
        if message["type"] == "http.response.start":
            headers = MutableHeaders(scope=message)
            for name, value in HEADERS.items():
                headers.setdefault(name, value)
        await send(message)

    return add
