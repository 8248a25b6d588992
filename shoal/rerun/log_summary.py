"""Facts of a log that a re-simulation needs first: its owner, its begin and end, its senders."""

import math
from collections import Counter
from dataclasses import dataclass, field

import imc
from runtime.logs import SystemNames
from shoal.rerun.run_log_sequence import LoggedRun

Op = imc.LoggingControl.Op
CLOSING = frozenset({imc.LoggingControl.ID, imc.QueryEntityInfo.ID, imc.EntityInfo.ID})
"""Messages that closing a log may add; they do not show that anything else happened in its last moment."""
DESCRIBING = CLOSING | {imc.EntityList.ID, imc.Announce.ID}
"""Messages that a part of a log has from its beginning, whatever else was cut off."""
GAP = 1.0  # s; a vehicle sends Heartbeat at 1 Hz


@dataclass
class RerunLogSummary:
    """A log in outline; times are s since 1970 UTC, of the owner's clock.

    opened: when the log was begun. Where parts were cut off, begin and end are those of the rest.
    last: when each of the owner's messages came last.
    late: message id and entity of packets that carry an earlier time, such as that of a measurement.
    begins_with_start: its first message is LoggingControl. is_active_at_end: more than the closing happened in its last
    moment. counts: packets by message id. speakers: the owner's packets by message id and entity.
    """

    owner: int
    opened: float = math.nan
    begin: float = math.nan
    end: float = math.nan
    begins_with_start: bool = False
    ends_cleanly: bool = False
    is_active_at_end: bool = False
    counts: Counter[int] = field(default_factory=Counter[int])
    speakers: Counter[tuple[int, int]] = field(default_factory=Counter[tuple[int, int]])
    last: dict[int, float] = field(default_factory=dict[int, float])
    late: set[tuple[int, int]] = field(default_factory=set[tuple[int, int]])
    names: SystemNames = field(default_factory=SystemNames)

    @property
    def entity_ids(self) -> dict[str, int]:
        """The entities of the owner, by label."""
        return {label: entity for (system, entity), label in self.names.labels.items() if system == self.owner}


def summarize_log(log: imc.Log | LoggedRun) -> RerunLogSummary | None:
    """The outline of a log or a run; None if it has no messages."""
    found: RerunLogSummary | None = None
    first = last = math.nan  # when messages came that do not only describe the log
    naming = {imc.EntityInfo.ID, imc.EntityList.ID, imc.Announce.ID}
    for _, packet in log.packets():
        head = imc.header(packet)
        if found is None:
            found = RerunLogSummary(head.src, begins_with_start=head.id == imc.LoggingControl.ID)
        found.counts[head.id] += 1
        if head.id in naming:
            _learn(found, log, packet)
        if head.src != found.owner:
            continue
        found.speakers[head.id, head.src_ent] += 1
        if math.isfinite(head.timestamp):
            found.opened = head.timestamp if math.isnan(found.opened) else found.opened
            if head.id not in DESCRIBING:
                first = head.timestamp if math.isnan(first) else first
                last = head.timestamp if not head.timestamp <= last else last
            found.last[head.id] = head.timestamp
            if head.timestamp < found.end:
                found.late.add((head.id, head.src_ent))
            if not head.timestamp <= found.end:
                found.end, found.is_active_at_end = head.timestamp, False
            found.is_active_at_end |= head.timestamp == found.end and head.id not in CLOSING
        found.ends_cleanly = head.id == imc.LoggingControl.ID and _is_stop(log, packet)
    if found is not None:
        found.begin = first if found.begins_with_start and first - found.opened > GAP else found.opened
        if found.end - last > GAP:
            found.end, found.ends_cleanly = last, False
    return found


def _learn(found: RerunLogSummary, log: imc.Log | LoggedRun, packet: bytes) -> None:
    try:
        found.names.learn(log.schema.decode(packet))
    except imc.DecodeError:
        return


def _is_stop(log: imc.Log | LoggedRun, packet: bytes) -> bool:
    try:
        return getattr(log.schema.decode(packet), "op", None) == Op.STOPPED
    except imc.DecodeError:
        return False
