"""The damage of a log, as a list that stays small however damaged the log is."""

from collections.abc import Iterable

from imc.stream import Loss

MOST = 10_000  # places kept one by one


class DamageList:
    """Places of damage, each once; call it with offset, length and reason. Beyond MOST they are only summed up."""

    def __init__(self, found: Iterable[Loss] = ()):
        self._found = {(loss.offset, loss.reason): loss for loss in found}
        self._full = len(self._found) >= MOST  # the list ends with a sum already
        self._more = 0
        self._first = self._reached = self._bytes = 0

    def __call__(self, offset: int, length: int, reason: str) -> None:
        if (offset, reason) in self._found or self._full:
            return
        if len(self._found) < MOST - 1:
            self._found[offset, reason] = Loss(offset, length, reason)
        elif length and offset >= self._reached:  # else it has been counted when the log was read before
            self._first = self._first if self._more else offset
            self._more += 1
            self._bytes += length
            self._reached = offset + length

    def sorted(self) -> list[Loss]:
        """Losses by offset in the unpacked log; the sum of those beyond MOST is the last."""
        found = sorted(self._found.values())
        if self._more:
            text = f"{self._more} more damaged places, the last one ends at byte {self._reached}"
            found.append(Loss(self._first, self._bytes, text))
        return found
