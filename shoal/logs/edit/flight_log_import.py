"""Converts the log that an autopilot has written itself, DataFlash or ULog, to a log of one system."""

from collections.abc import Iterator
from pathlib import Path
from typing import Protocol

import imc
from imc.lsf import ReportProgress
from mavlink import LogRecord, dataflash, load_dialect, ulog
from mavlink.translate import DataFlashTranslator, LoggedFlight, ULogTranslator, scan_dataflash, scan_ulog
from shoal.logs.edit.import_writer import (
    CONVERSION_ERRORS,
    ImportReport,
    NothingToImport,
    SkippedRecords,
    SystemLogWriter,
    open_writer,
)


class _FlightLog(Protocol):
    path: Path
    size: int
    position: int
    lost: int
    first_lost: int
    records: int

    def read(self, names: frozenset[str]) -> Iterator[LogRecord]: ...


class _Translator(Protocol):
    @property
    def record_names(self) -> frozenset[str]: ...
    def translate(self, record: LogRecord) -> Iterator[tuple[str, imc.Message]]: ...
    def finish(self, time: float) -> Iterator[tuple[str, imc.Message]]: ...


def import_dataflash(
    path: Path, folder: Path, system: str = "", progress: ReportProgress = lambda _: None
) -> ImportReport:
    """Write Data.lsf.gz and IMC.xml.gz to `folder`; `progress` gets the share that is read.

    The vehicle is `system`, or "mavlink-<id>". Times are UTC if a GPS has given it, else they count from the start of
    the autopilot, and a note reports it. Raises NothingToImport, OSError.
    """
    log = dataflash.DataFlash(path)
    flight = scan_dataflash(log)
    translator = DataFlashTranslator(flight, load_dialect().enumerations)
    return _import(log, flight, translator, folder, system, progress)


def import_ulog(path: Path, folder: Path, system: str = "", progress: ReportProgress = lambda _: None) -> ImportReport:
    """The same for a ULog file of PX4. Raises BadULog too."""
    log = ulog.ULog(path)
    flight = scan_ulog(log)
    translator = ULogTranslator(flight)
    done = _import(log, flight, translator, folder, system, progress)
    if translator.dropped:
        done.notes.append(f"{path}: the autopilot missed {translator.dropped:.1f} s of its own log")
    return done


def _import(
    log: _FlightLog, flight: LoggedFlight, translator: _Translator, folder: Path, system: str, progress: ReportProgress
) -> ImportReport:
    writer = open_writer(folder)
    skipped = SkippedRecords()
    last = 0.0
    try:
        vehicle = SystemLogWriter(writer, system or f"mavlink-{flight.system}", log.path.stem)
        for count, record in enumerate(log.read(translator.record_names)):
            time = record.time + (flight.start or 0.0)
            vehicle.write_preamble(time, flight.system_type, flight.system)
            try:
                vehicle.write(translator.translate(record))
            except CONVERSION_ERRORS:
                skipped.count_record(record.name, time)
            last = time
            if count % 1000 == 0:
                progress(log.position / log.size)
        if not vehicle.count:
            raise NothingToImport(f"{log.path}: nothing in its {log.size} bytes is known of an autopilot")
        vehicle.write(translator.finish(last))
        vehicle.write_log_end(last)
    finally:
        writer.close()
    notes = [f"{log.path}: no GPS has given the time: times count from the start of the autopilot"]
    notes = notes if flight.start is None else []
    notes += skipped.texts(log.path)
    return ImportReport(log.records, log.lost, log.first_lost, {vehicle.name: vehicle.count}, notes, skipped.total)
