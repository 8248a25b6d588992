"""A part of the page: the requests of a view."""

from collections.abc import Mapping
from types import MappingProxyType
from typing import Protocol

from shoal.console.json_request import Answer

NOTHING: Mapping[str, Answer] = MappingProxyType({})


class PagePart(Protocol):
    """Answers by path: `questions` to GET, `orders` to POST of who may operate, `maintenance` of who may maintain.

    The state of the request of an order has its `user`.
    """

    questions: Mapping[str, Answer] = NOTHING
    orders: Mapping[str, Answer] = NOTHING
    maintenance: Mapping[str, Answer] = NOTHING

    def close(self) -> None:
        """End what runs for it: the console ends."""
