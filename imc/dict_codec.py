"""Messages as dictionaries of plain values, and as JSON."""

import json
import math
from collections.abc import Callable, Mapping
from typing import Any, NoReturn, cast

from imc.encodability import own_fields, range_violation
from imc.errors import DecodeError
from imc.layout import ADDRESS_FIELDS
from imc.message import Message, Unknown
from imc.schema import Schema, builtin, fields
from support.foreign_json import unique_names

_UNKNOWN_WIRE = {"id": "H", "payload": "R", "byteorder": "T"}
_NOT_FINITE = {"nan": math.nan, "inf": math.inf, "-inf": -math.inf}


def to_dict(message: Message) -> dict[str, Any]:
    """See `Message.to_dict`."""
    return _plain(message, _keep, header=True)


def to_json(message: Message) -> str:
    """See `Message.to_json`."""
    return json.dumps(_plain(message, _json_value, header=True), ensure_ascii=False, allow_nan=False)


def from_dict(data: Mapping[str, Any], schema: Schema | None = None) -> Message:
    """The message from which `to_dict` made a dictionary.

    Fields may be missing; an enumerated one may be the name of its value. Raises DecodeError with the path of a value
    that is unknown, of the wrong type or too large for the wire.
    """
    return _outer_message(data, schema, _keep)


def from_json(text: str | bytes, schema: Schema | None = None) -> Message:
    """The message from which `to_json` made a text. Raises DecodeError like `from_dict`."""
    try:
        data = json.loads(text, parse_constant=_refuse_constant, object_pairs_hook=unique_names)
    except (ValueError, RecursionError) as error:
        raise DecodeError(f"not JSON: {error}") from error
    return _outer_message(data, schema, _json_read)


def _plain(message: Message, convert: Callable[[Any, str], Any], header: bool) -> dict[str, Any]:
    plain: dict[str, Any] = {"abbrev": type(message).__name__}
    wire = _wire_of(type(message), message)
    for name, code in ({**ADDRESS_FIELDS, **wire} if header else wire).items():
        value: Any = getattr(message, name)
        if code == "M":
            value = None if value is None else _plain(value, convert, header=False)
        elif code == "L":
            value = [None if item is None else _plain(item, convert, header=False) for item in value]
        else:
            value = convert(value, code)
        plain[name] = value
    if message.surplus:
        plain["surplus"] = convert(message.surplus, "R")
    return plain


def _wire_of(cls: type[Message], message: Message) -> dict[str, str]:
    return _UNKNOWN_WIRE if cls is Unknown else own_fields(message)


def _keep(value: Any, _: str) -> Any:
    return value


def _json_value(value: Any, code: str) -> Any:
    if code == "R":
        return bytes(value).hex()
    if code in "fd" and not math.isfinite(value):
        return "nan" if math.isnan(value) else "inf" if value > 0 else "-inf"
    if code == "T":
        try:
            value.encode("utf-8")
        except UnicodeEncodeError:
            return {"bytes": value.encode("utf-8", "surrogateescape").hex()}
    return value


def _outer_message(data: Any, schema: Schema | None, read: Callable[[Any, str], Any]) -> Message:
    try:
        return _message(data, "", schema or builtin(), read, header=True)
    except RecursionError as error:
        raise DecodeError("messages nested too deeply") from error


def _message(data: Any, path: str, schema: Schema, read: Callable[[Any, str], Any], header: bool) -> Message:
    label = path or "the message"
    if not isinstance(data, Mapping):
        raise DecodeError(f"{label}: expected an object, not {type(data).__name__}")
    given = cast(Mapping[str, Any], data)
    if "abbrev" not in given:
        raise DecodeError(f'{label}: there is no "abbrev", the name of the message')
    abbrev = given["abbrev"]
    if header and abbrev == "Unknown":
        cls: type[Message] = Unknown
    elif isinstance(abbrev, str) and abbrev in schema:
        cls = schema[abbrev]
    else:
        raise DecodeError(f"{label}: unknown message {abbrev!r}")
    wire = _wire_of(cls, cls())
    known = {**ADDRESS_FIELDS, **wire, "surplus": "R"} if header else wire
    values: dict[str, Any] = {}
    for name, value in given.items():
        if name == "abbrev":
            continue
        where = f"{path}.{name}" if path else str(name)
        if name not in known:
            raise DecodeError(f"{where}: {abbrev} has no such field")
        values[name] = _value(cls, value, name, known[name], where, schema, read)
    if values.get("byteorder", "little") not in ("little", "big") and cls is Unknown:
        raise DecodeError("byteorder: expected 'little' or 'big'")
    return cls(**values)


def _value(
    cls: type[Message], value: Any, name: str, code: str, where: str, schema: Schema, read: Callable[[Any, str], Any]
) -> Any:
    if code == "M":
        return None if value is None else _message(value, where, schema, read, header=False)
    if code == "L":
        if not isinstance(value, list | tuple):
            raise DecodeError(f"{where}: expected a list, not {type(value).__name__}")
        items = cast(list[Any], value)
        return tuple(
            None if item is None else _message(item, f"{where}[{index}]", schema, read, header=False)
            for index, item in enumerate(items)
        )
    if isinstance(value, str) and code not in "TRfd":
        value = _named_value(cls, name, value)
    value = read(value, code)
    expected = range_violation(None if isinstance(value, bool) else value, code)
    if expected:
        raise DecodeError(f"{where}: {value!r:.80} is not {expected}")
    return float(value) if code in "fd" else value


def _named_value(cls: type[Message], name: str, text: str) -> Any:
    for info in fields(cls):
        if info.name == name and info.enum is not None and text in info.enum.__members__:
            return int(info.enum[text])
    return text


def _json_read(value: Any, code: str) -> Any:
    if code in "fd" and isinstance(value, str):
        return _NOT_FINITE.get(value, value)
    text: Any = value
    if code == "T" and isinstance(value, dict):
        text = cast(dict[str, Any], value).get("bytes")
    elif code != "R":
        return text
    try:
        data = bytes.fromhex(text)
    except (ValueError, TypeError):
        return cast(Any, value)
    return data if code == "R" else data.decode("utf-8", "surrogateescape")


def _refuse_constant(text: str) -> NoReturn:
    raise ValueError(f"{text} is not JSON; write it in quotes")
