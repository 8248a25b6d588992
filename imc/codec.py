"""Messages to packets and back: byte order, CRC, nesting, unknown ids."""

import struct
from collections.abc import Callable
from typing import Any, Literal, NamedTuple

from fastcrc.crc16 import arc
from msgspec.structs import force_setattr

from imc.codec_compiler import Passage, Reader, check_payload_size, compile_decoder, compile_round_trip
from imc.encodability import encoding_violations, first_violation
from imc.errors import DecodeError, EncodeError
from imc.layout import (
    ADDRESS,
    ADDRESS_FIELDS,
    FOOTER_SIZE,
    HEADER,
    HEADER_SIZE,
    LITTLE_ENDIAN,
    OFFSETS,
    SMALLEST_PACKET,
    VARIABLE,
)
from imc.message import Header, Message, Unknown
from imc.messages import BY_ID

ByteOrder = Literal["little", "big"]

_LITTLE = Message.SYNC.to_bytes(2, "little")
_ADDRESS = struct.Struct("<" + ADDRESS).unpack_from
_SIZE_AND_ADDRESS = struct.Struct("<H" + ADDRESS).unpack_from
_HEADERS = {"little": struct.Struct("<" + HEADER), "big": struct.Struct(">" + HEADER)}
_UNSUITABLE = (struct.error, TypeError, ValueError, AttributeError, OverflowError, RecursionError)


def encode(message: Message, byteorder: ByteOrder = "little") -> bytes:
    """The packet of a message: header, payload, CRC. Raises EncodeError naming the field that does not fit."""
    try:
        return message.to_packet() if byteorder == "little" else _packet(message, byteorder)
    except _UNSUITABLE as error:
        raise _explained(message, error) from error


def encode_with_header(message: Message, timestamp: float, src: int, src_ent: int, dst: int, dst_ent: int) -> bytes:
    """The packet of a message, with this header instead of its own. Raises EncodeError."""
    try:
        return message.to_packet_with_header(timestamp, src, src_ent, dst, dst_ent)
    except _UNSUITABLE as error:
        with_it = message.replace(timestamp=timestamp, src=src, src_ent=src_ent, dst=dst, dst_ent=dst_ent)
        raise _explained(with_it, error) from error


def packet_id(packet: bytes) -> int:
    """The message id of a packet in either byte order."""
    return int.from_bytes(packet[2:4], "little" if packet[0] == LITTLE_ENDIAN else "big")


def packet_source(packet: bytes) -> int:
    """The system that a packet, in either byte order, names as its source."""
    return packet[14] | packet[15] << 8 if packet[0] == LITTLE_ENDIAN else packet[14] << 8 | packet[15]


def header(packet: bytes) -> Header:
    """The header of a packet; the rest is not checked. Raises DecodeError."""
    return Header._make(_HEADERS[byte_order(packet)].unpack_from(packet)[1:])


def with_header(
    packet: bytes,
    *,
    timestamp: float | None = None,
    src: int | None = None,
    src_ent: int | None = None,
    dst: int | None = None,
    dst_ent: int | None = None,
) -> bytes:
    """A copy of a packet with some header fields changed and a new CRC. Raises DecodeError, EncodeError."""
    order = byte_order(packet)
    sync, id, size, *old = _HEADERS[order].unpack_from(packet)
    if len(packet) < size + SMALLEST_PACKET:
        raise DecodeError(f"truncated: {len(packet)} of {size + SMALLEST_PACKET} bytes")
    new = (timestamp, src, src_ent, dst, dst_ent)
    values = (before if value is None else value for before, value in zip(old, new, strict=True))
    try:
        body = _HEADERS[order].pack(sync, id, size, *values) + packet[HEADER_SIZE : HEADER_SIZE + size]
    except struct.error as error:
        raise EncodeError(f"header of packet {id}: {error}") from error
    return body + arc(body).to_bytes(2, order)


def byte_order(packet: bytes, sync: int = Message.SYNC) -> ByteOrder:
    """Byte order of a packet, from its first two bytes. Raises DecodeError if it is too short or not an IMC packet."""
    if len(packet) < SMALLEST_PACKET:
        raise DecodeError(f"truncated: {len(packet)} bytes, a packet has at least {SMALLEST_PACKET}")
    first = int.from_bytes(packet[:2], "little")
    if first == sync:
        return "little"
    if first == (sync >> 8 | (sync & 0xFF) << 8):
        return "big"
    raise DecodeError(f"synchronization number {first:#06x} instead of {sync:#06x}")


