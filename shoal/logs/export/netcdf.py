"""Logs as NetCDF-4 with the CF conventions: one file, one group per message type."""

import errno
import re
from importlib import import_module
from pathlib import Path
from typing import Any

import numpy as np

import imc
from imc.lsf import ReportProgress
from runtime.logs import Array
from shoal.logs.export.message_batches import LogSource
from shoal.logs.export.message_table import (
    HEADER,
    HEADER_TYPES,
    NUMPY,
    Column,
    MessageTable,
    column_definitions,
    json_columns,
    message_table,
)

ROWS = 1 << 13  # of a chunk
RAW = 1 << 16  # bytes of a chunk of raw data
LARGEST_WAITING = 1 << 26  # bytes
LATEST = 9.2e9  # s since 1970: readers hold ns in 64 bits
OBSERVATION, ENTITY = "obs", "entity"
OWN = ("time", *HEADER, "speaker")
TIME = {
    "long_name": "time of the message",
    "standard_name": "time",
    "units": "seconds since 1970-01-01T00:00:00Z",
    "calendar": "standard",
    "units_metadata": "leap_seconds: none",
}
TITLES = {
    "timestamp": "seconds since 1970 UTC, as in the header",
    "src": "IMC id of the sender's system",
    "src_ent": "id of the sender's entity",
    "dst": "IMC id of the system addressed",
    "dst_ent": "id of the entity addressed",
}

UNITS = {
    "°": "degree",
    "°C": "degree_Celsius",
    "%": "percent",
    "µs": "us",
    "µg/L": "ug/L",
    "µM": "umol/L",
    "m/s/s": "m/s2",
    "kg/m/m/m": "kg/m3",
    "g": "9.80665 m/s2",
    "G": "gauss",
    "Nm": "N m",
    "mAh": "mA h",
    "kn": "knot",
    "PPB": "1e-9",
    "PSU": "1e-3",
    "KiB": "1024 byte",
    "MiB": "1048576 byte",
    "bps": "bit/s",
    "px": "1",
    "NTU": "1",
    "dB": "1",
}
"""IMC units that UDUNITS, and so CF, writes differently or lacks."""

KINDS: dict[str, type[np.generic]] = {
    "int8_t": np.int8,
    "uint8_t": np.uint8,
    "int16_t": np.int32,
    "uint16_t": np.int32,
    "int32_t": np.int32,
    "uint32_t": np.int64,
    "int64_t": np.int64,
    "fp32_t": np.float32,
    "fp64_t": np.float64,
}
"""Types of stored numbers: wider if readers would take a valid value, such as 65535, as missing."""

# netCDF4 has no type hints.
_nc: Any = import_module("netCDF4")


def export_netcdf(source: LogSource, path: Path, progress: ReportProgress = lambda _: None) -> int:
    """Write the messages to a NetCDF file; returns the number of rows.

    The dimension of a group is `obs`: messages in the order of the log. Its variables are `time` (CF), the header,
    `speaker` (index of the sender along `entity`, a dimension of the file) and the fields; a field with one of
    these names gets the prefix `field_`. Text is text, inline messages are JSON text, raw data is a contiguous ragged
    array: the bytes of all messages, and the size of each. Raises OSError.
    """
    types: dict[int, _Type] = {}
    speakers: dict[int, int] = {}
    rows = 0
    try:
        with _nc.Dataset(str(path), "w", format="NETCDF4") as file:
            owner = source.names.system_name(source.summary.owner)
            file.setncatts({"Conventions": "CF-1.11", "title": f"IMC log of {owner}", "history": "shoal log export"})
            for batch in source.batches(progress):
                for group in source.groups(batch):
                    table = message_table(source, batch, group)
                    number = group.message.id
                    if number not in types:
                        types[number] = _Type(file, source, group.message, speakers)
                    types[number].add(table)
                    rows += table.rows
                if sum(written.waiting for written in types.values()) > LARGEST_WAITING:
                    for written in types.values():
                        written.flush()
            for written in types.values():
                written.flush()
            _name_speakers(file, source, speakers)
    except (RuntimeError, PermissionError) as error:
        # The library gives no reason, or "permission denied" for a full disk; writing here ourselves makes the
        # system report the cause.
        with path.open("ab") as probe:
            probe.write(bytes(RAW))
        raise OSError(errno.EIO, str(error), str(path)) from error
    return rows


def _name_speakers(file: Any, source: LogSource, speakers: dict[int, int]) -> None:
    file.createDimension(ENTITY, len(speakers))
    pairs = [(key >> 8, key & 0xFF) for key in speakers]
    names = source.names
    columns = (
        ("src", "i4", [src for src, _ in pairs], "IMC id of the system"),
        ("src_ent", "u1", [entity for _, entity in pairs], "id of the entity"),
        ("system", str, json_columns([names.system_name(src) for src, _ in pairs], "plaintext"), "name of the system"),
        ("label", str, json_columns([names.entity_label(*pair) for pair in pairs], "plaintext"), "label of the entity"),
    )
    for name, kind, values, title in columns:
        variable = file.createVariable(name, kind, (ENTITY,), fill_value=False)
        variable.long_name = title
        variable[:] = np.array(values, object if kind is str else kind)


