"""DUNE's filters of one type of message each: `Custom Filters`, such as LogBookEntryFilter:ERROR+WARNING."""

from collections.abc import Callable, Collection

import imc
from support.terminal_text import quoted

MOST_SOURCES = 1024  # whose last state is kept


class EntityStateChangeFilter:
    """Lets an EntityState of the entities `words`, or of all, through if the state is not the one before."""

    message = "EntityState"
    remembers = True  # what it let through, so nothing else may refuse that
    words: Collection[str] = ()

    def __init__(self, words: Collection[str], label: Callable[[int, int], str]):
        self._labels, self._label = words, label
        self._last: dict[tuple[int, int], int] = {}

    def __call__(self, message: imc.Message) -> bool:
        source = message.src, message.src_ent
        if self._labels and self._label(*source) not in self._labels:
            return True
        state = getattr(message, "state", 0)
        if len(self._last) >= MOST_SOURCES and source not in self._last:
            self._last.clear()
        before, self._last[source] = self._last.get(source), state
        return before != state


class LogBookEntryFilter:
    """Lets a LogBookEntry of the types `words`, or of all, through."""

    message = "LogBookEntry"
    remembers = False
    words: Collection[str] = tuple(imc.LogBookEntry.Type.__members__)

    def __init__(self, words: Collection[str], label: Callable[[int, int], str]):
        self._types = {imc.LogBookEntry.Type[word] for word in words}

    def __call__(self, message: imc.Message) -> bool:
        return not self._types or getattr(message, "type", None) in self._types


Custom = EntityStateChangeFilter | LogBookEntryFilter
FILTERS: dict[str, type[Custom]] = {each.__name__: each for each in (EntityStateChangeFilter, LogBookEntryFilter)}


def parse_custom(item: str) -> tuple[type[Custom], frozenset[str]]:
    """The filter of an item of `Custom Filters`, and its words: EntityStateChangeFilter:GPS+UDP. Raises ValueError."""
    name, _, rest = (part.strip() for part in item.partition(":"))
    words = frozenset(word.strip() for word in rest.split("+") if word.strip())
    if name not in FILTERS:
        raise ValueError(f"{quoted(item)} is not one of {', '.join(FILTERS)}, such as LogBookEntryFilter:ERROR")
    known = FILTERS[name].words
    if known and (wrong := words - set(known)):
        raise ValueError(f"{quoted(item)}: {quoted(min(wrong))} is none of {', '.join(known)}")
    return FILTERS[name], words
