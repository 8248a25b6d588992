"""Logs as Parquet: one file per message type."""

import json
from contextlib import ExitStack
from importlib import import_module
from pathlib import Path
from typing import Any

import numpy as np

import imc
from imc.lsf import ReportProgress
from shoal.logs.export.message_batches import LogSource
from shoal.logs.export.message_table import (
    HEADER,
    HEADER_TYPES,
    NUMPY,
    Column,
    MessageTable,
    Values,
    column_definitions,
    json_columns,
    message_table,
)

ROWS = 1 << 16  # of a row group
LARGEST_WAITING = 1 << 26  # bytes

# pyarrow has no type hints.
_pa: Any = import_module("pyarrow")
_pq: Any = import_module("pyarrow.parquet")


def export_parquet(source: LogSource, folder: Path, progress: ReportProgress = lambda _: None) -> int:
    """Write <Message>.parquet for each type to `folder`; returns the number of rows.

    Columns: `utc` (µs, empty if the timestamp is not a date), `system` and `label` (of the sender), the header, the
    fields. A field with one of these names gets the prefix `field_`. The metadata of a field have its unit, long name
    and the names of its values (JSON). Inline messages are JSON text. Raises OSError.
    """
    files: dict[int, _File] = {}
    rows = 0
    with ExitStack() as stack:
        for batch in source.batches(progress):
            for group in source.groups(batch):
                table = message_table(source, batch, group)
                file = files.get(group.message.id)
                if file is None:
                    file = files[group.message.id] = _File(source, group.message, folder)
                    stack.callback(file.close)
                file.add(table)
                rows += table.rows
            if sum(file.waiting for file in files.values()) > LARGEST_WAITING:
                for file in files.values():
                    file.flush()
    return rows


class _File:
    def __init__(self, source: LogSource, message: imc.MessageType, folder: Path):
        self._names = source.names
        self._columns = column_definitions(source.schema, message)
        own = {"utc", "system", "label", *HEADER}
        self._places = [("field_" if column.name in own else "") + column.name for column in self._columns]
        head = [("utc", _pa.timestamp("us", "UTC")), ("system", _text()), ("label", _text())]
        fields = [_pa.field(name, kind) for name, kind in head]
        fields += [_field(n, Column(n, t, "s" if n == "timestamp" else "", "", {}, False)) for n, t in _HEADER_COLUMNS]
        fields += [_field(name, column) for name, column in zip(self._places, self._columns, strict=True)]
        about = {"imc": source.schema.version, "message": message.abbrev, "id": str(message.id), "name": message.name}
        self._schema = _pa.schema(fields, about)
        self._tables: list[Any] = []
        self._rows = 0
        self.waiting = 0
        self._file = _pq.ParquetWriter(str(folder / f"{message.abbrev}.parquet"), self._schema, compression="zstd")

    def add(self, table: MessageTable) -> None:
        columns = table.columns
        stamps = columns["timestamp"]
        arrays: list[Any] = [_utc(stamps), *self._speakers(columns["src"], columns["src_ent"])]
        arrays += [_array(columns[name], kind) for name, kind in _HEADER_COLUMNS]
        arrays += [_array(columns[column.name], column.type) for column in self._columns]
        made = _pa.Table.from_arrays(arrays, schema=self._schema)
        self._tables.append(made)
        self._rows += table.rows
        self.waiting += int(made.nbytes)
        if self._rows >= ROWS:
            self.flush()

    def flush(self) -> None:
        if self._rows:
            self._file.write_table(_pa.concat_tables(self._tables).unify_dictionaries())
        self._tables.clear()
        self._rows = self.waiting = 0

    def close(self) -> None:
        try:
            self.flush()
            self._file.close()
        finally:
            self._file.is_open = False  # else its destructor closes it again, and fails

    def _speakers(self, systems: Values, entities: Values) -> tuple[Any, Any]:
        keys = np.asarray(systems).astype(np.int64) << 8 | np.asarray(entities)
        found, places = np.unique(keys, return_inverse=True)
        pairs = [(key >> 8, key & 0xFF) for key in found.tolist()]
        names = (self._names.system_name(src) for src, _ in pairs), (self._names.entity_label(*pair) for pair in pairs)
        system, label = ([_clean(text) for text in texts] for texts in names)
        return _dictionary(system, places), _dictionary(label, places)


_HEADER_COLUMNS = tuple(zip(HEADER, HEADER_TYPES, strict=True))


def _text() -> Any:
    return _pa.dictionary(_pa.int32(), _pa.string())


def _field(name: str, column: Column) -> Any:
    about = {"unit": column.unit, "name": column.title, "type": column.type}
    if column.values:
        about["flags" if column.bitfield else "enum"] = json.dumps({str(k): v for k, v in column.values.items()})
    return _pa.field(name, _kind(column.type), metadata={key: text for key, text in about.items() if text})


def _kind(type_: str) -> Any:
    if type_ in NUMPY:
        return _pa.from_numpy_dtype(NUMPY[type_])
    return _pa.binary() if type_ == "rawdata" else _pa.string()


def _array(values: Values, type_: str) -> Any:
    if type_ in NUMPY:
        return _pa.array(np.ascontiguousarray(values))
    return _pa.array(json_columns(values, type_), _kind(type_))


def _dictionary(texts: list[str], places: Any) -> Any:
    return _pa.DictionaryArray.from_arrays(_pa.array(places.astype(np.int32)), _pa.array(texts, _pa.string()))


def _utc(stamps: Values) -> Any:
    times = np.asarray(stamps)
    good = (times >= 0.0) & (times < 1e11)
    whole = np.rint(np.where(good, times, 0.0) * 1e6).astype("datetime64[us]")
    return _pa.array(whole, _pa.timestamp("us", "UTC"), mask=~good)


def _clean(text: str) -> str:
    return text.encode("utf-8", "backslashreplace").decode()
