"""The state of all systems of a log at any of its times, within a fraction of a second."""

import copy
import math
from bisect import bisect_right
from itertools import islice
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

import imc
from imc.coordinates import absolute_position
from imc.lsf import Batch, DamageList, Members, ReportProgress, open_reader, scan, unpacked_chunks
from imc.reserved_ids import BROADCAST, UNKNOWN_SYSTEM
from runtime.logs import NAMING, SystemNames
from tasks.transports.replayed_log import Timeline

Floats = NDArray[np.float64]

LONGEST_PAUSE = 3600.0  # s; a longer one is a step of the log's clock
TOGETHER = 64  # packets whose times are compared with those before at once
PIECES_OF_STATE = 8  # pieces of a log between two stored states
LARGEST = 1 << 15  # bytes of a packet in a state: pictures are no part of it
KEPT_PIECES = 4
TRACK_PERIOD = 1.0  # s
MOST_TRACK = 18_000  # points of a system


class _Piece(NamedTuple):
    """Consecutive packets: their beginning in the log, when they are due, and the time line before them."""

    offset: int
    due: float
    timeline: Timeline


class LogStates:
    """The packets of a log by time, and the last one of each message and entity at any time.

    Times are in s since the start of the log, on the clock of the system that wrote it, and never go back: see
    `Timeline`. The log is read once to begin with; `progress` gets the share that is read, 0 to 1.

    start: s since 1970 UTC. duration: s. owner: the id of the system that wrote the log. names: those of systems and
    entities. systems: the ids of all senders. tracks: by id, rows of time (s), latitude and longitude (degrees) and
    depth (m). entries: log book entries, with their times. losses: the damage. Raises OSError, SchemaError; ValueError
    for a file without a message.
    """

    def __init__(self, path: Path, progress: ReportProgress | None = None) -> None:
        log = imc.Log(path, keep_index=False)
        self.path: Path = log.path
        self.schema: imc.Schema = log.schema
        self.names: SystemNames = SystemNames()
        self.systems: list[int] = []
        self.tracks: dict[int, list[tuple[float, float, float, float]]] = {}
        self.entries: list[tuple[float, imc.LogBookEntry]] = []
        self._damage = DamageList()
        self._members: Members = []
        self._pieces: list[_Piece] = []
        self._states: list[dict[int, bytes]] = []
        self._near: dict[int, list[tuple[Batch, Floats]]] = {}
        self._position_types = {imc.EstimatedState.ID, imc.LogBookEntry.ID, *NAMING}
        self.owner: int = UNKNOWN_SYSTEM
        self._index(progress)
        self._reader = open_reader(self.path, self._members, _ignore)

    @property
    def losses(self) -> list[imc.Loss]:
        """The damage of the log, by offset."""
        return self._damage.sorted()

    def close(self) -> None:
        """Close the file."""
        self._reader.__exit__(None, None, None)

    def state_at(self, time: float) -> list[bytes]:
        """The last packet of each message and entity that is due up to a time (s)."""
        last = self._piece_at(time)
        stored = last // PIECES_OF_STATE
        latest = dict(self._states[stored])
        for number in range(stored * PIECES_OF_STATE, last + 1):
            for batch, due in self._piece(number):
                _keep_last(latest, batch, due <= time)
        return list(latest.values())

    def changes(self, begin: float, end: float) -> list[bytes]:
        """The last packet of each message and entity that is due after `begin`, and up to `end` (s)."""
        latest: dict[int, bytes] = {}
        for number in range(self._piece_at(begin), self._piece_at(end) + 1):
            for batch, due in self._piece(number):
                _keep_last(latest, batch, (due > begin) & (due <= end))
        return list(latest.values())

    def _index(self, progress: ReportProgress | None) -> None:
        timeline, latest = Timeline(LONGEST_PAUSE), dict[int, bytes]()
        senders, drawn = set[int](), dict[int, float]()
        chunks = unpacked_chunks(self.path, self._damage, self._members, progress)
        for batch in scan(chunks, self.schema.sync, self._damage):
            if not self._pieces:
                self.owner = int(batch.header_values("src")[0])
            if len(self._pieces) % PIECES_OF_STATE == 0:
                self._states.append(dict(latest))
            offset = batch.base + int(batch.starts[0])
            self._pieces.append(_Piece(offset, timeline.elapsed, copy.copy(timeline)))
            due = _due_times(batch, self.owner, timeline)
            senders.update(np.unique(batch.header_values("src")).tolist())
            _keep_last(latest, batch, np.ones(due.size, np.bool_))
            self._note(batch, due, drawn)
        if not self._pieces:
            raise ValueError(f"{self.path}: there is no message in this log")
        self.systems = sorted(senders - {UNKNOWN_SYSTEM, BROADCAST})
        self.start: float = timeline.origin if math.isfinite(timeline.origin) else 0.0
        self.duration: float = timeline.elapsed

    def _note(self, batch: Batch, due: Floats, drawn: dict[int, float]) -> None:
        """Store names, log book entries, and places of the tracks."""
        wanted = np.isin(batch.heads & 0xFFFF, list(self._position_types))
        sources: list[int] = batch.header_values("src")[wanted].tolist()
        for (_, packet), time, source in zip(
            batch.select(wanted).packets(), due[wanted].tolist(), sources, strict=True
        ):
            is_place = imc.packet_id(packet) == imc.EstimatedState.ID
            if is_place and time - drawn.get(source, -math.inf) < TRACK_PERIOD:
                continue
            try:
                message = self.schema.decode(packet)
            except imc.DecodeError:
                continue
            if isinstance(message, imc.EstimatedState):
                drawn[source] = time
                self._extend_track(source, time, message)
            elif isinstance(message, imc.LogBookEntry):
                self.entries.append((time, message))
            else:
                self.names.learn(message)

    def _extend_track(self, source: int, time: float, state: imc.EstimatedState) -> None:
        lat, lon, _ = absolute_position(state)
        row = time, round(math.degrees(lat), 6), round(math.degrees(lon), 6), round(state.depth, 1)
        track = self.tracks.setdefault(source, [])
        if all(map(math.isfinite, row)) and (lat, lon) != (0.0, 0.0):
            track.append(row)
        if len(track) > MOST_TRACK:
            del track[1::2]

    def _piece_at(self, time: float) -> int:
        """The last piece that begins up to a time."""
        return max(0, bisect_right(self._pieces, time, key=lambda piece: piece.due) - 1)

    def _piece(self, number: int) -> list[tuple[Batch, Floats]]:
        """The packets of a piece, and when they are due."""
        found = self._near.get(number)
        if found is not None:
            return found
        begin = self._pieces[number].offset
        end = self._pieces[number + 1].offset if number + 1 < len(self._pieces) else 1 << 62
        data = self._read(begin, end)
        timeline = copy.copy(self._pieces[number].timeline)
        batches = scan([data], self.schema.sync, _ignore)
        found = [(batch, _due_times(batch, self.owner, timeline)) for batch in batches]
        self._near[number] = found
        for old in list(islice(self._near, max(0, len(self._near) - KEPT_PIECES))):
            del self._near[old]
        return found

    def _read(self, begin: int, end: int) -> bytes:
        return bytes(self._reader.read_range(begin, min(end, begin + (1 << 24))))


