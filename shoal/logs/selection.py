"""Selection of packets of a log: by time, message, system and entity."""

import math
from collections.abc import Iterable
from dataclasses import dataclass

import numpy as np

from runtime.logs import Array, LogSummary, find_message_ids


@dataclass(frozen=True)
class PacketSelection:
    """Packets to copy: times in s since 1970 UTC, `end` not included; ids; None selects all."""

    start: float = -math.inf
    end: float = math.inf
    types: frozenset[int] | None = None
    systems: frozenset[int] | None = None
    entities: frozenset[tuple[int, int]] | None = None


def selection_from_names(
    summary: LogSummary,
    start: float | None = None,
    end: float | None = None,
    types: Iterable[str] = (),
    systems: Iterable[str] = (),
    entities: Iterable[str] = (),
) -> PacketSelection:
    """A selection by names. Raises UnknownNameError for a name that the log or its schema does not have."""
    called = frozenset(find_message_ids(types, summary.schema))
    of_systems = frozenset(summary.names.find_system_ids(systems, summary.clocks))
    of_entities = frozenset(summary.names.find_entity_ids(entities, summary.by_entity))
    return PacketSelection(
        -math.inf if start is None else start,
        math.inf if end is None else end,
        called or None,
        of_systems or None,
        of_entities or None,
    )


class OwnerClock:
    """Follows the owner's clock through a log."""

    def __init__(self, owner: int):
        self._owner = owner
        self._latest = math.nan

    def times(self, heads: Array) -> Array:
        """The times at which packets were written, by the owner's clock."""
        own = (heads["src"] == self._owner) & np.isfinite(heads["timestamp"])
        if not own.any():
            return np.full(len(heads), self._latest)
        first = heads["timestamp"][own][0]
        said = np.concatenate(([first if math.isnan(self._latest) else self._latest], heads["timestamp"]))
        places = np.maximum.accumulate(np.where(own, np.arange(1, len(said)), 0))
        self._latest = float(said[places[-1]])
        return said[places]


def selection_mask(heads: Array, choice: PacketSelection, watch: OwnerClock) -> Array:
    """Mask of the selected packets, by their headers; blocks must come in the order of the log."""
    times = watch.times(heads)
    found = np.ones(len(heads), bool)
    if choice.start > -math.inf:
        found &= times >= choice.start
    if choice.end < math.inf:
        found &= times < choice.end
    if choice.types is not None:
        found &= np.isin(heads["id"], list(choice.types))
    if choice.systems is not None:
        found &= np.isin(heads["src"], list(choice.systems))
    if choice.entities is not None:
        keys = [system << 8 | entity for system, entity in choice.entities]
        found &= np.isin(heads["src"].astype(np.int64) << 8 | heads["src_ent"], keys)
    return found