class _Type:
    """The messages of one type: rows that wait to fill a chunk, and their variables."""

    def __init__(self, file: Any, source: LogSource, message: imc.MessageType, speakers: dict[int, int]):
        self._group = file.createGroup(message.abbrev)
        self._group.setncatts({"title": message.name, "imc_id": message.id, "imc_version": source.schema.version})
        self._group.createDimension(OBSERVATION, None)
        self._rows = min(ROWS, max(1, source.summary.by_type[message.abbrev].count))
        self._speakers = speakers
        self._columns = column_definitions(source.schema, message)
        self._written = self._count = self.waiting = 0
        self._tables: list[MessageTable] = []

        self._head = [self._number("time", "fp64_t", TIME)]
        self._head += [
            self._number(name, kind, {"long_name": title} | ({"units": "s"} if name == "timestamp" else {}))
            for (name, title), kind in zip(TITLES.items(), HEADER_TYPES, strict=True)
        ]
        about = {"long_name": "index of the sender along entity", "instance_dimension": ENTITY}
        self._head.append(self._number("speaker", "int32_t", about))
        self._raw: dict[str, Any] = {}
        self._fields = {column.name: self._field(column) for column in self._columns}

    def add(self, table: MessageTable) -> None:
        self._tables.append(table)
        self._count += table.rows
        for column in self._columns:
            values = table.columns[column.name]
            self.waiting += values.nbytes if isinstance(values, np.ndarray) else _size(values)
        if self._count >= ROWS:
            self.flush()

    def flush(self) -> None:
        """Write all waiting rows."""
        if not self._count:
            return
        place = slice(self._written, self._written + self._count)
        stamps, src, src_ent, *dst = (self._joined(name) for name in HEADER)
        dated = np.where((stamps >= 0.0) & (stamps < LATEST), stamps, np.nan)
        for variable, values in zip(
            self._head, (dated, stamps, src, src_ent, *dst, self._places(src, src_ent)), strict=True
        ):
            variable[place] = values
        for column in self._columns:
            if column.type in NUMPY:
                self._fields[column.name][place] = self._joined(column.name)
            else:
                values = [value for table in self._tables for value in table.columns[column.name]]
                self._write_list(column, values, place)
        self._written += self._count
        self._tables.clear()
        self._count = self.waiting = 0

    def _write_list(self, column: Column, values: list[Any], place: slice) -> None:
        if column.type != "rawdata":
            texts = [text.replace("\0", "\\x00") for text in json_columns(values, column.type)]
            self._fields[column.name][place] = np.array(texts, object)
            return
        self._fields[column.name][place] = np.array([len(data) for data in values], np.int64)
        content, size = self._raw[column.name], self._raw[column.name].size
        joined = np.frombuffer(b"".join(values), np.uint8)
        content[size : size + joined.size] = joined

    def _joined(self, name: str) -> Array:
        return np.concatenate([np.asarray(table.columns[name]) for table in self._tables])

    def _places(self, src: Array, src_ent: Array) -> Array:
        keys, inverse = np.unique(src.astype(np.int64) << 8 | src_ent, return_inverse=True)
        return np.array([self._speakers.setdefault(key, len(self._speakers)) for key in keys.tolist()])[inverse]

    def _field(self, column: Column) -> Any:
        about = _about(column)
        if column.type in NUMPY:
            return self._number(self._free(column.name), column.type, about)
        if column.type != "rawdata":
            return self._variable(self._free(column.name), str, about)
        name = self._free(column.name)
        dimension = self._free(f"{name}_bytes")
        self._group.createDimension(dimension, None)
        made = {"chunksizes": (RAW,), "chunk_cache": RAW, "compression": "zlib", "complevel": 1, "fill_value": False}
        self._raw[column.name] = self._group.createVariable(name, "u1", (dimension,), **made)
        self._raw[column.name].setncatts(about)
        size = {"long_name": f"bytes of {name}", "sample_dimension": dimension}
        return self._number(self._free(f"{name}_size"), "uint32_t", size)

    def _free(self, name: str) -> str:
        while name in OWN or name in self._group.variables or name in self._group.dimensions:
            name = f"field_{name}"
        return name

    def _number(self, name: str, type_: str, about: dict[str, Any]) -> Any:
        kind = np.dtype(KINDS[type_])
        missing = np.nan if kind.kind == "f" else False
        return self._variable(name, kind, about, fill_value=missing, compression="zlib", complevel=1)

    def _variable(self, name: str, kind: Any, about: dict[str, Any], **how: Any) -> Any:
        # By default the library caches 16 MiB per variable; one chunk is enough, as chunks are filled in order.
        chunks = {"chunksizes": (self._rows,), "chunk_cache": self._rows * 16}
        variable = self._group.createVariable(name, kind, (OBSERVATION,), **chunks, **how)
        if name != "time":
            variable.coordinates = "time"
        variable.setncatts(about)
        return variable


def _about(column: Column) -> dict[str, Any]:
    """The attributes of a field: its long name, its unit in CF and in IMC, the names of its values."""
    about: dict[str, Any] = {"long_name": column.title}
    if column.unit:
        about["units"] = UNITS.get(column.unit, column.unit)
        if about["units"] != column.unit:
            about["imc_unit"] = column.unit
    if column.type in ("message", "message-list"):
        about["comment"] = "JSON"
    if column.values and column.type in NUMPY and not column.type.startswith("fp"):
        limits = np.iinfo(np.dtype(KINDS[column.type]).str)
        least = 1 if column.bitfield else limits.min
        named = {number: name for number, name in column.values.items() if least <= number <= limits.max}
        if named:
            about["flag_masks" if column.bitfield else "flag_values"] = np.array(list(named), KINDS[column.type])
            about["flag_meanings"] = " ".join(re.sub(r"[^A-Za-z0-9_.+@-]", "_", name) or "_" for name in named.values())
    return about


def _size(values: list[Any]) -> int:
    return sum(len(value) if isinstance(value, str | bytes) else 256 for value in values)
