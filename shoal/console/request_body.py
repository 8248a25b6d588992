"""Objects of JSON that the page sends."""

import json
from typing import cast

from starlette.requests import Request


async def json_object(request: Request) -> dict[str, object]:
    """The object in the body of a request; empty if it is none."""
    return parse_object((await request.body()).decode(errors="replace"))


def parse_object(text: str) -> dict[str, object]:
    """The object that a text of JSON is; empty if it is none."""
    try:
        found = json.loads(text)
    except (ValueError, RecursionError):
        return {}
    return cast(dict[str, object], found) if isinstance(found, dict) else {}
