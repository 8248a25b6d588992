"""Writes messages.py, merged.json and IMC.xml.gz from the definitions: `python -m imc.generate`; `--check` compares."""

import gzip
import sys
from pathlib import Path

import msgspec

from imc.layout import WIRE_CODES
from imc.lsf import compress_member
from imc.schema import Field, MessageType, Schema, Value, dump
from imc.schema.classes import DEFAULTS
from imc.schema.files import MERGED, XML, builtin_from_yaml, digest

MESSAGES = Path(__file__).with_name("messages.py")

_HEAD = '''"""The messages of IMC {version} and of Shoal: written by `python -m imc.generate` from imc/definitions."""

from enum import IntEnum, IntFlag
from typing import ClassVar

from imc.message import Message, MessageWithLists
'''


def messages_source(schema: Schema) -> str:
    """The text of messages.py."""
    parts = [_HEAD.format(version=schema.version)]
    parts += [_enum(shared.abbrev, shared.values, False, shared.name) for shared in schema.enumerations]
    parts += [_enum(shared.abbrev, shared.values, True, shared.name) for shared in schema.bitfields]
    parts += [_message(message, schema) for message in schema.messages]
    table = [f"    {message.id}: {message.abbrev},\n" for message in sorted(schema.messages, key=lambda m: m.id)]
    parts.append("\n\nBY_ID: dict[int, type[Message]] = {\n" + "".join(table) + "}\n")
    names = [shared.abbrev for shared in (*schema.enumerations, *schema.bitfields)]
    names += [message.abbrev for message in schema.messages]
    parts.append("\n__all__ = [\n" + "".join(f'    "{name}",\n' for name in sorted(names)) + "]\n")
    return "".join(parts)


def _enum(name: str, values: tuple[Value, ...], bits: bool, title: str, indent: str = "") -> str:
    digits = max(len(f"{value.id:X}") for value in values)
    lines = [f"class {name}({'IntFlag' if bits else 'IntEnum'}):"]
    if title:
        lines += [f'    """{title}."""', ""]
    lines += [
        f"    {value.member_name} = " + (f"0x{value.id:0{digits}X}" if bits else str(value.id)) for value in values
    ]
    text = "".join(indent + line + "\n" if line else "\n" for line in lines)
    return ("\n" if indent else "\n\n") + text


def _message(message: MessageType, schema: Schema) -> str:
    lists = [field.attribute for field in message.fields if field.type == "message-list"]
    base = "MessageWithLists" if lists else "Message"
    lines = [f"class {message.abbrev}({base}, frozen=True):", f'    """{message.name.rstrip(".")}."""', ""]
    lines.append(f"    ID: ClassVar[int] = {message.id}")
    if message.fields:
        lines.append(f'    WIRE: ClassVar[str] = "{message.wire_codes}"')
    if lists:
        lines.append(f"    LISTS: ClassVar[tuple[str, ...]] = {tuple(lists)!r}".replace("'", '"'))
    text = "\n\n" + "\n".join(lines) + "\n"
    for field in message.fields:
        if field.values:
            text += _enum(field.enum_name, field.values, field.is_bitfield, "", "    ")
    if message.fields:
        text += "\n" + "".join(_field(field, schema) for field in message.fields)
    return text


def _field(field: Field, schema: Schema) -> str:
    kind, default = DEFAULTS.get(WIRE_CODES[field.type], (int, 0))
    annotation = kind.__name__ if isinstance(kind, type) and not hasattr(kind, "__args__") else str(kind)
    annotation = annotation.replace("imc.message.", "")
    notes = [field.unit] if field.unit and not field.values and not (field.enum_def or field.bitfield_def) else []
    notes.append(field.type.removesuffix("_t"))
    if field.values:
        notes.append(field.enum_name)
    notes += [name for name in (field.enum_def, field.bitfield_def, field.message_type) if name]
    low = None if field.minimum is None else f"{field.minimum:.6g}"
    high = None if field.maximum is None else f"{field.maximum:.6g}"
    if low is not None:
        notes.append(f"{low} to {high}" if high is not None else f"at least {low}")
    elif high is not None:
        notes.append(f"at most {high}")
    return f"    {field.attribute}: {annotation} = {default!r}  # {', '.join(notes)}\n".replace("''", '""')


def merged_json(schema: Schema) -> str:
    """The text of merged.json: an `imc.schema.files.MergedDefinitions`, one line per message."""
    head = msgspec.json.encode(msgspec.structs.replace(schema, messages=())).decode().removesuffix("}")
    messages = ",\n".join(msgspec.json.encode(message).decode() for message in schema.messages)
    return f'{{"xml":"{digest(dump(schema))}","schema":{head},"messages":[\n{messages}\n]}}}}\n'


def main(arguments: list[str]) -> int:
    """Writes the files, returns 0; with --check only compares them, returns 1 if one is out of date."""
    schema, stale = builtin_from_yaml(), 0
    for path, text in ((MESSAGES, messages_source(schema)), (MERGED, merged_json(schema))):
        if "--check" not in arguments:
            path.write_text(text, encoding="utf-8")
        elif not path.exists() or path.read_text(encoding="utf-8") != text:
            print(f"{path} is out of date: run `python -m imc.generate`", file=sys.stderr)
            stale = 1
    if "--check" not in arguments:
        XML.write_bytes(compress_member(dump(schema), level=9))
    elif not XML.exists() or gzip.decompress(XML.read_bytes()) != dump(schema):  # builds of zlib pack differently
        print(f"{XML} is out of date: run `python -m imc.generate`", file=sys.stderr)
        stale = 1
    return stale


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))
