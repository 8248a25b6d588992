"""Reads definitions from files: the built-in ones and others."""

import gzip
import io
import os
import zlib
from functools import cache
from os import PathLike
from pathlib import Path

import msgspec

from imc.errors import SchemaError
from imc.message import Message, Unknown
from imc.messages import BY_ID
from imc.schema.field_info import FieldInfo
from imc.schema.schema import Schema
from support.terminal_text import nearest_word, quoted

_DEFINITIONS = Path(__file__).parents[1] / "definitions"
_BASE, _OVERLAY = _DEFINITIONS / "imc-5.4.31.yaml", _DEFINITIONS / "shoal.yaml"
MERGED = _DEFINITIONS / "merged.json"
XML = _DEFINITIONS / "IMC.xml.gz"  # of the built-in schema
_LARGEST = 1 << 22  # the public IMC.xml is smaller than 1 MiB


class MergedDefinitions(msgspec.Struct):
    """The definitions of the YAML files in a form that loads fast."""

    xml: str
    """The digest of their IMC.xml, as `dump` writes it."""
    schema: Schema


def load(path: str | PathLike[str], over: Schema | None = None) -> Schema:
    """The definitions in an IMC.xml, IMC.xml.gz or YAML file of our layout; they extend `over`, if given.

    Messages of `over` keep their classes, and the same definitions over the same schema are the same object, with the
    same classes: a vehicle and its tasks may each load the file. The format is detected from the content; 4 MiB at
    most. Raises SchemaError naming file:line, OSError.
    """
    return _read(_content(path), str(path), over)


def load_unless_builtin(path: str | PathLike[str]) -> Schema:
    """Do the same as `load`, but return the built-in schema, without parsing, for a file that `dump` writes for it."""
    data = _content(path)
    return builtin() if digest(data) == _merged().xml else _read(data, str(path), None)


def digest(data: bytes) -> str:
    """Identifies the content of an IMC.xml."""
    import hashlib

    return hashlib.blake2b(data, digest_size=16).hexdigest()


def _content(path: str | PathLike[str]) -> bytes:
    if os.path.exists(path) and not os.path.isfile(path):  # a pipe would be waited for
        raise SchemaError("not a regular file", path)
    with open(path, "rb") as opened:
        data = opened.read(_LARGEST + 1)
    return _unpacked(data, str(path))


def _read(data: bytes, file: str, over: Schema | None) -> Schema:
    # The readers are imported here: few programs read definitions, and PyYAML is slow to import.
    if data.lstrip(b"\xef\xbb\xbf\t\r\n ").startswith(b"<") or data.startswith((b"\xff\xfe", b"\xfe\xff")):
        from imc.schema.xml_reader import read_xml

        schema, places = read_xml(data, file)
    else:
        from imc.schema.yaml_reader import read_yaml

        try:
            text = data.decode("utf-8")
        except UnicodeDecodeError as error:
            raise SchemaError(f"neither XML nor UTF-8 text: {error}", file) from error
        schema, places = read_yaml(text, file)
    if over is None:
        schema.check(places)
        return schema
    extended = over.overlay(schema, places)
    extended.check(places)
    return _extending(extended, over)


@cache
def _extending(schema: Schema, over: Schema) -> Schema:
    schema.share_classes(over)
    return schema


def _unpacked(data: bytes, file: str) -> bytes:
    if data.startswith(b"\x1f\x8b"):
        try:
            data = gzip.GzipFile(fileobj=io.BytesIO(data)).read(_LARGEST + 1)
        except (OSError, EOFError, zlib.error) as error:
            raise SchemaError(f"compressed data is damaged: {error}", file) from error
    if len(data) > _LARGEST:
        raise SchemaError(f"definitions of more than {_LARGEST} bytes", file)
    return data


@cache
def builtin() -> Schema:
    """The schema of the classes in `imc.messages`: IMC and Shoal's additions."""
    schema = _merged().schema
    schema.use_classes(BY_ID)
    return schema


def builtin_xml_gz() -> bytes:
    """The built-in schema as IMC.xml.gz, as it lies beside the definitions."""
    return XML.read_bytes()


def message_named(name: str) -> type[Message]:
    """The message type `name`. Raises ValueError, with the closest name, if there is none."""
    schema = builtin()
    if name in schema:
        return schema[name]
    near = nearest_word(name, (cls.__name__ for cls in BY_ID.values()))
    raise ValueError(f"there is no message {quoted(name)}" + (f"; did you mean {near}?" if near else ""))


def builtin_from_yaml() -> Schema:
    """The built-in schema, read from its YAML files."""
    return load(_OVERLAY, over=load(_BASE))


@cache
def _merged() -> MergedDefinitions:
    return msgspec.json.decode(MERGED.read_bytes(), type=MergedDefinitions)


def fields(cls: type[Message]) -> tuple[FieldInfo, ...]:
    """The fields of a message class, in wire order, without those of the header."""
    return () if cls in (Message, Unknown) else (cls.SCHEMA or builtin()).fields(cls)
