"""Finds what is wrong with a log, explains it, and writes a clean one."""

import math
from dataclasses import dataclass
from pathlib import Path

import imc
from imc.discovery import displayable_name
from imc.lsf import ParallelMap, ReportProgress
from imc.reserved_ids import UNKNOWN_ENTITY
from runtime.logs import LogSummary, PacketBlock, create_log, summarize, type_name
from shoal.logs.inspect.gaps import MessageIntervals
from shoal.logs.inspect.packet_definition_check import SchemaCheck
from shoal.logs.inspect.time_size_text import format_duration, format_noun_count, format_time
from support.diagnostics import Finding

MOST_PLACES = 5
NEARLY_ALL = 250  # of 255 entity ids
CLOCKS_APART = 2.0  # s
LONG_ENOUGH = 0.2  # share of the log in which a message must come regularly
DUNE_ONLY = {719: "ManeuverDone", 720: "StationKeepingExtended"}


@dataclass
class Examination:
    """Findings in a log; `summary` is None if there is nothing to read."""

    log: imc.Log
    findings: list[Finding]
    summary: LogSummary | None = None

    @property
    def healthy(self) -> bool:
        return all(finding.severity == "note" for finding in self.findings)


class _EndMarks:
    """Notes whether the log ends as it should."""

    def __init__(self, schema: imc.Schema):
        self._schema = schema
        self.stopped = False

    def __call__(self, block: PacketBlock) -> None:
        last = block.packets[-1]
        try:
            message = self._schema.decode(last)
        except imc.DecodeError:
            self.stopped = False
            return
        stop = imc.LoggingControl.Op.STOPPED
        self.stopped = type(message).__name__ == "LoggingControl" and getattr(message, "op", None) == stop


def examine_log(path: Path, progress: ReportProgress | None = None, spread: ParallelMap | None = None) -> Examination:
    """Read a log once and check it; `spread` is that of imc.Log. Raises FileNotFoundError, OSError."""
    try:
        log, findings = imc.Log(path, spread=spread), list[Finding]()
    except imc.SchemaError as error:
        log = imc.Log(path, schema=imc.builtin(), spread=spread)
        text = f"the definitions beside the log are bad: {error}"
        findings = [Finding("error", text, meaning="Readers reject them.", remedy="--repair writes the built-in ones.")]
    else:
        if log.schema_source is None:
            text = "there is no IMC.xml or IMC.xml.gz beside the log"
            meaning = "The built-in definitions are used; messages of another version may be misread."
            findings.append(Finding("warning", text, (), meaning, "Copy the vehicle's file, or use --repair."))
    length = log.path.stat().st_size
    layouts, rhythms, marks = SchemaCheck(log.schema), MessageIntervals(), _EndMarks(log.schema)
    summary = summarize(log, progress, (layouts, rhythms, marks))
    if summary.packets == 0:
        text = f"none of its {length} bytes belongs to a message" if length else "the file is empty"
        return Examination(log, [Finding("error", text, meaning="This is not an LSF log, or nothing of it is left.")])
    findings += _damage(summary)
    findings += [*_layouts(layouts, log.schema), *_clocks(summary), *_gaps(rhythms, summary), *_entities(summary)]
    if not marks.stopped:
        text = "the log does not end with LoggingControl STOPPED"
        meaning = "The vehicle stopped abruptly, or this is a part of a log; the last seconds may be missing."
        findings.append(Finding("note", text, meaning=meaning))
    return Examination(log, findings, summary)


def repair_log(examination: Examination, folder: Path) -> int:
    """Write the good packets and definitions to a new log; returns the number of packets.

    Raises FileExistsError, OSError; ValueError if there are none.
    """
    log, count = examination.log, 0
    with create_log(folder, log) as writer:
        for _, packet in log.packets():
            writer.write(packet)
            count += 1
        if count == 0:
            raise ValueError("there is no message to save; nothing is written")
    return count