def _due_times(batch: Batch, owner: int, timeline: Timeline) -> Floats:
    """The times at which the packets of a batch are due (s since the start of the log); it advances the time line."""
    times, own = batch.times(), batch.header_values("src") == owner
    due = np.empty(times.size)
    for begin in range(0, times.size, TOGETHER):
        part = slice(begin, begin + TOGETHER)
        given = times[part][own[part] & np.isfinite(times[part])]
        before = timeline.elapsed
        if given.size and math.isnan(timeline.origin):
            timeline.advance_to_packet(float(given[0]))
        after = timeline.advance_to_packet(float(given.max())) if given.size else before
        offsets = np.where(own[part] & np.isfinite(times[part]), times[part] - timeline.origin, before)
        due[part] = np.maximum.accumulate(np.clip(offsets, before, after))
    return due


def _keep_last(latest: dict[int, bytes], batch: Batch, wanted: Any) -> None:
    """Store the last one of the wanted packets of each message and entity; the newest is behind all others."""
    rows = np.flatnonzero(wanted & ((batch.ends - batch.starts) <= LARGEST))
    if not rows.size:
        return
    sources = batch.header_values("src")[rows].astype(np.int64)
    keys = (batch.heads[rows] & 0xFFFF).astype(np.int64) << 24 | sources << 8 | batch.header_values("src_ent")[rows]
    found, from_behind = np.unique(keys[::-1], return_index=True)
    last = rows[rows.size - 1 - from_behind]
    order = np.argsort(last)
    starts, ends = batch.starts[last[order]].tolist(), batch.ends[last[order]].tolist()
    for key, begin, end in zip(found[order].tolist(), starts, ends, strict=True):
        latest.pop(key, None)
        latest[key] = bytes(batch.data[begin:end])


def _ignore(offset: int, length: int, reason: str) -> None:
    """Damage that is listed already."""
