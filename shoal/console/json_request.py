"""Requests of the page with JSON, and their answers."""

import json
from collections.abc import Awaitable, Callable
from typing import Any, cast

from starlette.requests import Request
from starlette.responses import Response

from shoal.console.page_feed import encode
from support.terminal_text import printable

Answer = Callable[[Request], Awaitable[Response]]


async def json_object(request: Request) -> dict[str, object]:
    """The object in the body of a request; empty if it is none."""
    return read_object((await request.body()).decode(errors="replace"))


def read_object(text: str) -> dict[str, object]:
    """The object that a text of JSON is; empty if it is none."""
    try:
        found = json.loads(text)
    except (ValueError, RecursionError):
        return {}
    return cast(dict[str, object], found) if isinstance(found, dict) else {}


def json_response(value: Any) -> Response:
    """An answer of JSON, see `encode`."""
    return Response(encode(value), media_type="application/json")


def refusal_response(reason: object, **more: object) -> Response:
    """The answer to a request that is rejected: the reason, and what the page expects beside it."""
    return json_response({"ok": False, "text": printable(str(reason)), **more})
