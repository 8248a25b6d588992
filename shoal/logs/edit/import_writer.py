"""Common parts of the imports of autopilots' logs: the log that is written, and its report."""

import struct
from collections import Counter
from collections.abc import Iterable
from dataclasses import dataclass, field
from pathlib import Path

import imc
from imc.discovery import Service
from imc.lsf import LsfWriter, gzip_schema
from imc.reserved_ids import UNKNOWN_ENTITY, UNKNOWN_SYSTEM
from mavlink.translate import ENTITIES
from runtime.profile import derived_id, load_profile, own_etc


class NothingToImport(ValueError):
    """A file from which nothing can be imported; the text gives its name and the reason."""


CONVERSION_ERRORS = (ArithmeticError, AttributeError, LookupError, TypeError, ValueError, struct.error, imc.EncodeError)
"""Errors of damaged contents, and of programs with other names of fields."""


class SkippedRecords:
    """Contents of a file that could not be translated, by kind."""

    def __init__(self) -> None:
        self._counts: Counter[str] = Counter()
        self._first: dict[str, float] = {}

    def count_record(self, kind: str, time: float) -> None:
        """Count one; `time` in s, since 1970 UTC or since the start."""
        self._counts[kind] += 1
        self._first.setdefault(kind, time)

    @property
    def total(self) -> int:
        return self._counts.total()

    def texts(self, path: Path) -> list[str]:
        """Notes for people."""
        return [
            f"{path}: {many} of its {kind} skipped: not as expected, the first at {self._first[kind]:.3f} s"
            for kind, many in self._counts.items()
        ]


@dataclass
class ImportReport:
    """Imported content: records in the file, bytes outside of them, IMC messages written, by system.

    first_lost: the place of the first byte outside of records, -1 for none. skipped: records whose contents could not
    be translated. notes: remarks for the user.
    """

    records: int = 0
    lost: int = 0
    first_lost: int = -1
    messages: dict[str, int] = field(default_factory=dict[str, int])
    notes: list[str] = field(default_factory=list[str])
    skipped: int = 0


class SystemLogWriter:
    """One system of a log that is written: it introduces itself before its first message."""

    def __init__(self, writer: LsfWriter, name: str, log: str) -> None:
        self.name = name
        self.count: int = 0
        self._writer = writer
        self._log = log
        self._id = _address(name)
        self._labels = {label: number for number, label in enumerate(ENTITIES, 1)}

    def write_preamble(self, time: float, kind: imc.SystemType, mavlink: int) -> None:
        """Write what a log begins with, unless it is there; `mavlink` is the vehicle's id there."""
        if self.count:
            return
        services = str(Service("mavlink+info", "0.0.0.0", path=f"/system/{mavlink}"))
        self._publish(ENTITIES[0], imc.LoggingControl(timestamp=time, op=imc.LoggingControl.Op.STARTED, name=self._log))
        self._publish(ENTITIES[0], imc.Announce(timestamp=time, sys_name=self.name, sys_type=kind, services=services))
        for label in ENTITIES:
            self._name(label, time)

    def write(self, messages: Iterable[tuple[str, imc.Message]]) -> None:
        """Write messages with their times, after the labels of their entities."""
        for label, message in messages:
            if label not in self._labels:
                self._name(label, message.timestamp)
            self._publish(label, message)

    def write_log_end(self, time: float) -> None:
        self._publish(ENTITIES[0], imc.LoggingControl(timestamp=time, op=imc.LoggingControl.Op.STOPPED, name=self._log))

    def _name(self, label: str, time: float) -> None:
        entity = self._labels.setdefault(label, len(self._labels) + 1)
        self._write(entity, imc.EntityInfo(timestamp=time, id=entity, label=label, component="MAVLink"))

    def _publish(self, label: str, message: imc.Message) -> None:
        self._write(self._labels[label], message)

    def _write(self, entity: int, message: imc.Message) -> None:
        packet = imc.encode_with_header(message, message.timestamp, self._id, entity, UNKNOWN_SYSTEM, UNKNOWN_ENTITY)
        self._writer.write(packet)
        self.count += 1


def open_writer(folder: Path) -> LsfWriter:
    """Data.lsf.gz of a new log, with its definitions beside it."""
    (folder / "IMC.xml.gz").write_bytes(gzip_schema(imc.builtin()))
    return LsfWriter(folder / "Data.lsf.gz")


def _address(name: str) -> int:
    systems = load_profile(own_etc() / "common" / "imc-addresses.ini", vehicle=name).systems
    return systems.get(name, derived_id(name))
