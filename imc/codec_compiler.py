"""Generates and compiles the functions that encode and decode one message class."""

# The generated code has no loop over fields: each run of fixed-size fields is one struct call, however many they are.
# That makes the codec fast, and it is why functions are generated for each class.

import struct
from collections.abc import Callable
from typing import TYPE_CHECKING, Any

from fastcrc.crc16 import arc

from imc.errors import DecodeError, EncodeError
from imc.layout import (
    ADDRESS,
    ADDRESS_FIELDS,
    HEADER,
    HEADER_SIZE,
    LARGEST_PACKET,
    LARGEST_PAYLOAD,
    SMALLEST_PACKET,
    VARIABLE,
)

if TYPE_CHECKING:
    from imc.message import Message

NULL = 0xFFFF
DEEPEST = 200

Reader = Callable[..., "tuple[Message, int]"]
Passage = Callable[["Message", float, int, int, int, int], Any]

_NULL_BYTES = b"\xff\xff"
_NO_HEADER = "-1.0, 0xFFFF, 0xFF, 0xFFFF, 0xFF"  # a message inside another has none on the wire


def compile_inline_encoder(cls: "type[Message]", order: str) -> Any:
    """A function message -> bytes of its id and fields, as inside another message. order: "<" or ">"."""
    method = "to_inline_little" if order == "<" else "to_inline_big"
    space: dict[str, Any] = {"NULL": _NULL_BYTES}
    lines = ["def inline(m):"]
    parts: list[str] = []
    layout, arguments = "H", [str(cls.ID)]

    def flush() -> None:  # ends a run of fixed-size fields
        nonlocal layout
        if layout:
            space[f"pack{len(space)}"] = struct.Struct(order + layout).pack
            parts.append(f"pack{len(space) - 1}({', '.join(arguments)})")
            layout = ""
            arguments.clear()

    for index, (name, code) in enumerate(zip(_own_fields(cls), cls.WIRE, strict=True)):
        local = f"v{index}"
        if code not in VARIABLE:
            layout += code
            arguments.append(f"m.{name}")
        elif code == "M":
            flush()
            lines.append(f"    {local} = m.{name}")
            parts.append(f"({local}.{method}() if {local} is not None else NULL)")
        else:
            lines.append(f"    {local} = m.{name}" + (".encode('utf-8', 'surrogateescape')" if code == "T" else ""))
            layout += "H"  # the length is the last number of the run before the bytes
            arguments.append(f"len({local})")
            flush()
            parts.append(
                f"b''.join([x.{method}() if x is not None else NULL for x in {local}])" if code == "L" else local
            )
    flush()
    return _compile([*lines, f"    return {' + '.join(parts)}"], "inline", space)


def compile_packet_encoder(cls: "type[Message]", given_header: bool) -> Any:
    """A function message -> little-endian packet; with given_header it also takes the five header values."""
    header = [("" if given_header else "m.") + name for name in ADDRESS_FIELDS]
    address = ", ".join(header)
    space: dict[str, Any] = {"arc": arc, "head": struct.Struct("<" + HEADER).pack, "sized": check_payload_size}
    space["footer"] = struct.Struct("<H").pack
    lines = [f"def packet({', '.join(['m', *header]) if given_header else 'm'}):"]
    general = (
        "p = m.to_inline_little()[2:] + m.surplus",
        f"body = head({cls.SYNC}, {cls.ID}, sized(p, m), {address}) + p",
    )
    if VARIABLE.intersection(cls.WIRE):
        lines += ["    " + line for line in general]
    else:
        whole = struct.Struct("<IH" + ADDRESS + cls.WIRE)  # I: sync and id together, one constant
        fields = ["m." + name for name in _own_fields(cls)]
        values = ", ".join([str(cls.SYNC | cls.ID << 16), str(whole.size - HEADER_SIZE), *header, *fields])
        space["pack"] = whole.pack
        lines += ["    if m.surplus:", *("        " + line for line in general)]
        lines += [f"    else: body = pack({values})"]
    return _compile([*lines, "    return body + footer(arc(body))"], "packet", space)