CUT = (
    "The file ends within compressed data: its writer was killed, power was lost, or a copy is incomplete. "
    "Other readers, such as Neptus, may reject the file."
)
_REASONS = (
    ("wrong CRC", "error", "Bytes of packets have changed: a bad disk, a bad copy, or a transfer in text mode."),
    ("packet cut short", "warning", "The log ends within a packet: power was lost, or a copy is incomplete."),
    ("no packet begins here", "error", "There are other bytes between the packets."),
    (
        "member",
        "error",
        "The compressed file is damaged or cut, or a power cut left zeros in it; what follows in this part is lost.",
    ),
)


def _damage(summary: LogSummary) -> list[Finding]:
    groups: dict[tuple[str, str, str], list[imc.Loss]] = {}
    for loss in summary.losses:
        known = next((row for row in _REASONS if loss.reason.startswith(row[0])), ("", "error", ""))
        if known[0] == "member" and loss.reason.endswith("cut short"):
            known = ("cut", "warning", CUT)
        groups.setdefault(known, []).append(loss)
    found: list[Finding] = []
    for (reason, severity, meaning), losses in groups.items():
        what = reason if reason not in ("", "member", "cut") else losses[0].reason
        what = "damaged compression" if reason == "member" else "cut compressed data" if reason == "cut" else what
        lost = sum(loss.length for loss in losses)
        text = f"damage: {what}: {format_noun_count(len(losses), 'place')}" + (
            f", {format_noun_count(lost, 'byte')}" if lost else ""
        )
        places = _few([f"byte {at}: {format_noun_count(length, 'byte')}: {why}" for at, length, why in losses])
        remedy = "All packets around it can be read; --repair writes them to a clean log."
        found.append(Finding("warning" if severity == "warning" else "error", text, places, meaning, remedy))
    return found


def _layouts(layouts: SchemaCheck, schema: imc.Schema) -> list[Finding]:
    found: list[Finding] = []
    for identity, misfits in sorted(layouts.mismatches.items()):
        name = type_name(schema, identity)
        count = sum(misfit.packets for misfit in misfits)
        places = _few([f"from byte {at}: {format_noun_count(times, 'packet')}: {how}" for how, times, at in misfits])
        text = f"the definitions contradict the packets: {name}, {format_noun_count(count, 'packet')}"
        meaning = "The log was written with another version of this message; its values may be misread."
        found.append(Finding("error", text, places, meaning, "Put the right IMC.xml beside Data.lsf."))
    if layouts.unknown:
        places = _few(
            [
                f"id {identity}: {format_noun_count(count, 'packet')}"
                + (f", {DUNE_ONLY[identity]} in newer versions of DUNE" if identity in DUNE_ONLY else "")
                for identity, count in sorted(layouts.unknown.items())
            ]
        )
        text = (
            f"messages that the definitions do not have: {format_noun_count(sum(layouts.unknown.values()), 'packet')}"
        )
        meaning = "They are kept, but their fields cannot be read."
        found.append(Finding("warning", text, places, meaning, "Put the right IMC.xml beside Data.lsf."))
    return found


def _clocks(summary: LogSummary) -> list[Finding]:
    found: list[Finding] = []
    if summary.clock_steps:
        places = _few(
            [
                f"byte {step.offset}: {summary.names.system_name(step.src)} "
                f"by {format_duration(step.after - step.before)} at {format_time(step.before)}"
                for step in summary.clock_steps
            ]
        )
        text = f"clocks jump: {format_noun_count(len(summary.clock_steps), 'time')}"
        meaning = "The clock was set during the log, or nothing was recorded for a while; curves over time break there."
        found.append(Finding("warning", text, places, meaning, "Cut the log at the jump: shoal log cut --from/--to."))
    for src, clock in summary.clocks.items():
        who = summary.names.system_name(src)
        if clock.outliers:
            text = f"{format_noun_count(clock.outliers, 'message')} of {who} with times far from those around them"
            found.append(Finding("note", text, meaning="They were stored and logged later, or have no time."))
        apart = clock.start - summary.start if clock.start < summary.start else max(0.0, clock.end - summary.end)
        if src != summary.owner and math.isfinite(apart) and abs(apart) > CLOCKS_APART:
            text = f"the clock of {who} is off: it is {format_duration(apart)} outside the log's time"
            meaning = "Its messages appear at the wrong time among those of others."
            found.append(Finding("warning", text, meaning=meaning))
    return found


