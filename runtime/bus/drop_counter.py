"""Counts what is dropped because too much arrives, by the systems that send it."""

from collections import Counter

from imc.reserved_ids import UNKNOWN_SYSTEM

MOST_NAMED = 256


class DropCounter:
    """What was dropped: `total`, and since the last `drain` by source (IMC id).

    With more than MOST_NAMED sources those with the smallest counts become UNKNOWN_SYSTEM, so that many names do not
    hide who sends most.
    """

    def __init__(self) -> None:
        self.total = 0
        self._by_source: Counter[int] = Counter()

    def count(self, source: int) -> None:
        self.total += 1
        if source not in self._by_source and len(self._by_source) >= MOST_NAMED:
            self._by_source = self._worst()
        self._by_source[source] += 1

    def drain(self) -> Counter[int]:
        """The counts by source since the last call."""
        found, self._by_source = self._by_source, Counter()
        return found

    def _worst(self) -> Counter[int]:
        """The half with the largest counts, and the sum of the others."""
        named = Counter(dict(self._by_source.most_common(MOST_NAMED // 2)))
        named[UNKNOWN_SYSTEM] += self._by_source.total() - named.total()
        return named
