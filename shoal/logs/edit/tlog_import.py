"""Converts a .tlog file to a log: each autopilot becomes a system, its MAVLink messages become IMC messages."""

from dataclasses import dataclass, field
from pathlib import Path

import imc
from imc.addresses import UNKNOWN_ENTITY, UNKNOWN_SYSTEM
from imc.lsf import LsfWriter, packed_schema
from mavlink import AUTOPILOT_NONE, ENTITIES, GROUND_STATION, AutopilotTranslator, Dialect, Tlog, load_dialect
from runtime.profile import derived_id, load_profile, own_etc
from shoal.logs.export import ReportBytes

AUTOPILOT = 1  # component


class BadTlog(ValueError):
    """A file without an autopilot; the text says which."""


@dataclass
class Imported:
    """What was imported: frames in the file, bytes outside of frames, IMC messages written, by system."""

    frames: int = 0
    lost: int = 0
    messages: dict[str, int] = field(default_factory=dict[str, int])


@dataclass
class _System:
    name: str
    id: int
    translator: AutopilotTranslator
    labels: dict[str, int]
    count: int = 0


def import_tlog(path: Path, folder: Path, system: str = "", progress: ReportBytes = lambda _: None) -> Imported:
    """Write Data.lsf.gz and IMC.xml.gz to `folder`; `progress` gets the bytes read.

    Each autopilot becomes a system "mavlink-<id>"; the first is `system`, if given. Ground stations, cameras and
    gimbals are skipped. Times are those at which the recorder received the frames. Raises BadTlog, OSError.
    """
    dialect = load_dialect()
    systems = _systems(path, dialect, system)
    tlog = Tlog(path, dialect)
    if not systems:
        nothing = f"neither an MCAP file nor a .tlog: no autopilot in its {tlog.size} bytes"
        why = nothing if tlog.size else "the file is empty"
        raise BadTlog(f"{path}: {why}")
    (folder / "IMC.xml.gz").write_bytes(packed_schema(imc.builtin()))
    writer = LsfWriter(folder / "Data.lsf.gz")
    last = 0.0
    try:
        for number, (time, message) in enumerate(tlog.read(AutopilotTranslator(dialect).kinds)):
            heard = systems.get(message.system)
            if heard is not None and message.component == AUTOPILOT:
                if not heard.count:
                    _introduce(writer, heard, time, path.stem)
                for label, said in heard.translator.hear(message, time):
                    _say(writer, heard, label, said)
                last = time
            if number % 1000 == 0:
                progress(tlog.position)
        for heard in systems.values():
            stop = imc.LoggingControl(timestamp=last, op=imc.LoggingControl.Op.STOPPED, name=path.stem)
            _say(writer, heard, ENTITIES[0], stop)
    finally:
        writer.close()
    return Imported(tlog.frames, tlog.lost, {heard.name: heard.count for heard in systems.values()})


def _systems(path: Path, dialect: Dialect, first: str) -> dict[int, _System]:
    """The systems with an autopilot, by MAVLink id."""
    found: dict[int, _System] = {}
    for _, message in Tlog(path, dialect).read(frozenset({"HEARTBEAT"})):
        if message.system in found or message.component != AUTOPILOT:
            continue
        kind, autopilot = message.values["type"], message.values["autopilot"]
        if kind != GROUND_STATION and autopilot != AUTOPILOT_NONE:
            name = first if first and not found else f"mavlink-{message.system}"
            labels = {label: number for number, label in enumerate(ENTITIES, 1)}
            found[message.system] = _System(name, _address(name), AutopilotTranslator(dialect, kind), labels)
    return found


def _address(name: str) -> int:
    systems = load_profile(own_etc() / "common" / "imc-addresses.ini", vehicle=name).systems
    return systems.get(name, derived_id(name))


def _introduce(writer: LsfWriter, heard: _System, time: float, log: str) -> None:
    start = imc.LoggingControl(timestamp=time, op=imc.LoggingControl.Op.STARTED, name=log)
    _say(writer, heard, ENTITIES[0], start)
    announce = imc.Announce(timestamp=time, sys_name=heard.name, sys_type=heard.translator.system_type)
    _say(writer, heard, ENTITIES[0], announce)
    for label in ENTITIES:
        _name(writer, heard, label, time)


def _name(writer: LsfWriter, heard: _System, label: str, time: float) -> None:
    entity = heard.labels.setdefault(label, len(heard.labels) + 1)
    info = imc.EntityInfo(timestamp=time, id=entity, label=label, component="MAVLink")
    _write(writer, heard, entity, info)


def _say(writer: LsfWriter, heard: _System, label: str, message: imc.Message) -> None:
    if label not in heard.labels:
        _name(writer, heard, label, message.timestamp)
    _write(writer, heard, heard.labels[label], message)


def _write(writer: LsfWriter, heard: _System, entity: int, message: imc.Message) -> None:
    writer.write(imc.encode_as(message, message.timestamp, heard.id, entity, UNKNOWN_SYSTEM, UNKNOWN_ENTITY))
    heard.count += 1