def _gaps(rhythms: MessageIntervals, summary: LogSummary) -> list[Finding]:
    rows: list[tuple[float, str]] = []
    for (identity, src, entity), rhythm in rhythms.found.items():
        if src == summary.owner and (gaps := rhythm.gaps(summary.end, LONG_ENOUGH * summary.duration)):
            more = f", and {len(gaps) - 1} more" if len(gaps) > 1 else ""
            who = f"{type_name(summary.schema, identity)} of {summary.names.entity_label(src, entity)}"
            when = f"silent for {format_duration(gaps[0].length)} from {format_time(gaps[0].begin)}"
            rows.append((gaps[0].length, f"{who} (every {rhythm.period:.2g} s): {when}{more}"))
    if not rows:
        return []
    rows.sort(reverse=True)
    text = f"gaps in regular messages: {format_noun_count(len(rows), 'kind')} of message"
    meaning = "A device or task stopped sending; some do so on purpose, such as controllers between maneuvers."
    return [Finding("note", text, _few([row for _, row in rows]), meaning)]


def _entities(summary: LogSummary) -> list[Finding]:
    names, found = summary.names, list[Finding]()
    own = [(src, entity) for src, entity in summary.by_entity if src == summary.owner]
    nameless = [key for key in own if key[1] != UNKNOWN_ENTITY and key not in names.labels]
    if nameless:
        places = _few([f"entity {entity} of {names.system_name(src)}" for src, entity in sorted(nameless)])
        text = f"{format_noun_count(len(nameless), 'entity', 'entities')} without a label"
        meaning = "No EntityInfo or EntityList names them; only their numbers distinguish them."
        found.append(Finding("note", text, places, meaning))
    if (tally := summary.by_entity.get((summary.owner, UNKNOWN_ENTITY))) is not None:
        text = f"{format_noun_count(tally.count, 'message')} of entity 255, which means none"
        found.append(Finding("note", text, meaning="Their sender did not set its entity."))
    for src in summary.clocks:
        ids = {entity for system, entity in {**names.labels, **dict.fromkeys(summary.by_entity)} if system == src}
        ids.discard(UNKNOWN_ENTITY)
        if len(ids) >= NEARLY_ALL:
            text = f"{names.system_name(src)} has {format_noun_count(len(ids), 'entity', 'entities')}"
            meaning = "There are only 255 ids; all further entities share 255, and cannot be distinguished."
            found.append(Finding("warning", text, (), meaning, "Disable tasks that the vehicle does not need."))
    if names.earlier:
        several: list[str] = []
        for (src, entity), labels in sorted(names.earlier.items()):
            each = [*map(displayable_name, labels), names.entity_label(src, entity)]
            several.append(f"entity {entity} of {names.system_name(src)}: {', '.join(_few(each))}")
        text = f"{format_noun_count(len(names.earlier), 'entity', 'entities')} with several labels"
        meaning = "The log has several runs of a vehicle; readers use one label for all of it."
        found.append(Finding("warning", text, _few(several), meaning, "Look at the runs one by one: shoal log cut."))
    return found


def _few(places: list[str]) -> tuple[str, ...]:
    more = len(places) - MOST_PLACES
    return tuple(places[:MOST_PLACES]) + ((f"and {more} more",) if more > 0 else ())
