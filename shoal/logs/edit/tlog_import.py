"""Converts a .tlog file to a log: each autopilot becomes a system, its MAVLink messages become IMC messages."""

from dataclasses import dataclass
from pathlib import Path

from imc.lsf import ReportShare
from mavlink import AUTOPILOT_NONE, GROUND_STATION, AutopilotTranslator, Dialect, Tlog, load_dialect
from shoal.logs.edit.imported import Imported, NothingToImport, SystemLog, open_writer

AUTOPILOT = 1  # component


@dataclass
class _System:
    log: SystemLog
    translator: AutopilotTranslator


def import_tlog(path: Path, folder: Path, system: str = "", progress: ReportShare = lambda _: None) -> Imported:
    """Write Data.lsf.gz and IMC.xml.gz to `folder`; `progress` gets the share that is read.

    Each autopilot becomes a system "mavlink-<id>"; the first is `system`, if given. Ground stations, cameras and
    gimbals are skipped. Times are those at which the recorder received the frames. Raises NothingToImport, OSError.
    """
    dialect = load_dialect()
    kinds = _kinds(path, dialect)
    tlog = Tlog(path, dialect)
    if not kinds:
        raise NothingToImport(f"{path}: not an MCAP, .tlog, .BIN or .ulg file: no autopilot in its {tlog.size} bytes")
    last = 0.0
    writer = open_writer(folder)
    try:
        systems: dict[int, _System] = {}
        for number, kind in kinds.items():
            name = system if system and not systems else f"mavlink-{number}"
            systems[number] = _System(SystemLog(writer, name, path.stem), AutopilotTranslator(dialect, kind))
        for number, (time, message) in enumerate(tlog.read(AutopilotTranslator(dialect).kinds)):
            heard = systems.get(message.system)
            if heard is not None and message.component == AUTOPILOT:
                heard.log.introduce(time, heard.translator.system_type)
                heard.log.write(heard.translator.hear(message, time))
                last = time
            if number % 1000 == 0:
                progress(tlog.position / tlog.size)
        for heard in systems.values():
            heard.log.stop(last)
    finally:
        writer.close()
    return Imported(tlog.frames, tlog.lost, {heard.log.name: heard.log.count for heard in systems.values()})


def _kinds(path: Path, dialect: Dialect) -> dict[int, int]:
    """MAV_TYPE of the systems with an autopilot, by MAVLink id."""
    found: dict[int, int] = {}
    for _, message in Tlog(path, dialect).read(frozenset({"HEARTBEAT"})):
        if message.system in found or message.component != AUTOPILOT:
            continue
        kind, autopilot = message.values["type"], message.values["autopilot"]
        if kind != GROUND_STATION and autopilot != AUTOPILOT_NONE:
            found[message.system] = kind
    return found