class Codec:
    """Reads the packets of one schema."""

    def __init__(self, by_id: Callable[[int], type[Message]], sync: int) -> None:
        self._by_id = by_id
        self.sync = sync
        self._readers = {"little": _Readers(by_id, "<"), "big": _Readers(by_id, ">")}
        self._fixed: dict[bytes, _Fixed] = {}
        self._variable: dict[bytes, Reader] = {}
        self._passages: dict[tuple[type[Message], bool], Passage] = {}

    def decode(self, packet: bytes) -> Message:
        """The message in a packet: an instance of its id's class, or Unknown. Bytes after the packet are ignored.

        Messages inside it have the default header, since they have none on the wire. Numbers keep all their bits,
        except that a signaling NaN in an fp32_t becomes quiet: Python's floats are doubles. Raises DecodeError.
        """
        # Fast path for messages of fixed size: their first six bytes (sync, id, size) determine byte order, class and
        # layout. Once `_decode` has accepted one such packet, only length and CRC of the next ones need checks.
        try:
            fixed = self._fixed.get(packet[:6])
        except TypeError:  # a bytearray
            return self.decode(bytes(packet))
        if fixed is not None:
            size, cls, unpack = fixed
            # CRC-16/ARC over data and its own little-endian CRC is zero.
            if len(packet) == size and not arc(packet):
                return cls(*unpack(packet, 6))
        return self._read(bytes(packet))

    def decode_first(self, data: bytes) -> tuple[Message, bytes]:
        """The message at the start of a datagram, and its packet: without the bytes after it. Raises DecodeError."""
        fixed = self._fixed.get(data[:6])
        if fixed is not None:
            size, cls, unpack = fixed
            if len(data) == size and not arc(data):
                return cls(*unpack(data, 6)), data
        message = self._read_variable(data)
        return (message, data) if message is not None else (self._decode(data), datagram_packet(data))

    def round_trip_function(self, kind: type[Message], encodes: bool) -> Passage:
        """A function (message of a class, the five values of its header) -> what a receiver of the packet decodes.

        With `encodes` it returns that and the packet. It raises what `Message.to_packet_with_header` raises.
        """
        found = self._passages.get((kind, encodes))
        if found is None:
            found = self._passages[kind, encodes] = self._make_passage(kind, encodes)
        return found

    def _make_passage(self, kind: type[Message], encodes: bool) -> Passage:
        if not self.has_message_class(kind):
            return self._general(encodes)
        if not VARIABLE.intersection(kind.WIRE):
            return compile_round_trip(kind, encodes, self._general(encodes))
        read, at = self._readers["little"][kind.ID], OFFSETS["timestamp"]

        def passage(m: Message, timestamp: float, src: int, src_ent: int, dst: int, dst_ent: int) -> Any:
            packet = m.to_packet_with_header(timestamp, src, src_ent, dst, dst_ent)
            try:
                seen, end = read(packet, HEADER_SIZE, *_ADDRESS(packet, at), 0)
            except _UNSUITABLE:
                seen, end = m, 0
            if end != len(packet) - FOOTER_SIZE:  # surplus bytes, or a message of other definitions inside
                seen = self._read(packet)
            return (seen, packet) if encodes else seen

        return passage

    def _general(self, encodes: bool) -> Passage:
        def passage(m: Message, timestamp: float, src: int, src_ent: int, dst: int, dst_ent: int) -> Any:
            packet = m.to_packet_with_header(timestamp, src, src_ent, dst, dst_ent)
            return (self._read(packet), packet) if encodes else self._read(packet)

        return passage

    def has_message_class(self, kind: type[Message]) -> bool:
        """Whether `decode` returns messages of this very class; other schemas have classes of their own."""
        try:
            return self._by_id(kind.ID) is kind
        except KeyError:
            return False

    def _read(self, packet: bytes) -> Message:
        message = self._read_variable(packet)
        return self._decode(packet) if message is None else message

    def _read_variable(self, packet: bytes) -> Message | None:
        """The message, if `_decode` has already accepted one of this id and of variable size, and nothing is wrong."""
        read = self._variable.get(packet[:4])
        if read is None or arc(packet) or len(packet) < SMALLEST_PACKET:
            return None
        size, *address = _SIZE_AND_ADDRESS(packet, 4)
        end = HEADER_SIZE + size
        if len(packet) != end + FOOTER_SIZE:
            return None
        try:
            message, offset = read(packet, HEADER_SIZE, *address, 0)
        except struct.error:
            return None
        return message if offset == end else None

    def _decode(self, packet: bytes) -> Message:
        order = byte_order(packet, self.sync)
        _, id, size, *address = _HEADERS[order].unpack_from(packet)
        end = HEADER_SIZE + size
        if len(packet) < end + FOOTER_SIZE:
            raise DecodeError(f"truncated: {len(packet)} of {end + FOOTER_SIZE} bytes")
        if arc(packet[:end]) != int.from_bytes(packet[end : end + FOOTER_SIZE], order):
            raise DecodeError("wrong CRC")
        try:
            cls = self._by_id(id)
        except KeyError:
            return Unknown(*address, id=id, payload=packet[HEADER_SIZE:end], byteorder=order)
        try:
            message, offset = self._readers[order][id](packet, HEADER_SIZE, *address, 0)
        except struct.error:
            message, offset = None, end + 1
        if message is None or offset > end:
            raise DecodeError(f"{cls.__name__}: payload of {size} bytes is too short")
        if offset < end:
            force_setattr(message, "surplus", packet[offset:end])
        elif order == "big":
            pass
        elif VARIABLE.intersection(cls.WIRE):
            self._variable[packet[:4]] = self._readers[order][id]
        else:
            unpack = struct.Struct("<" + ADDRESS + cls.WIRE).unpack_from
            self._fixed[packet[:6]] = _Fixed(end + FOOTER_SIZE, cls, unpack)
        return message


