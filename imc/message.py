"""The base classes of messages: header, copying, encoding."""

import struct
from collections.abc import Sequence
from typing import Any, ClassVar, NamedTuple, Self

import msgspec
from fastcrc.crc16 import arc
from msgspec.structs import force_setattr
from msgspec.structs import replace as replace_fields

from imc.codec_compiler import check_payload_size, compile_inline_encoder, compile_packet_encoder
from imc.errors import EncodeError
from imc.layout import HEADER


class Header(NamedTuple):
    """Header of a packet: `size` is that of the payload in bytes, `timestamp` is in s since 1970 UTC."""

    id: int
    size: int
    timestamp: float
    src: int
    src_ent: int
    dst: int
    dst_ent: int


class _Addressed(msgspec.Struct, frozen=True, gc=False):
    timestamp: float = -1.0
    src: int = 0xFFFF
    src_ent: int = 0xFF
    dst: int = 0xFFFF
    dst_ent: int = 0xFF


class Message(_Addressed, frozen=True, kw_only=True, repr_omit_defaults=True):
    """An immutable IMC message: the fields of its header (timestamp in s since 1970 UTC), then its own.

    Fields are given by keyword, and default to zero, empty or None. In their order, after `EMPTY_HEADER` or a time and
    `UNADDRESSED`, they take a quarter of the time, which counts for long messages at a high rate. Text that is not
    UTF-8 keeps its bytes as surrogates (PEP 383). `surplus` holds payload bytes after the last field, which a newer
    schema may send.
    """

    ID: ClassVar[int] = 0xFFFF
    WIRE: ClassVar[str] = ""
    SYNC: ClassVar[int] = 0xFE54
    SCHEMA: ClassVar[Any] = None

    surplus: bytes = b""

    def replace(self, **changes: Any) -> Self:
        """A copy with some fields changed. Raises TypeError for a field that does not exist."""
        return replace_fields(self, **changes)

    def to_dict(self) -> dict[str, Any]:
        """Name, header and fields as plain values: {"abbrev": "EntityState", "timestamp": -1.0, ..., "state": 1}.

        Messages inside are such dictionaries without a header. `imc.from_dict` is the inverse.
        """
        from imc.dict_codec import to_dict  # imports this module

        return to_dict(self)

    def to_json(self) -> str:
        """`to_dict` as strict JSON.

        NaN and infinities are "nan", "inf", "-inf"; bytes are hexadecimal; text that is not UTF-8 is
        {"bytes": hexadecimal}. `imc.from_json` is the inverse.
        """
        from imc.dict_codec import to_json  # imports this module

        return to_json(self)

    # The first call of one of these compiles a method for the class, which then shadows the one here.

    def to_packet(self) -> bytes:
        """The packet; `imc.encode` calls this."""
        cls = type(self)
        cls.to_packet = compile_packet_encoder(cls, given_header=False)
        return self.to_packet()

    def to_packet_with_header(self, timestamp: float, src: int, src_ent: int, dst: int, dst_ent: int) -> bytes:
        """The packet with another header; `imc.encode_with_header` calls this."""
        cls = type(self)
        cls.to_packet_with_header = compile_packet_encoder(cls, given_header=True)
        return self.to_packet_with_header(timestamp, src, src_ent, dst, dst_ent)

    def to_inline_little(self) -> bytes:
        """Id and fields, as written inside another message, little endian."""
        cls = type(self)
        cls.to_inline_little = compile_inline_encoder(cls, "<")
        return self.to_inline_little()

    def to_inline_big(self) -> bytes:
        """Id and fields, as written inside another message, big endian."""
        cls = type(self)
        cls.to_inline_big = compile_inline_encoder(cls, ">")
        return self.to_inline_big()


class MessageWithLists(Message, frozen=True):
    """A message with lists of messages; lists given at construction become tuples."""

    LISTS: ClassVar[tuple[str, ...]] = ()

    def __post_init__(self) -> None:
        for name in self.LISTS:
            value: Sequence[Message | None] = getattr(self, name)
            if isinstance(value, list):
                force_setattr(self, name, tuple(value))


class Unknown(Message, frozen=True):
    """A message whose id is not in the schema. It is encoded as it was received, in its own byte order."""

    id: int = 0xFFFF
    payload: bytes = b""
    byteorder: str = "little"

    def to_packet(self) -> bytes:
        return self.to_packet_with_header(self.timestamp, self.src, self.src_ent, self.dst, self.dst_ent)

    def to_packet_with_header(self, timestamp: float, src: int, src_ent: int, dst: int, dst_ent: int) -> bytes:
        mark = "<" if self.byteorder == "little" else ">"
        size = check_payload_size(self.payload, self)
        body = struct.pack(mark + HEADER, self.SYNC, self.id, size, timestamp, src, src_ent, dst, dst_ent)
        body += self.payload
        return body + struct.pack(mark + "H", arc(body))

    def to_inline_little(self) -> bytes:
        raise EncodeError(f"a message of unknown id {self.id} cannot be put inside another")

    to_inline_big = to_inline_little
