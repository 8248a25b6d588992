"""What a re-simulation needs to know of a log first: its owner, its begin and end, its senders."""

import math
from collections import Counter
from dataclasses import dataclass, field

import imc
from runtime.logs import Names
from shoal.rerun.run import LoggedRun

Op = imc.LoggingControl.Op
CLOSING = frozenset({imc.LoggingControl.ID, imc.QueryEntityInfo.ID, imc.EntityInfo.ID})
"""Messages that closing a log may add; they do not show that anything else happened in its last moment."""


@dataclass
class Outline:
    """A log in outline; times are s since 1970 UTC, of the owner's clock.

    late: message id and entity of packets that carry an earlier time, such as that of a measurement.
    marked: it begins with LoggingControl. closed: it ends cleanly. lived: more than the closing happened in its last
    moment. counts: packets by message id. speakers: the owner's packets by message id and entity.
    """

    owner: int
    begin: float = math.nan
    end: float = math.nan
    marked: bool = False
    closed: bool = False
    lived: bool = False
    counts: Counter[int] = field(default_factory=Counter[int])
    speakers: Counter[tuple[int, int]] = field(default_factory=Counter[tuple[int, int]])
    late: set[tuple[int, int]] = field(default_factory=set[tuple[int, int]])
    names: Names = field(default_factory=Names)

    @property
    def labels(self) -> dict[str, int]:
        """The entities of the owner, by label."""
        return {label: entity for (system, entity), label in self.names.labels.items() if system == self.owner}


def outline(log: imc.Log | LoggedRun) -> Outline | None:
    """The outline of a log or a run; None if it has no messages."""
    found: Outline | None = None
    naming = {imc.EntityInfo.ID, imc.EntityList.ID, imc.Announce.ID}
    for _, packet in log.packets():
        head = imc.header(packet)
        if found is None:
            found = Outline(head.src, marked=head.id == imc.LoggingControl.ID)
        found.counts[head.id] += 1
        if head.id in naming:
            _learn(found, log, packet)
        if head.src != found.owner:
            continue
        found.speakers[head.id, head.src_ent] += 1
        if math.isfinite(head.timestamp):
            found.begin = head.timestamp if math.isnan(found.begin) else found.begin
            if head.timestamp < found.end:
                found.late.add((head.id, head.src_ent))
            if not head.timestamp <= found.end:
                found.end, found.lived = head.timestamp, False
            found.lived |= head.timestamp == found.end and head.id not in CLOSING
        found.closed = head.id == imc.LoggingControl.ID and _is_stop(log, packet)
    return found


def _learn(found: Outline, log: imc.Log | LoggedRun, packet: bytes) -> None:
    try:
        found.names.learn(log.schema.decode(packet))
    except imc.DecodeError:
        return


def _is_stop(log: imc.Log | LoggedRun, packet: bytes) -> bool:
    try:
        return getattr(log.schema.decode(packet), "op", None) == Op.STOPPED
    except imc.DecodeError:
        return False
