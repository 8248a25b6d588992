"""Reads what a report shows of a log: track, states, log book, plans, detections."""

import math
from collections import Counter
from dataclasses import dataclass, field
from typing import Any, NamedTuple

import numpy as np

import imc
from imc import coordinates
from runtime.logs import Array, LogSummary
from shoal.logs.inspect.detection_scores import DetectionScore, DetectionScoreError, score_detections
from support import wgs84

FARTHEST = 1e6  # any offset, depth, angle or speed beyond it is invalid
AFLOAT = 0.1  # m; a vehicle that is never deeper stays at the surface
MOST_ENTRIES = 20000  # of the log book to keep
QUIET = ("NORMAL", "BOOT")  # states in which a change of the text does not matter
_NEEDED = {
    "EstimatedState": {"lat", "lon", "x", "y"},
    "EstimatedMugState": {"id", "x", "y"},
    "EntityState": {"state", "description"},
    "LogBookEntry": {"type", "context", "text"},
    "PlanControlState": {"state", "plan_id", "plan_progress", "man_id"},
    "VehicleState": {"op_mode", "last_error"},
}
_STATE = ("lat", "lon", "height", "x", "y", "depth", "alt", "phi", "theta", "psi", "vx", "vy", "vz")


class TimeSpan(NamedTuple):
    """A span of time (s since the log's start) with one value."""

    begin: float
    end: float
    value: str
    text: str = ""


class LogbookLine(NamedTuple):
    """A line of the log book; `level` is INFO, WARNING, ERROR, CRITICAL or DEBUG."""

    time: float
    level: str
    context: str
    text: str


class VehicleMotion(NamedTuple):
    """Arrays of one length: time (s since the log's start), north and east of the origin, depth, altitude (m; NaN where
    unknown), roll, pitch, heading (rad), speed over ground (m/s)."""

    time: Array
    north: Array
    east: Array
    depth: Array
    altitude: Array
    roll: Array
    pitch: Array
    heading: Array
    speed: Array


class GliderDetections(NamedTuple):
    """Arrays of one length: time (s since the log's start), id, north and east of the origin (m)."""

    time: Array
    id: Array
    north: Array
    east: Array


@dataclass
class ReportData:
    """The content of a report. origin: latitude, longitude (rad) of north = east = 0; None without position."""

    summary: LogSummary
    motion: VehicleMotion
    detections: GliderDetections
    origin: tuple[float, float] | None = None
    entities: dict[str, list[TimeSpan]] = field(default_factory=dict[str, list[TimeSpan]])
    modes: list[TimeSpan] = field(default_factory=list[TimeSpan])
    maneuvers: list[TimeSpan] = field(default_factory=list[TimeSpan])
    progress: tuple[Array, Array] = field(default_factory=lambda: (np.empty(0), np.empty(0)))
    entries: list[LogbookLine] = field(default_factory=list[LogbookLine])
    levels: Counter[str] = field(default_factory=Counter[str])
    detection_scores: list[DetectionScore] = field(default_factory=list[DetectionScore])
    unscored_reason: str = ""

    @property
    def distance(self) -> float:
        """Length of the track in m, as `track_length`."""
        return track_length(self.motion)

    @property
    def is_surface_vehicle(self) -> bool:
        """Whether depth is known and always at the surface."""
        known = self.motion.depth[np.isfinite(self.motion.depth)]
        return len(known) > 0 and float(np.abs(known).max()) < AFLOAT


def read_report_data(log: imc.Log, summary: LogSummary) -> ReportData:
    """Read the owner's messages of a log that a report needs; its times are seconds since the log's start."""
    collected: dict[str, list[Any]] = {kind: [] for kind in _NEEDED}
    types = log.schema.types
    wanted = [
        kind
        for kind, names in _NEEDED.items()
        if kind in types and names <= {field.attribute for field in types[kind].fields}
    ]
    levels: Counter[str] = Counter()
    for message in log.messages(*wanted):
        if message.src != summary.owner or not math.isfinite(message.timestamp):
            continue
        kind = type(message).__name__
        if kind == "LogBookEntry":
            levels[_level(message)] += 1
            if len(collected[kind]) >= MOST_ENTRIES:
                continue
        collected[kind].append(_state(message) if kind == "EstimatedState" else message)
    motion, origin = _motion(collected["EstimatedState"], summary)
    content = ReportData(
        summary, motion, _detections(collected["EstimatedMugState"], motion, summary), origin, levels=levels
    )
    _states(content, collected["EntityState"])
    _plans(content, collected["PlanControlState"])
    _modes(content, collected["VehicleState"])
    for entry in collected["LogBookEntry"]:
        content.entries.append(LogbookLine(entry.timestamp - summary.start, _level(entry), entry.context, entry.text))
    content.entries.sort(key=lambda entry: entry.time)
    try:
        content.detection_scores = score_detections(
            log, summary, lambda entity: summary.names.entity_label(summary.owner, entity)
        )
    except DetectionScoreError as error:
        content.unscored_reason = str(error)
    return content


def track_length(motion: VehicleMotion, least: float = 1.0) -> float:
    """The distance over ground in m, in steps of at least `least` m, so that noise at rest adds nothing."""
    total, north, east = 0.0, math.nan, math.nan
    for n, e in zip(motion.north.tolist(), motion.east.tolist(), strict=True):
        step = math.hypot(n - north, e - east)
        if not step < least:
            total += 0.0 if math.isnan(step) else step
            north, east = n, e
    return total


