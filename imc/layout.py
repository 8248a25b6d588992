"""The layout of a packet (header, payload, CRC), and the struct letter and NumPy type of each field type."""

import struct

SYNC = 0xFE54
LITTLE_ENDIAN = SYNC & 0xFF
"""The first byte of a packet in this byte order; in the other it is 0xFE."""

HEADER_FIELDS = {
    "sync": "H",
    "id": "H",
    "size": "H",
    "timestamp": "d",
    "src": "H",
    "src_ent": "B",
    "dst": "H",
    "dst_ent": "B",
}
"""The header in wire order: name -> struct letter. `size` is the size of the payload in bytes."""

ADDRESS_FIELDS = dict(list(HEADER_FIELDS.items())[3:])
"""The part of the header that a message carries: name -> struct letter."""

HEADER = "".join(HEADER_FIELDS.values())
ADDRESS = "".join(ADDRESS_FIELDS.values())
HEADER_SIZE = struct.calcsize("<" + HEADER)
FOOTER_SIZE = 2  # the CRC
SMALLEST_PACKET = HEADER_SIZE + FOOTER_SIZE
LARGEST_PACKET = 0xFFFF
LARGEST_PAYLOAD = LARGEST_PACKET - SMALLEST_PACKET

OFFSETS = {name: struct.calcsize("<" + HEADER[:index]) for index, name in enumerate(HEADER_FIELDS)}
"""Offset of each field of the header in a packet."""

WIRE_CODES = {
    "int8_t": "b",
    "uint8_t": "B",
    "int16_t": "h",
    "uint16_t": "H",
    "int32_t": "i",
    "uint32_t": "I",
    "int64_t": "q",
    "fp32_t": "f",
    "fp64_t": "d",
    "plaintext": "T",
    "rawdata": "R",
    "message": "M",
    "message-list": "L",
}
"""Type of a field -> its letter in `Message.WIRE` (numbers: the letter of the struct module)."""

TYPES_BY_CODE = {code: name for name, code in WIRE_CODES.items()}
VARIABLE = frozenset("TRML")
"""Letters of the types whose size varies: text, bytes, a message, a list of messages."""

NUMBERS = frozenset(name for name, code in WIRE_CODES.items() if code not in VARIABLE)
"""Types of a fixed size."""

NUMPY = {"b": "i1", "B": "u1", "h": "i2", "H": "u2", "i": "i4", "I": "u4", "q": "i8", "f": "f4", "d": "f8"}
"""Letter of a number -> its NumPy type, without byte order."""


def numpy_columns(fields: dict[str, str], order: str = "<") -> list[tuple[str, str]]:
    """Fields (name -> struct letter) as the list of columns that `numpy.dtype` takes, in byte order "<" or ">"."""
    return [(name, order + NUMPY[code]) for name, code in fields.items()]
