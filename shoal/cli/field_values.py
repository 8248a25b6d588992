"""Values of message fields as people read and write them: names of enumerated values, positions in degrees."""

import math
import re
from collections.abc import Mapping
from typing import Any, cast

import click

import imc
from shoal.network import field_value
from support.foreign_json import load_json
from support.positions import format_coordinate
from support.terminal_text import printable

TEXTS = 1000  # longest text shown
DEGREES = ("deg", "°")
_COORDINATE = re.compile(r"(?:\w+_)?(lat|lon)(?:itude|gitude)?")
_LIMITS = {"lat": math.pi / 2, "lon": math.pi}
_WORDS = {"lat": "latitude", "lon": "longitude"}
_SPECIAL = ("nan", "inf", "-inf")


def coordinate_kind(field: imc.FieldInfo) -> str:
    """`lat` or `lon` for a latitude or longitude in rad; else empty. IMC gives that of Reference no unit."""
    match = _COORDINATE.fullmatch(field.name)
    is_angle = field.unit == "rad" or (not field.unit and field.type == "fp64_t")
    return match.group(1) if match is not None and is_angle else ""


def format_value(message: imc.Message, name: str, value: Any) -> str:
    """A value as people read it: names of enumerated values, short numbers, latitude and longitude in degrees."""
    if isinstance(value, imc.Message):
        return f"{type(value).__name__}({format_fields(value)})"
    if isinstance(value, tuple):
        items = cast(tuple[Any, ...], value)
        return f"[{', '.join(format_value(message, '', item) for item in items)}]"
    if isinstance(value, bytes):
        return f"{len(value)} bytes"
    info = next((field for field in imc.fields(type(message)) if field.name == name), None)
    if isinstance(value, float):
        if info is not None and coordinate_kind(info):
            return format_coordinate(value)
        if info is not None and info.unit == "°" and math.isfinite(value):
            return f"{value:.7f}°" if info.type == "fp64_t" else f"{value:.7g}°"
        return f"{value:.7g}"
    if isinstance(value, int) and info is not None and info.enum is not None:
        return str(getattr(info.enum(value), "name", None) or value) if value in set(info.enum) else str(value)
    return repr(printable(str(value))[:TEXTS]) if isinstance(value, str) else str(value)


def format_fields(message: imc.Message, names: tuple[str, ...] = ()) -> str:
    """The fields of a message, or some of them, on one line."""
    wanted = names or tuple(field.name for field in imc.fields(type(message)))
    shown: list[str] = []
    for path in wanted:
        parent, _, name = path.rpartition(".")
        try:
            owner = field_value(message, parent) if parent else message
            shown.append(f"{path}={format_value(owner, name, field_value(message, path))}")
        except AttributeError:
            continue
    return " ".join(shown)


def parse_value(field: imc.FieldInfo, text: str, schema: imc.Schema) -> Any:
    """The value in the JSON of the message. Raises UsageError."""
    kind = field.type
    members: Mapping[str, int] = field.enum.__members__ if field.enum is not None else {}
    what = f"one of {', '.join(members)}, and no whole number" if members else "a whole number"
    try:
        if kind == "plaintext":
            return text
        if kind == "rawdata":
            what = "bytes in hexadecimal digits, such as 00ff"
            return bytes.fromhex(text).hex()
        if kind.startswith("message"):
            what = 'JSON, such as {"abbrev": "IdleManeuver", "duration": 10}' + (" in [ ]" if kind != "message" else "")
            return _with_units(load_json(text), schema)
        if kind.startswith("fp"):
            is_angle = field.unit == "rad" or coordinate_kind(field)
            what = "an angle, such as 0.26 or 15deg" if is_angle else "a number"
            return _real(field, text)
        known = {name.lower(): int(value) for name, value in members.items()}
        total = 0
        for word in text.lower().split("|"):
            total |= known[word.strip()] if word.strip() in known else _whole(word)
        return total
    except ValueError:
        raise click.UsageError(f"{field.name}: {text[:80]!r} is not {what}") from None


def _with_units(value: Any, schema: imc.Schema) -> Any:
    """JSON of messages in which numbers may be texts with a unit, such as "41.18°"."""
    if isinstance(value, list):
        return [_with_units(item, schema) for item in cast(list[Any], value)]
    if not isinstance(value, dict):
        return value
    tree = cast(dict[str, Any], value)
    abbrev = tree.get("abbrev")
    infos = {f.name: f for f in imc.fields(schema[abbrev])} if isinstance(abbrev, str) and abbrev in schema else {}
    found: dict[str, Any] = {}
    for name, item in tree.items():
        info = infos.get(name)
        if info is not None and info.type.startswith("fp") and isinstance(item, str) and item.lower() not in _SPECIAL:
            found[name] = parse_value(info, item, schema)
        else:
            found[name] = _with_units(item, schema)
    return found


def _real(field: imc.FieldInfo, text: str) -> float | str:
    """A number, or what stands for it in JSON; angles in rad may be in degrees. Raises UsageError, ValueError."""
    kind, plain = coordinate_kind(field), text.strip()
    if field.unit in ("rad", "°") or kind:
        for suffix in DEGREES:
            plain = plain.removesuffix(suffix)
    has_unit = plain != text.strip()
    value = float(plain)
    if has_unit and field.unit != "°":
        value = math.radians(value)
    if math.isinf(value) and "inf" not in text.lower():
        raise ValueError("too large")
    if kind and math.isfinite(value) and abs(value) > _LIMITS[kind]:
        unit, hint = ("°", "") if has_unit else (" rad", f"; write {plain}° for degrees")
        raise click.UsageError(f"{field.name}: {plain}{unit} is no {_WORDS[kind]}{hint}")
    return value if math.isfinite(value) else str(value)


def _whole(text: str) -> int:
    """A whole number; 0x10 is 16, and 010 is 10."""
    try:
        return int(text)
    except ValueError:
        return int(text, 0)
