"""Finds the log in a folder, and its schema."""

import errno
from collections.abc import Collection
from pathlib import Path

from imc.lsf.gzip_members import COMPRESSIONS
from imc.schema import MessageType, Schema, builtin, load_unless_builtin

SUFFIXES = (".lsf", *(".lsf" + form.suffix for form in COMPRESSIONS.values()))
NAMES = ("Data.lsf", "Data.lsf.gz", "Data.lsf.bz2", "Data.lsf.z")
SCHEMA_NAMES = ("IMC.xml", "IMC.xml.gz")


def find_log(path: Path) -> Path:
    """The log file at a path: the file itself, or the one in the folder. Raises FileNotFoundError."""
    if path.is_file():
        return path
    if not path.is_dir():
        raise FileNotFoundError(errno.ENOENT, "not a regular file" if path.exists() else "no such log", str(path))
    found = log_file_names({file.name for file in path.iterdir() if file.name.endswith(SUFFIXES) and file.is_file()})
    if len(found) != 1:
        raise FileNotFoundError(errno.ENOENT, f"no log in the folder (one of {', '.join(NAMES)})", str(path))
    return path / found[0]


def log_file_names(names: Collection[str]) -> list[str]:
    """The logs among the names of files in a folder, sorted; of several Data.lsf files the one that `Log` opens."""
    preferred = next((name for name in NAMES if name in names), None)
    return [preferred] if preferred else sorted(name for name in names if name.endswith(SUFFIXES))


def find_schema(log: Path) -> tuple[Schema, Path | None]:
    """The schema beside a log, and its file; else the built-in one and None. Raises SchemaError."""
    source = next((path for path in (log.parent / name for name in SCHEMA_NAMES) if path.is_file()), None)
    return (_familiar(load_unless_builtin(source)), source) if source else (builtin(), None)


def _familiar(schema: Schema) -> Schema:
    """The schema, with the built-in classes for messages that are the same there."""
    ours = builtin()
    if schema == ours:
        return ours
    if schema.sync == ours.sync:
        same = (n for n, t in ours.types_by_id.items() if _shape(ours, t) == _shape(schema, schema.types_by_id.get(n)))
        schema.use_classes({number: ours.by_id(number) for number in same})
    return schema


def _shape(schema: Schema, message: MessageType | None) -> object:
    """All that the class of a message depends on: name, types, names of fields and of their values."""
    if message is None:
        return None
    values = [[(value.abbrev, value.id) for value in schema.values_of(field)] for field in message.fields]
    return message.abbrev, message.wire_codes, [field.attribute for field in message.fields], values