def compile_round_trip(cls: "type[Message]", encodes: bool, general: Passage) -> Passage:
    """The result of `round_trip_function` for a class of fixed size. `general` is for messages with surplus bytes."""
    prefix = "IH" if encodes else ""
    whole, seen = struct.Struct("<" + prefix + ADDRESS + cls.WIRE), struct.Struct("<" + ADDRESS + cls.WIRE)
    begin = [str(cls.SYNC | cls.ID << 16), str(whole.size - HEADER_SIZE)] if encodes else []
    values = ", ".join([*begin, *ADDRESS_FIELDS, *("m." + name for name in _own_fields(cls))])
    space: dict[str, Any] = {"cls": cls, "pack": whole.pack, "unpack": seen.unpack_from, "arc": arc}
    space |= {"footer": struct.Struct("<H").pack, "general": general}
    header = ", ".join(ADDRESS_FIELDS)
    lines = [f"def passage(m, {header}):", f"    if m.surplus: return general(m, {header})", f"    b = pack({values})"]
    if encodes:
        lines.append(f"    return cls(*unpack(b, {whole.size - seen.size})), b + footer(arc(b))")
    else:
        lines.append("    return cls(*unpack(b))")
    return _compile(lines, "passage", space)


def check_payload_size(payload: bytes, message: "Message") -> int:
    """Size of a payload in bytes. Raises EncodeError if its packet exceeds 65535 bytes."""
    size = len(payload)
    if size > LARGEST_PAYLOAD:
        packet = size + SMALLEST_PACKET
        raise EncodeError(f"{type(message).__name__}: packet of {packet} bytes, {LARGEST_PACKET} at most")
    return size


def compile_decoder(cls: "type[Message]", order: str, readers: dict[int, Reader]) -> Reader:
    """A function (bytes, offset, five header values, depth) -> (message, offset after it).

    It may read past the end of the payload: the caller must compare offsets. Raises struct.error if bytes are missing.
    """
    space: dict[str, Any] = {"cls": cls, "readers": readers, "items": _read_items, "deeper": _deeper}
    head = ", ".join(ADDRESS_FIELDS)
    lines = [f"def read(b, o, {head}, depth):"]
    names: list[str] = []
    layout, targets = "", list[str]()

    def flush() -> None:
        nonlocal layout
        if layout:
            unit = struct.Struct(order + layout)
            space[f"unpack{len(space)}"] = unit.unpack_from
            lines.append(f"    {', '.join(targets)}, = unpack{len(space) - 1}(b, o); o += {unit.size}")
            layout = ""
            targets.clear()

    for index, code in enumerate(cls.WIRE):
        name = f"v{index}"
        names.append(name)
        layout += "H" if code in VARIABLE else code
        targets.append(name)
        if code not in VARIABLE:
            continue
        flush()
        if code == "T":
            lines.append(f"    n = o + {name}; {name} = str(b[o:n], 'utf-8', 'surrogateescape'); o = n")
        elif code == "R":
            lines.append(f"    n = o + {name}; {name} = b[o:n]; o = n")
        elif code == "M":
            lines.append(f"    if {name} == {NULL}: {name} = None")
            lines.append(f"    else: {name}, o = readers[{name}](b, o, {_NO_HEADER}, deeper(depth))")
        else:
            space["number"] = struct.Struct(order + "H").unpack_from
            lines.append(f"    {name}, o = items(b, o, {name}, number, readers, depth) if {name} else ((), o)")
    flush()
    return _compile([*lines, f"    return cls({', '.join([head, *names])}), o"], "read", space)


def _read_items(
    data: bytes,
    offset: int,
    count: int,
    number: Callable[[bytes, int], tuple[int]],
    readers: dict[int, Reader],
    depth: int,
) -> "tuple[tuple[Message | None, ...], int]":
    depth = _deeper(depth)
    found: list[Message | None] = []
    for _ in range(count):
        (id,) = number(data, offset)
        if id == NULL:
            found.append(None)
            offset += 2
        else:
            item, offset = readers[id](data, offset + 2, -1.0, 0xFFFF, 0xFF, 0xFFFF, 0xFF, depth)
            found.append(item)
    return tuple(found), offset


def _deeper(depth: int) -> int:
    if depth >= DEEPEST:
        raise DecodeError(f"messages nested deeper than {DEEPEST}")
    return depth + 1


def _own_fields(cls: "type[Message]") -> tuple[str, ...]:
    return cls.__struct_fields__[len(ADDRESS_FIELDS) : -1]


def _compile(lines: list[str], name: str, space: dict[str, Any]) -> Any:
    # Safe to exec: the source has only our own text, letters from WIRE_CODES and names that passed check_messages.
    exec(compile("\n".join(lines), f"<imc {name}>", "exec"), space)
    return space[name]
