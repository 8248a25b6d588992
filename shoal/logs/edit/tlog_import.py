"""Converts a .tlog file to a log: each autopilot becomes a system, its MAVLink messages become IMC messages."""

from dataclasses import dataclass
from pathlib import Path

from imc.lsf import ReportProgress
from mavlink import AUTOPILOT_NONE, GROUND_STATION, Dialect, ReceivedMessage, Tlog, lacks_times, load_dialect
from mavlink.translate import AutopilotTranslator, TransactionTranslator
from shoal.logs.edit.import_writer import (
    CONVERSION_ERRORS,
    ImportReport,
    NothingToImport,
    SkippedRecords,
    SystemLogWriter,
    open_writer,
)

AUTOPILOT = 1  # component


@dataclass
class _ImportedSystem:
    number: int
    log: SystemLogWriter
    translator: AutopilotTranslator
    transactions: TransactionTranslator
    skipped: SkippedRecords

    def translate(self, message: ReceivedMessage, time: float) -> None:
        self.log.write_preamble(time, self.translator.system_type, self.number)
        for translator in (self.translator, self.transactions):
            ours = translator is self.transactions or message.component == AUTOPILOT
            if ours and message.name in translator.message_names:
                try:
                    self.log.write(translator.translate(message, time))
                except CONVERSION_ERRORS:
                    self.skipped.count_record(message.name, time)


def import_tlog(path: Path, folder: Path, system: str = "", progress: ReportProgress = lambda _: None) -> ImportReport:
    """Write Data.lsf.gz and IMC.xml.gz to `folder`; `progress` gets the share that is read.

    Each autopilot becomes a system "mavlink-<id>"; the first is `system`, if given. Ground stations, cameras and
    gimbals are skipped. Times are those at which the recorder received the frames. Raises NothingToImport, OSError.
    """
    dialect = load_dialect()
    kinds = _kinds(path, dialect)
    tlog = Tlog(path, dialect)
    if lacks_times(path, dialect):
        raise NothingToImport(
            f"{path}: MAVLink frames without times, as in a .tlog.raw of MAVProxy: their times of arrival are unknown; "
            "import the .tlog beside it"
        )
    if not kinds:
        raise NothingToImport(f"{path}: not an MCAP, .tlog, .BIN or .ulg file: no autopilot in its {tlog.size} bytes")
    last, skipped = 0.0, SkippedRecords()
    writer = open_writer(folder)
    try:
        systems: dict[int, _ImportedSystem] = {}
        for number, (kind, autopilot) in kinds.items():
            name = system if system and not systems else f"mavlink-{number}"
            transactions = TransactionTranslator(dialect, number, kind, autopilot)
            translator = AutopilotTranslator(dialect, kind)
            systems[number] = _ImportedSystem(
                number, SystemLogWriter(writer, name, path.stem), translator, transactions, skipped
            )
        wanted = frozenset[str]().union(
            *(imported.translator.message_names | imported.transactions.message_names for imported in systems.values())
        )
        for number, (time, message) in enumerate(tlog.read(wanted)):
            imported = systems.get(message.system)
            if imported is not None and message.component == AUTOPILOT:
                imported.translate(message, time)
                last = time
            asked = systems.get(message.values.get("target_system", 0)) if imported is None else None
            if asked is not None and asked.log.count:  # a station has sent it something
                asked.translate(message, time)
            if number % 1000 == 0:
                progress(tlog.position / tlog.size)
        for imported in systems.values():
            imported.log.write(imported.transactions.finish(last))
            imported.log.write_log_end(last)
    finally:
        writer.close()
    counts = {imported.log.name: imported.log.count for imported in systems.values()}
    return ImportReport(tlog.frames, tlog.lost, tlog.first_lost, counts, skipped.texts(path), skipped.total)


def _kinds(path: Path, dialect: Dialect) -> dict[int, tuple[int, int]]:
    """MAV_TYPE and MAV_AUTOPILOT of the systems with an autopilot, by MAVLink id."""
    found: dict[int, tuple[int, int]] = {}
    for _, message in Tlog(path, dialect).read(frozenset({"HEARTBEAT"})):
        if message.system in found or message.component != AUTOPILOT:
            continue
        kind, autopilot = message.values["type"], message.values["autopilot"]
        if kind != GROUND_STATION and autopilot != AUTOPILOT_NONE:
            found[message.system] = kind, autopilot
    return found
