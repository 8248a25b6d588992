"""Takes a part out of a log: by time, message, system and entity."""

import math
from collections.abc import Iterable
from dataclasses import dataclass, field
from pathlib import Path

import numpy as np

import imc
from imc.lsf import ReportShare
from runtime.logs import KEPT, Array, Summary, blocks, new_log, types_called


@dataclass(frozen=True)
class Selection:
    """What to take: times in s since 1970 UTC, `end` not included; ids; None takes all."""

    start: float = -math.inf
    end: float = math.inf
    types: frozenset[int] | None = None
    systems: frozenset[int] | None = None
    entities: frozenset[tuple[int, int]] | None = None


@dataclass
class CutReport:
    """What was written: packets of the choice, and packets kept for their names; and the damage left out."""

    chosen: int = 0
    kept: int = 0
    losses: list[imc.Loss] = field(default_factory=list[imc.Loss])


def choose(
    summary: Summary,
    start: float | None = None,
    end: float | None = None,
    types: Iterable[str] = (),
    systems: Iterable[str] = (),
    entities: Iterable[str] = (),
) -> Selection:
    """A choice by names. Raises UnknownName for those that neither log nor schema have."""
    called = frozenset(types_called(types, summary.schema))
    of_systems = frozenset(summary.names.systems_called(systems, summary.clocks))
    of_entities = frozenset(summary.names.entities_called(entities, summary.by_entity))
    return Selection(
        -math.inf if start is None else start,
        math.inf if end is None else end,
        called or None,
        of_systems or None,
        of_entities or None,
    )


def cut(log: imc.Log, folder: Path, choice: Selection, owner: int, progress: ReportShare | None = None) -> CutReport:
    """Write the chosen packets to a new log in `folder`, byte for byte and in their order, and the messages in KEPT.

    The time of the owner's packets is their own; another system's clock may be wrong, so its packets have the time
    of the owner's packet before them. Raises FileExistsError, OSError; ValueError where nothing is chosen, and
    then nothing is written.
    """
    done, watch = CutReport(), Watch(owner)
    with new_log(folder, log) as writer:
        for block in blocks(log, done.losses, progress):
            chosen = wanted(block.headers, choice, watch)
            kept = ~chosen & np.isin(block.headers["id"], list(KEPT))
            for index in np.flatnonzero(chosen | kept):
                writer.write(block.packets[index])
            done.chosen += int(chosen.sum())
            done.kept += int(kept.sum())
        if done.chosen == 0:
            raise ValueError("no message of the log is chosen; nothing is written")
    return done


class Watch:
    """The owner's clock, as the log goes on."""

    def __init__(self, owner: int):
        self._owner = owner
        self._latest = math.nan

    def times(self, heads: Array) -> Array:
        """The times at which packets were written."""
        own = (heads["src"] == self._owner) & np.isfinite(heads["timestamp"])
        if not own.any():
            return np.full(len(heads), self._latest)
        first = heads["timestamp"][own][0]
        said = np.concatenate(([first if math.isnan(self._latest) else self._latest], heads["timestamp"]))
        places = np.maximum.accumulate(np.where(own, np.arange(1, len(said)), 0))
        self._latest = float(said[places[-1]])
        return said[places]


def wanted(heads: Array, choice: Selection, watch: Watch) -> Array:
    """Which packets are chosen, by their headers, which must come in the order of the log."""
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