def _state(message: Any) -> tuple[float, ...]:
    return (message.timestamp, message.src_ent, *(getattr(message, name, math.nan) for name in _STATE))


def _motion(rows: list[tuple[float, ...]], summary: LogSummary) -> tuple[VehicleMotion, tuple[float, float] | None]:
    """The states of the entity that sends most of them, ordered by time, and the origin of their offsets."""
    table = np.array(rows, float).reshape(len(rows), 2 + len(_STATE))
    within = (table[:, 0] >= summary.start - 1.0) & (table[:, 0] <= summary.end + 1.0)
    possible = (np.abs(table[:, 2]) <= math.pi / 2) & (np.abs(table[:, 3]) <= math.tau)
    table = table[within & possible & (np.abs(table[:, 5:7]) < FARTHEST).all(axis=1)]
    somewhere = (table[:, 2:4] != coordinates.NOWHERE).any(axis=1)
    if somewhere.any():
        table = table[somewhere]
    values = table[:, 7:]
    values[~(np.abs(values) < FARTHEST)] = np.nan
    if len(table) == 0:
        empty = np.empty(0)
        return VehicleMotion(*(empty,) * 9), None
    speakers, counts = np.unique(table[:, 1], return_counts=True)
    table = table[table[:, 1] == speakers[counts.argmax()]]
    table = table[np.argsort(table[:, 0], kind="stable")]
    lat, lon, _, x, y, depth, altitude, roll, pitch, heading, vx, vy, vz = table[:, 2:].T
    references, places = np.unique(np.column_stack((lat, lon)), axis=0, return_inverse=True)
    origin = (float(lat[0]), float(lon[0]))
    points: list[tuple[float, float]] = references.tolist()
    offsets = np.array([wgs84.offset(*origin, *point) for point in points])
    north, east = (offsets[places.reshape(-1)] + np.column_stack((x, y))).T
    motion = VehicleMotion(
        table[:, 0] - summary.start,
        north,
        east,
        np.where(depth > -1.0, depth, np.nan),
        np.where(altitude >= 0.0, altitude, np.nan),
        roll,
        pitch,
        heading,
        np.sqrt(vx * vx + vy * vy + vz * vz),
    )
    return motion, origin


def _detections(messages: list[Any], motion: VehicleMotion, summary: LogSummary) -> GliderDetections:
    """Places of detected MUGs: the vehicle's position at that time plus the offset."""
    if len(motion.time) == 0:
        return GliderDetections(*(np.empty(0),) * 4)
    known = [message for message in messages if abs(message.x) < FARTHEST and abs(message.y) < FARTHEST]
    time = np.array([message.timestamp - summary.start for message in known])
    north = np.array([message.x for message in known]) + np.interp(time, motion.time, motion.north)
    east = np.array([message.y for message in known]) + np.interp(time, motion.time, motion.east)
    return GliderDetections(time, np.array([message.id for message in known], np.int64), north, east)


def _states(content: ReportData, messages: list[Any]) -> None:
    names, owner = content.summary.names, content.summary.owner
    by_entity: dict[int, list[Any]] = {}
    for message in messages:
        by_entity.setdefault(message.src_ent, []).append(message)
    for number, states in by_entity.items():
        label = names.entity_label(owner, number)
        if label in content.entities:
            label = f"{label} ({number})"
        rows = [(m.timestamp, _named(imc.EntityState.State, m.state), m.description) for m in states]
        content.entities[label] = _stretches(rows, content.summary)


def _modes(content: ReportData, messages: list[Any]) -> None:
    rows = [(m.timestamp, _named(imc.VehicleState.OpMode, m.op_mode), m.last_error) for m in messages]
    content.modes = _stretches(rows, content.summary, by_text=False)


def _plans(content: ReportData, messages: list[Any]) -> None:
    messages.sort(key=lambda message: message.timestamp)
    rows = [
        (
            message.timestamp,
            message.man_id if message.state == imc.PlanControlState.State.EXECUTING else "",
            f"{message.plan_id}: {_named(imc.PlanControlState.State, message.state)}",
        )
        for message in messages
    ]
    content.maneuvers = [stretch for stretch in _stretches(rows, content.summary) if stretch.value]
    times = np.array([message.timestamp - content.summary.start for message in messages])
    percent = np.array([message.plan_progress for message in messages], float)
    content.progress = (times, np.where((percent >= 0.0) & (percent <= 100.0), percent, np.nan))


def _stretches(rows: list[tuple[float, str, str]], summary: LogSummary, by_text: bool = True) -> list[TimeSpan]:
    """Consecutive equal values as one stretch; the last one lasts until the end of the log."""
    found: list[TimeSpan] = []
    for time, value, text in sorted(rows, key=lambda row: row[0]):
        at = min(max(time - summary.start, 0.0), summary.duration)
        if found and found[-1].value == value and (found[-1].text == text or value in QUIET or not by_text):
            continue
        if found:
            found[-1] = found[-1]._replace(end=at)
        found.append(TimeSpan(at, summary.duration, value, text))
    return found


def _level(message: Any) -> str:
    return _named(imc.LogBookEntry.Type, message.type)


def _named(values: Any, number: int) -> str:
    return values(number).name if number in values._value2member_map_ else str(number)