class _Fixed(NamedTuple):
    size: int
    cls: type[Message]
    unpack: Callable[[bytes, int], tuple[Any, ...]]


class _Readers(dict[int, Reader]):
    """Compiles the reader of an id when it is first needed."""

    def __init__(self, by_id: Callable[[int], type[Message]], mark: str) -> None:
        self._by_id = by_id
        self._mark = mark

    def __missing__(self, id: int) -> Reader:
        try:
            cls = self._by_id(id)
        except KeyError:
            raise DecodeError(f"unknown message id {id} inside a message") from None
        reader = self[id] = compile_decoder(cls, self._mark, self)
        return reader


def _packet(message: Message, byteorder: ByteOrder) -> bytes:
    if byteorder not in _HEADERS:
        raise EncodeError(f"byteorder {byteorder!r} is neither 'little' nor 'big'")
    if isinstance(message, Unknown):
        return message.to_packet()
    address = (message.timestamp, message.src, message.src_ent, message.dst, message.dst_ent)
    payload = message.to_inline_big()[2:] + message.surplus
    body = _HEADERS["big"].pack(message.SYNC, message.ID, check_payload_size(payload, message), *address) + payload
    return body + arc(body).to_bytes(2, "big")


def _explained(message: Message, error: Exception) -> EncodeError:
    if isinstance(error, EncodeError):
        return error
    name = type(message).__name__
    for violation in encoding_violations(message, ADDRESS_FIELDS):
        return EncodeError(f"{name}.{violation}")
    problem = "nested too deeply" if isinstance(error, RecursionError) else first_violation(message)
    return EncodeError(f"{name}.{problem}" if problem else f"{name}: {error}")


DEFAULT = Codec(BY_ID.__getitem__, Message.SYNC)
"""The codec of the classes in `imc.messages`."""

decode: Callable[[bytes], Message] = DEFAULT.decode


def decode_datagram(data: bytes) -> Message:
    """The message in a datagram, which is one packet; like in DUNE, bytes after it are ignored. Raises DecodeError."""
    return DEFAULT.decode(data)


def datagram_packet(data: bytes) -> bytes:
    """The packet at the start of a datagram, without the bytes after it. Raises DecodeError."""
    length = len(data)
    if length >= SMALLEST_PACKET and data.startswith(_LITTLE) and data[4] | data[5] << 8 == length - SMALLEST_PACKET:
        return bytes(data)
    size = int.from_bytes(data[4:6], byte_order(data)) + SMALLEST_PACKET
    if length < size:
        raise DecodeError(f"truncated: {length} of {size} bytes")
    return bytes(data[:size])
