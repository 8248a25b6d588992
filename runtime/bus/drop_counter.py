"""Counts what is dropped because too much arrives, by those who send it."""

from collections import Counter
from collections.abc import Hashable
from typing import Generic, TypeVar

MOST_NAMED = 256

Sender = TypeVar("Sender", bound=Hashable)


class DropCounter(Generic[Sender]):
    """Counts of dropped packets: `total`, and since the last `drain` by source; it is true if something was.

    With more than MOST_NAMED sources those with the smallest counts become `others`, so that many names do not hide who
    sends most.
    """

    def __init__(self, others: Sender) -> None:
        self.total: int = 0
        self._others = others
        self._by_source: Counter[Sender] = Counter()

    def __bool__(self) -> bool:
        return bool(self._by_source)

    def count(self, source: Sender, number: int = 1) -> None:
        self.total += number
        if source not in self._by_source and len(self._by_source) >= MOST_NAMED:
            self._by_source = self._worst()
        self._by_source[source] += number

    def drain(self) -> Counter[Sender]:
        """The counts by source since the last call."""
        found, self._by_source = self._by_source, Counter()
        return found

    def _worst(self) -> Counter[Sender]:
        """The half with the largest counts, and the sum of the others."""
        named = Counter(dict(self._by_source.most_common(MOST_NAMED // 2)))
        named[self._others] += self._by_source.total() - named.total()
        return named
