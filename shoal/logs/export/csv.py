"""Logs as comma-separated values (RFC 4180, UTF-8): one file per message type."""

import csv
from datetime import UTC, datetime
from pathlib import Path
from typing import TextIO

import numpy as np

import imc
from imc.lsf import ReportProgress
from shoal.logs.export.message_batches import LogSource
from shoal.logs.export.message_table import (
    HEADER,
    NUMPY,
    MessageTable,
    Values,
    column_definitions,
    json_columns,
)
from shoal.logs.export.text_files import write_text_files


def export_csv(source: LogSource, folder: Path, progress: ReportProgress = lambda _: None) -> int:
    """Write <Message>.csv for each type to `folder`; returns the number of rows.

    The first row has the names of the columns with their units: `timestamp (s)`, `utc`, `system`, `label`, the rest of
    the header, the fields. Numbers are as short as possible without loss, enumerations are numbers, raw data is
    hexadecimal, inline messages are JSON. Raises OSError.
    """

    def begin(file: TextIO, message: imc.MessageType) -> None:
        csv.writer(file).writerow(_heading(source.schema, message))

    def add(file: TextIO, table: MessageTable) -> None:
        csv.writer(file).writerows(zip(*_columns(source, table), strict=True))

    return write_text_files(source, lambda message: folder / f"{message.abbrev}.csv", "", begin, add, progress)


def column_texts(values: Values, type_: str) -> list[str]:
    """Values of a column as text."""
    if type_ == "rawdata":
        return [data.hex() for data in values]
    if type_ not in NUMPY:
        return list(json_columns(values, type_))
    numbers = np.asarray(values)
    return numbers.astype("U32").tolist() if type_ == "fp32_t" else list(map(repr, numbers.tolist()))


def _heading(schema: imc.Schema, message: imc.MessageType) -> list[str]:
    columns = column_definitions(schema, message)
    fields = [f"{column.name} ({column.unit})" if column.unit else column.name for column in columns]
    return ["timestamp (s)", "utc", "system", "label", *HEADER[1:], *fields]


def _columns(source: LogSource, table: MessageTable) -> list[list[str]]:
    columns = table.columns
    times: list[float] = np.asarray(columns["timestamp"]).tolist()
    pairs: list[tuple[int, int]] = list(
        zip(np.asarray(columns["src"]).tolist(), np.asarray(columns["src_ent"]).tolist(), strict=True)
    )
    known = {pair: (source.names.system_name(pair[0]), source.names.entity_label(*pair)) for pair in set(pairs)}
    found = [list(map(repr, times)), [_utc(time) for time in times]]
    found += [list(json_columns([known[pair][place] for pair in pairs], "plaintext")) for place in (0, 1)]
    found += [column_texts(columns[name], "uint16_t") for name in HEADER[1:]]
    return found + [column_texts(columns[field.attribute], field.type) for field in table.message.fields]


def _utc(time: float) -> str:
    if not 0.0 <= time < 1e11:
        return ""
    return datetime.fromtimestamp(time, UTC).isoformat(timespec="microseconds").replace("+00:00", "Z")
