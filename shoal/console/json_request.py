"""Requests of the page with JSON, and their answers."""

import json
from collections.abc import Awaitable, Callable, Mapping
from dataclasses import dataclass, field
from typing import Any, cast

from starlette.requests import Request
from starlette.responses import Response

from shoal.console.page_feed import encode
from shoal.console.panels.user_panels import UserPanel
from shoal.console.parameters.profile_settings import ProfileSettings

Answer = Callable[[Request], Awaitable[Response]]


@dataclass(frozen=True)
class PageExtensions:
    """Requests by path: `questions` to GET, `orders` to POST, and `maintenance` to POST, which sets options.

    `instead_of_orders` answers orders to a vehicle. `settings` are those of a profile, for the views of parameters,
    `panels` those of the user.
    """

    questions: Mapping[str, Answer]
    orders: Mapping[str, Answer]
    instead_of_orders: Answer | None = None
    maintenance: Mapping[str, Answer] = field(default_factory=dict[str, Answer])
    settings: ProfileSettings | None = None
    panels: tuple[UserPanel, ...] = ()


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
