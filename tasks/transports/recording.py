"""The packets of a log as another bus can have them: when each is due, and under which entity."""

import math
from collections import Counter
from collections.abc import Iterator
from typing import NamedTuple, cast

import msgspec

import imc
from imc.lsf import Log, packet_id

TOLERANCE = 10.0  # s
ENOUGH = 20
UNKNOWN_ENTITY = 0xFF
BROADCAST = (0xFFFF, 0xFFF0)


class Timeline:
    """Seconds since the begin of a log: the latest time so far, so that it never goes back.

    A time that is more than `longest_pause` seconds ahead of it, or TOLERANCE behind, is astray and does not count;
    when ENOUGH in a row agree, the log's clock has been set, and the step costs no time.
    """

    def __init__(self, longest_pause: float):
        self.elapsed = 0.0
        self.steps = 0
        self.origin = math.nan
        self._longest_pause = longest_pause
        self._stray = math.nan
        self._strays = 0

    def advance(self, time: float) -> float:
        """Take the next packet's time (s since 1970 UTC), and return the seconds at which it is due."""
        if not math.isfinite(time):
            return self.elapsed
        if math.isnan(self.origin):
            self.origin = time
        if -TOLERANCE <= time - self.origin - self.elapsed <= self._longest_pause:
            self.elapsed = max(self.elapsed, time - self.origin)
            self._strays = 0
            return self.elapsed
        self._strays = self._strays + 1 if abs(time - self._stray) <= TOLERANCE else 1
        self._stray = time
        if self._strays == ENOUGH:
            self.origin = time - self.elapsed
            self._strays = 0
            self.steps += 1
        return self.elapsed


class Due(NamedTuple):
    """A packet, the seconds since the begin of the log at which it is due, and the log's time at its begin."""

    elapsed: float
    origin: float
    packet: bytes


class Recording:
    """The packets of a log that the bus can have.

    `types` are the names of the messages to play, all if empty. A packet whose id means another message here than in
    the log, or has another layout, is left out and counted in `foreign`.
    `entities` maps labels to ids here; where there are some, the entity ids of the log's owner are translated by label
    and those of other labels become 255.
    """

    def __init__(self, log: Log, types: list[str], entities: dict[str, int], longest_pause: float):
        self.log = log
        self.timeline = Timeline(longest_pause)
        self.foreign: Counter[str] = Counter()
        self._types = set(types)
        self._verdicts: dict[int, str] = {}
        first = next((packet for _, packet in log.packets()), None)
        self.owner = imc.header(first).src if first is not None else None
        self._led = first is not None and packet_id(first) == imc.LoggingControl.ID
        self.entities = self._find_entities(entities)
        self.missing = [label for label, here in entities.items() if here not in self.entities.values()]
        self._translating = bool(entities)

    def __iter__(self) -> Iterator[Due]:
        advance = self.timeline.advance
        same = self.log.schema == imc.builtin()
        for _, packet in self.log.packets():
            header = imc.header(packet)
            # Other systems have other clocks: where the first packet says whose log it is, that one's clock counts.
            if header.src == self.owner or not self._led:
                advance(header.timestamp)
            if self._types and not self._is_wanted(header):
                continue
            if not same and (name := self._foreign(packet, header.id)):
                self.foreign[name] += 1
                continue
            if self._translating:
                packet = self._translate(packet, header)
            yield Due(self.timeline.elapsed, self.timeline.origin, packet)

    def _find_entities(self, wanted: dict[str, int]) -> dict[int, int]:
        """The log's entity ids and those of the same label here; reads until all of `wanted` are found."""
        found: dict[int, int] = {}
        left = set(wanted)
        if left and "EntityInfo" in self.log.schema:
            for info in self.log.messages("EntityInfo"):
                label = str(getattr(info, "label", ""))
                if info.src == self.owner and label in wanted:
                    found[info.src_ent] = wanted[label]
                    left.discard(label)
                    if not left:
                        break
        return found

    def _is_wanted(self, header: imc.Header) -> bool:
        found = self.log.schema.types_by_id.get(header.id)
        if found is None:
            return False
        followed = found.abbrev == "EntityState" and header.src == self.owner and header.src_ent in self.entities
        return followed or found.abbrev in self._types

    def _foreign(self, packet: bytes, number: int) -> str:
        """What the packet is called that would be something else here, else an empty text."""
        verdict = self._verdict(number)
        if verdict or not (kind := self.log.schema.types_by_id.get(number)) or not set(kind.wire) & {"M", "L"}:
            return verdict
        try:
            message = self.log.schema.decode(packet)
        except imc.DecodeError:
            return f"{kind.abbrev} ({number}), malformed"
        inner = (self._verdict(part.ID) for part in _parts(message))
        return next((f"{kind.abbrev} with {verdict}" for verdict in inner if verdict), "")

    def _verdict(self, number: int) -> str:
        if number not in self._verdicts:
            theirs = self.log.schema.types_by_id.get(number)
            ours = imc.builtin().types_by_id.get(number)
            same = ours is None or (
                theirs is not None
                and (theirs.abbrev, theirs.wire) == (ours.abbrev, ours.wire)
                and [f.attribute for f in theirs.fields] == [f.attribute for f in ours.fields]
            )
            name = theirs.abbrev if theirs else "a message"
            self._verdicts[number] = "" if same else f"{name} ({number}, here {ours.abbrev if ours else 'unknown'})"
        return self._verdicts[number]

    def _translate(self, packet: bytes, header: imc.Header) -> bytes:
        src_ent, dst_ent = header.src_ent, header.dst_ent
        if header.src == self.owner:
            src_ent = self.entities.get(src_ent, UNKNOWN_ENTITY)
        if header.dst == self.owner or header.dst in BROADCAST:
            dst_ent = self.entities.get(dst_ent, UNKNOWN_ENTITY)
        return imc.with_header(packet, src_ent=src_ent, dst_ent=dst_ent)


def _parts(message: imc.Message) -> Iterator[imc.Message]:
    """All messages inside a message."""
    for value in msgspec.structs.astuple(message):
        for part in cast(tuple[object, ...], value) if isinstance(value, tuple) else (value,):
            if isinstance(part, imc.Message):
                yield part
                yield from _parts(part)
