"""Messages of one type as a table: its columns, and their values batch by batch."""

from typing import Any, NamedTuple

import numpy as np

import imc
from imc import layout
from imc.layout import ADDRESS_FIELDS, TYPES_BY_CODE
from runtime.logs import Array
from shoal.logs.export.cdr import json_text
from shoal.logs.export.message_batches import ExportBatch, LogSource, MessageBatch

HEADER = tuple(ADDRESS_FIELDS)
HEADER_TYPES = tuple(TYPES_BY_CODE[code] for code in ADDRESS_FIELDS.values())

NUMPY = {TYPES_BY_CODE[code]: np.dtype(kind) for code, kind in layout.NUMPY.items()}
"""Types of numbers."""

Values = Array | list[Any]


class Column(NamedTuple):
    """A field of a message: its name, IMC type, unit ("" if none), long name, and the names of its values."""

    name: str
    type: str
    unit: str
    title: str
    values: dict[int, str]
    bitfield: bool


class MessageTable(NamedTuple):
    """Messages of one type: columns by name, those of HEADER first; all have the same length.

    Numbers are arrays; text is str, raw data is bytes, an inline message is a message or None, a list of messages is a
    tuple.
    """

    message: imc.MessageType
    columns: dict[str, Values]
    rows: int


def column_definitions(schema: imc.Schema, message: imc.MessageType) -> list[Column]:
    """The fields of a message as columns."""
    found: list[Column] = []
    for field in message.fields:
        values = {value.id: value.abbrev for value in schema.values_of(field)}
        unit = "" if field.unit in ("Enumerated", "Bitfield", "TupleList", "List") else field.unit
        found.append(Column(field.attribute, field.type, unit, field.name, values, field.is_bitfield))
    return found


def message_table(source: LogSource, batch: ExportBatch, group: MessageBatch) -> MessageTable:
    """The messages of a group; what cannot be decoded counts as skipped."""
    names = [field.attribute for field in group.message.fields]
    if group.array is not None:
        columns: dict[str, Values] = {name: group.array[name] for name in (*HEADER, *names)}
        return MessageTable(group.message, columns, len(group.array))
    decoded = list(source.decode(batch, group.rows))
    heads = batch.headers[group.rows[[place for place, _ in decoded]]]
    columns = {name: heads[name] for name in HEADER}
    for field in group.message.fields:
        values = [getattr(message, field.attribute) for _, message in decoded]
        columns[field.attribute] = np.array(values, NUMPY[field.type]) if field.type in NUMPY else values
    return MessageTable(group.message, columns, len(decoded))


def json_columns(values: Values, type_: str) -> Values:
    """Values of a column with JSON text for messages; text that is not UTF-8 has its bytes as \\udcxx."""
    if type_ == "plaintext":
        return [text.encode("utf-8", "backslashreplace").decode() for text in values]
    if type_ in ("message", "message-list"):
        return [json_text(value) for value in values]
    return values
