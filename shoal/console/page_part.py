"""A part of the page: the requests of a view."""

from collections.abc import Mapping
from types import MappingProxyType
from typing import Protocol

from shoal.console.json_request import Answer

NOTHING: Mapping[str, Answer] = MappingProxyType({})


class PagePart(Protocol):
    """Answers by path: `questions` to GET, `posted` to POST, `orders` and `maintenance` to POST of a role.

    A question changes nothing on a vehicle. The state of a request by POST has its `user`, and `refusal`, which is why
    the user may not operate; empty for who may.
    """

    questions: Mapping[str, Answer] = NOTHING
    posted: Mapping[str, Answer] = NOTHING
    orders: Mapping[str, Answer] = NOTHING
    maintenance: Mapping[str, Answer] = NOTHING

    def close(self) -> None:
        """End what runs for it: the console ends."""
