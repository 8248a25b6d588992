"""The packets of a log for a replay: when each is due, and from which entity."""

import math
from collections import Counter
from collections.abc import Callable, Iterator, Mapping
from dataclasses import dataclass
from datetime import UTC, datetime
from pathlib import Path
from typing import NamedTuple, Protocol, cast

import msgspec

import imc
from imc.lsf import Log
from imc.reserved_ids import BROADCAST, UNKNOWN_ENTITY, UNKNOWN_SYSTEM
from runtime.logs import find_message_ids, summarize
from support.durations import parse_duration
from support.file_errors import describe_os_error

FIRST = -1  # ends the key of a first message
TOLERANCE = 10.0  # s
ENOUGH = 20


class Timeline:
    """Seconds since the start of a log: the latest time so far, so it never goes back.

    A time more than `longest_pause` seconds ahead or TOLERANCE behind is a stray and ignored. When ENOUGH strays in a
    row agree, the log's clock was set, and the step takes no time.
    """

    def __init__(self, longest_pause: float):
        self.elapsed = 0.0
        self.steps: int = 0
        self.origin = math.nan
        self._longest_pause = longest_pause
        self._stray = math.nan
        self._strays = 0

    def advance_to_packet(self, time: float) -> float:
        """Take the next packet's time (s since 1970 UTC), and return when it is due (s since the start)."""
        if not math.isfinite(time):
            return self.elapsed
        if math.isnan(self.origin):
            self.origin = time
        if -TOLERANCE <= time - self.origin - self.elapsed <= self._longest_pause:
            self.elapsed: float = max(self.elapsed, time - self.origin)
            self._strays = 0
            return self.elapsed
        self._strays = self._strays + 1 if abs(time - self._stray) <= TOLERANCE else 1
        self._stray = time
        if self._strays == ENOUGH:
            self.origin: float = time - self.elapsed
            self._strays = 0
            self.steps += 1
        return self.elapsed


class ReplayedPacket(NamedTuple):
    """A packet, when it is due (s since the start of the log), and when the log started (s since 1970 UTC)."""

    elapsed: float
    origin: float
    packet: bytes


class SkippedPackets(NamedTuple):
    """Packets that a jump has passed, in their order: the state of the owner of a log at a place of it.

    These are the last one of each message and entity, and the first estimate. time: of the log, s since its start.
    """

    time: float
    packets: list[ReplayedPacket]


class LogPlayer(Protocol):
    """A task that plays a log, as others see it."""

    @property
    def elapsed(self) -> float:
        """The present time in the log (s)."""
        ...

    def add_jump_listener(self, follower: Callable[[Path, SkippedPackets], object]) -> None:
        """Call `follower(path, passed)` when a log begins, and after each jump in it, before its next packet."""


class LogTime(NamedTuple):
    """A place in a log: seconds since its start or, for a `date`, since 1970 UTC."""

    seconds: float
    date: bool = False

    @classmethod
    def parse(cls, text: str) -> "LogTime":
        """Parse "90", "1h30min" or "2026-01-01T00:05:00" (UTC). Raises ValueError."""
        try:
            return cls(parse_duration(text))
        except ValueError:
            pass
        try:
            time = datetime.fromisoformat(text.strip())
        except ValueError:
            raise ValueError(f"{text!r} is not a place in a log; write 90, 1h30min or 2026-01-01T00:05:00") from None
        return cls((time if time.tzinfo else time.replace(tzinfo=UTC)).timestamp(), True)

    def elapsed(self, origin: float) -> float:
        """Seconds since the start of a log that started at `origin` (s since 1970 UTC)."""
        return self.seconds - origin if self.date else self.seconds


@dataclass(frozen=True)
class ReplaySelection:
    """The part of a log to play: names of messages and systems, labels of entities (empty is all), and the end."""

    messages: tuple[str, ...] = ()
    systems: tuple[str, ...] = ()
    entities: tuple[str, ...] = ()
    end: LogTime | None = None


