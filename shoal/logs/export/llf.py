"""Logs as LLF, the text format of LSTS' Java tools and Neptus: one file per message type, tabs between columns.

Source of the format: the output of imcjava's LSF2LLF. Two of its faults are fixed: tabs and line ends in text become
spaces, since they would break rows, and inline messages do not get rows of their own.
"""

import re
from datetime import UTC, datetime
from pathlib import Path
from typing import TextIO

import numpy as np

import imc
from imc.lsf import ReportProgress
from shoal.logs.export.message_batches import LogSource
from shoal.logs.export.message_table import HEADER, HEADER_TYPES, NUMPY, MessageTable, Values
from shoal.logs.export.text_files import write_text_files

_BREAKS = re.compile(r"[\t\r\n]")


def export_llf(source: LogSource, folder: Path, progress: ReportProgress = lambda _: None) -> int:
    """Write <Message>.llf for each type to `folder`; returns the number of rows.

    Times are in s since `#startTime`, the start of the log. Raises OSError.
    """
    start = source.summary.start if source.summary.start == source.summary.start else 0.0

    def begin(file: TextIO, message: imc.MessageType) -> None:
        file.write(_heading(source.schema, message, start))

    def add(file: TextIO, table: MessageTable) -> None:
        file.writelines("\t".join(row) + "\n" for row in zip(*_columns(table, start), strict=True))

    return write_text_files(source, lambda message: folder / f"{message.abbrev}.llf", "\r\n", begin, add, progress)


def _heading(schema: imc.Schema, message: imc.MessageType, start: float) -> str:
    date = datetime.fromtimestamp(start, UTC) if 0.0 <= start < 1e11 else datetime.fromtimestamp(0, UTC)
    types = [*HEADER_TYPES, *(field.type for field in message.fields)]
    names = [*HEADER, *(field.abbrev for field in message.fields)]
    return (
        f"#LLF1\n#generator: Shoal\n#standard: IMC\n#version: {schema.version}\n#name: {message.abbrev}\n"
        f"#date: {date:%a %b %d %H:%M:%S} UTC {date.year}\n#startTime: {java_number(start)}\n"
        f"#types: {_TAB.join(types)}\n{_TAB.join(names)}\n"
    )


_TAB = "\t"


def _columns(table: MessageTable, start: float) -> list[list[str]]:
    times = np.asarray(table.columns["timestamp"]) - start
    found = [_texts(times, "fp64_t"), *(_texts(table.columns[name], "uint16_t") for name in HEADER[1:])]
    return found + [_texts(table.columns[field.attribute], field.type) for field in table.message.fields]


def _texts(values: Values, type_: str) -> list[str]:
    if type_ == "rawdata":
        return [data.hex().upper() for data in values]
    if type_ == "plaintext":
        return [_BREAKS.sub(" ", text).encode("utf-8", "replace").decode() for text in values]
    if type_ == "message":
        return ["null" if value is None else f"%INLINE{{{type(value).__name__}}}" for value in values]
    if type_ == "message-list":
        names = [", ".join("null" if item is None else type(item).__name__ for item in value) for value in values]
        return [f"%MESSAGE-LIST[{text}]" for text in names]
    array = np.asarray(values)
    if type_ == "fp32_t":
        return [java_number(text) for text in array.astype("U32").tolist()]
    return [java_number(number) for number in array.tolist()] if NUMPY[type_] is np.float64 else list(map(str, array))


def java_number(value: float | str) -> str:
    """A number, or the shortest text of one, as Java's toString writes it: 1.0, 1.0E-4, NaN, -Infinity."""
    text = value if isinstance(value, str) else repr(value)
    number = float(text)
    if number != number:
        return "NaN"
    if number in (float("inf"), float("-inf")):
        return "Infinity" if number > 0 else "-Infinity"
    sign = "-" if text.startswith("-") else ""
    mantissa, _, power = text.lstrip("-").partition("e")
    whole, _, part = mantissa.partition(".")
    digits = (whole + part).lstrip("0")
    if not digits:
        return sign + "0.0"
    # The number is 0.digits times ten to the `scale`.
    scale = len(whole.lstrip("0")) if whole.lstrip("0") else -(len(part) - len(part.lstrip("0")))
    scale += int(power or 0)
    digits = digits.rstrip("0")
    if 1e-3 <= abs(number) < 1e7:
        padded = digits.ljust(max(scale, 0), "0") if scale > 0 else "0" * -scale + digits
        return sign + (f"{padded[:scale]}.{padded[scale:] or '0'}" if scale > 0 else f"0.{padded}")
    return f"{sign}{digits[0]}.{digits[1:] or '0'}E{scale - 1}"