class ReplayedLog:
    """The packets of a log that can be replayed here.

    A packet whose id is another message here than in the log, or has another layout, is skipped and counted in
    `foreign`. `entities` maps labels to ids here; if not empty, the entity ids of the log's owner are translated by
    label, and those with other labels become 255. Raises UnknownNameError if the log does not have a chosen
    message, system or entity.
    """

    def __init__(self, log: Log, choice: ReplaySelection, entities: Mapping[str, int], longest_pause: float):
        self.log = log
        self.timeline = Timeline(longest_pause)
        self.foreign: Counter[str] = Counter()
        self._passed: dict[tuple[int, ...], ReplayedPacket] = {}
        self._end = choice.end or LogTime(math.inf)
        self._longest_pause = longest_pause
        self._types = find_message_ids(choice.messages, log.schema)
        self._systems: set[int] = set()
        self._speakers: set[tuple[int, int]] = set()
        if choice.systems or choice.entities:
            summary = summarize(log)
            self._systems = summary.names.find_system_ids(choice.systems, summary.clocks)
            self._speakers = summary.names.find_entity_ids(choice.entities, summary.by_entity)
        self._verdicts: dict[int, str] = {}
        self._same = log.schema == imc.builtin()
        first = next((packet for _, packet in log.packets()), None)
        self.owner: int | None = imc.header(first).src if first is not None else None
        self._led = first is not None and imc.packet_id(first) == imc.LoggingControl.ID
        self.entities: dict[int, int] = self._find_entities(entities)
        self.missing: list[str] = [label for label, here in entities.items() if here not in self.entities.values()]
        self._translating = bool(entities)

    def __iter__(self) -> Iterator[ReplayedPacket]:
        return self.packets_from()

    def packets_from(self, begin: LogTime | None = None) -> Iterator[ReplayedPacket]:
        """The packets from `begin` on; each call reads the log from the start."""
        self.timeline: Timeline = Timeline(self._longest_pause)
        timeline = self.timeline
        self.foreign.clear()
        passed = self._passed = dict[tuple[int, ...], ReplayedPacket]()
        owner, led, end = self.owner, self._led, self._end
        reached = begin is None
        for _, packet in self.log.packets():
            header = imc.header(packet)
            # Other systems have other clocks: if the first packet names the owner of the log, only its clock counts.
            if header.src == owner or not led:
                timeline.advance_to_packet(header.timestamp)
            elapsed, origin = timeline.elapsed, timeline.origin
            if begin is not None and not reached:
                if not elapsed >= begin.elapsed(origin):
                    key, due = (header.id, header.src, header.src_ent), ReplayedPacket(elapsed, origin, packet)
                    passed.pop(key, None)  # the latest is the last
                    passed[key] = due
                    if header.id == imc.EstimatedState.ID:
                        passed.setdefault((*key, FIRST), due)
                    continue
                reached = True
            if elapsed >= end.elapsed(origin):
                return
            if (shown := self._shown(packet, header)) is not None:
                yield ReplayedPacket(elapsed, origin, shown)

    def skipped_by_jump(self, place: LogTime) -> SkippedPackets:
        """The packets that the jump to a place has passed, once the first packet from there on was taken."""
        due, self._passed = list(self._passed.values()), {}
        wanted = [(one, self._shown(one.packet, imc.header(one.packet), is_counted=False)) for one in due]
        packets = [one._replace(packet=packet) for one, packet in wanted if packet is not None]
        origin = self.timeline.origin
        return SkippedPackets(self.timeline.elapsed if math.isnan(origin) else place.elapsed(origin), packets)

    def _shown(self, packet: bytes, header: imc.Header, *, is_counted: bool = True) -> bytes | None:
        """The packet as it is played, None if it is not; with `is_counted`, one that cannot be is counted."""
        if (self._types or self._systems or self._speakers) and not self._is_wanted(header):
            return None
        if not self._same and (name := self._foreign(packet, header.id)):
            self.foreign[name] += is_counted
            return None
        return self._translate(packet, header) if self._translating else packet

    def _find_entities(self, wanted: Mapping[str, int]) -> dict[int, int]:
        """Maps the log's entity ids to those of the same label here; reads until all of `wanted` are found."""
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
        if self._types and header.id not in self._types and not self._is_followed(header):
            return False
        if self._systems and header.src not in self._systems:
            return False
        return not self._speakers or (header.src, header.src_ent) in self._speakers

    def _is_followed(self, header: imc.Header) -> bool:
        """Whether a packet is the EntityState of a translated entity, which is played even if not chosen."""
        found = self.log.schema.types_by_id.get(header.id)
        known = header.src == self.owner and header.src_ent in self.entities
        return known and found is not None and found.abbrev == "EntityState"

    def _foreign(self, packet: bytes, number: int) -> str:
        """The name of a packet that is another message here than in the log, else an empty text."""
        verdict = self._verdict(number)
        if verdict or not (kind := self.log.schema.types_by_id.get(number)) or not set(kind.wire_codes) & {"M", "L"}:
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
                and (theirs.abbrev, theirs.wire_codes) == (ours.abbrev, ours.wire_codes)
                and [f.attribute for f in theirs.fields] == [f.attribute for f in ours.fields]
            )
            name = theirs.abbrev if theirs else "a message"
            self._verdicts[number] = "" if same else f"{name} ({number}, here {ours.abbrev if ours else 'unknown'})"
        return self._verdicts[number]

    def _translate(self, packet: bytes, header: imc.Header) -> bytes:
        src_ent, dst_ent = header.src_ent, header.dst_ent
        if header.src == self.owner:
            src_ent = self.entities.get(src_ent, UNKNOWN_ENTITY)
        if header.dst == self.owner or header.dst in (UNKNOWN_SYSTEM, BROADCAST):
            dst_ent = self.entities.get(dst_ent, UNKNOWN_ENTITY)
        return imc.with_header(packet, src_ent=src_ent, dst_ent=dst_ent)


class OpenedLog(NamedTuple):
    """A log at a place: the packets from there on, the first one of them, and what came before."""

    recording: ReplayedLog
    packets: Iterator[ReplayedPacket]
    first: ReplayedPacket | None
    passed: SkippedPackets


def open_log(
    path: Path, choice: ReplaySelection, entities: dict[str, int], longest_pause: float, place: LogTime
) -> OpenedLog | str:
    """The recording at `path`, or why it cannot be played."""
    try:
        return open_recording_at(ReplayedLog(Log(path), choice, entities, longest_pause), place)
    except OSError as error:
        return f"{path}: {error.strerror or error}"
    except ValueError as error:
        return str(error)


def open_recording_at(recording: ReplayedLog, place: LogTime) -> OpenedLog | str:
    """The recording from `place` on, or why it cannot be read."""
    packets = recording.packets_from(place)
    try:
        first = next(packets, None)
        return OpenedLog(recording, packets, first, recording.skipped_by_jump(place))
    except OSError as error:
        return describe_os_error(error)


def _parts(message: imc.Message) -> Iterator[imc.Message]:
    """All messages inside a message."""
    for value in msgspec.structs.astuple(message):
        for part in cast(tuple[object, ...], value) if isinstance(value, tuple) else (value,):
            if isinstance(part, imc.Message):
                yield part
                yield from _parts(part)
