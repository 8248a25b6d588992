"""LSF logs: packets one behind the other in a file, plain or compressed."""

import errno
import os
import re
import struct
from collections import Counter, deque
from collections.abc import Callable, Iterator
from pathlib import Path

from fastcrc import crc16

from imc.definition import MessageType
from imc.errors import DecodeError
from imc.members import COMPRESSIONS, unpack
from imc.message import Message
from imc.schema import Schema
from imc.schema_files import builtin, load
from imc.stream import Loss

NAMES = ("Data.lsf", "Data.lsf.gz", "Data.lsf.bz2", "Data.lsf.z")
SCHEMA_NAMES = ("IMC.xml", "IMC.xml.gz")
OVERHEAD = 22  # bytes of a packet without payload
CHUNK = 1 << 18
BLOCK = 1 << 17  # DUNE's, too: unpacked bytes of one member

NO_SYNC, BAD_CRC, CUT = "no packet begins here", "wrong CRC", "packet cut short"

_SYNC_AND_SIZE = struct.Struct("<HxxH").unpack_from


class Log:
    """A log on disk: a folder that holds Data.lsf (or .lsf.gz, .lsf.bz2, .lsf.z), or such a file.

    `schema` comes from the IMC.xml or IMC.xml.gz beside the data, and `schema_source` is its path; without one it is
    the built-in schema and `schema_source` is None. Messages that it defines as the built-in one does are of the
    classes in `imc`. Reading streams: memory does not grow with the log. Packets are given in the order of the file,
    which is not always that of their times.

    What was damaged is skipped and stands in `losses` once it has been read over; every packet around it is found.
    Raises FileNotFoundError where there is no log, SchemaError for a bad IMC.xml.
    """

    def __init__(self, path: str | os.PathLike[str], schema: Schema | None = None):
        self.path = _find(Path(path))
        beside = (self.path.parent / name for name in SCHEMA_NAMES)
        self.schema_source = None if schema else next((path for path in beside if path.is_file()), None)
        self.schema = schema or (_familiar(load(self.schema_source)) if self.schema_source else builtin())
        self._losses: dict[tuple[int, str], Loss] = {}
        self._counted: tuple[tuple[int, int], Counter[int]] | None = None

    def __repr__(self) -> str:
        return f"Log({str(self.path)!r})"

    def __iter__(self) -> Iterator[Message]:
        return self.messages()

    def __len__(self) -> int:
        """The number of packets; the first time it reads the whole log."""
        return self._count().total()

    @property
    def losses(self) -> list[Loss]:
        """The damage met so far, by offset."""
        return sorted(self._losses.values())

    def packets(self) -> Iterator[tuple[int, bytes]]:
        """Offset in the unpacked stream, and bytes, of each packet whose CRC is right."""
        return _scan(self._chunks(), self.schema.sync, self._lose)

    def messages(self, *kinds: type[Message] | str) -> Iterator[Message]:
        """The decoded messages, of the given types (classes or names) or of all.

        A packet that is whole but not a message of the schema (too short for its fields) is a loss. Raises KeyError for
        a name that the schema does not have.
        """
        wanted = {self.schema.types[kind if isinstance(kind, str) else kind.__name__].id for kind in kinds}
        decode = self.schema.decode
        for offset, packet in self.packets():
            if wanted and packet_id(packet) not in wanted:
                continue
            try:
                yield decode(packet)
            except DecodeError as error:
                self._lose(offset, len(packet), str(error))

    def counts(self) -> dict[str, int]:
        """How many packets of each message there are, by name ("id 1234" where the schema does not know it)."""
        known = self.schema.types_by_id
        found = sorted(self._count().items())
        return {known[number].abbrev if number in known else f"id {number}": count for number, count in found}

    def _count(self) -> Counter[int]:
        state = self.path.stat()
        stamp = (state.st_size, state.st_mtime_ns)
        if self._counted is None or self._counted[0] != stamp:
            self._counted = (stamp, Counter(packet_id(packet) for _, packet in self.packets()))
        return self._counted[1]

    def _lose(self, offset: int, length: int, reason: str) -> None:
        self._losses[offset, reason] = Loss(offset, length, reason)

    def _chunks(self) -> Iterator[bytes]:
        form = next((form for form in COMPRESSIONS.values() if form.suffix == self.path.suffix), None)
        with self.path.open("rb") as file:
            if form is None:
                while chunk := file.read(CHUNK):
                    yield chunk
                return
            offset = 0
            for chunk, damage in unpack(file, form):
                if damage:
                    self._lose(offset, 0, damage)
                offset += len(chunk)
                yield chunk


class LsfWriter:
    """Writes packets to a new LSF file; `compression` is "none", "gzip", "zlib" or "bzip2".

    Packets wait until `block` bytes are together or `flush()` is called, and then go to the file as one complete
    member with one write, so that the file can be read at any time. What a full disk refuses stays in `waiting`
    (bytes, packed) and is tried again first; nothing half-written is left. Raises OSError, FileExistsError.
    """

    def __init__(self, path: str | os.PathLike[str], compression: str = "gzip", block: int = BLOCK):
        self.path = Path(path)
        self.size = 0
        self.waiting = 0
        self._pack: Callable[[bytes], bytes] = COMPRESSIONS[compression].pack if compression != "none" else bytes
        self._block = block
        self._packets = bytearray()
        self._members: deque[bytes] = deque()
        self._file = os.open(self.path, os.O_WRONLY | os.O_CREAT | os.O_EXCL | os.O_APPEND, 0o644)

    def write(self, packet: bytes) -> None:
        """Take one packet. Raises OSError where a full block cannot be written; the packet is kept all the same."""
        self._packets += packet
        if len(self._packets) >= self._block:
            self.flush()

    def flush(self) -> None:
        """Hand all packets to the operating system, so that they survive the end of this process."""
        if self._packets:
            member = self._pack(bytes(self._packets))
            self._packets.clear()
            self._members.append(member)
            self.waiting += len(member)
        while self._members:
            self._append(self._members[0])
            self.waiting -= len(self._members.popleft())

    def fileno(self) -> int:
        return self._file

    def in_place(self) -> bool:
        """Whether the path still leads to the file that is written."""
        try:
            return os.path.samestat(os.stat(self.path), os.fstat(self._file))
        except OSError:
            return False

    def close(self) -> None:
        """Flush and close; it is closed even where the flush raises."""
        try:
            self.flush()
        finally:
            os.close(self._file)

    def _append(self, member: bytes) -> None:
        if os.fstat(self._file).st_size != self.size:
            os.ftruncate(self._file, self.size)
        rest = memoryview(member)
        try:
            # A full disk takes a part of it first, and says what is wrong when asked for the rest.
            while rest:
                rest = rest[os.write(self._file, rest) :]
        except OSError as error:
            os.ftruncate(self._file, self.size)
            raise OSError(error.errno, error.strerror, str(self.path)) from error
        self.size += len(member)


def packet_id(packet: bytes) -> int:
    """The message id of a packet in either byte order."""
    return int.from_bytes(packet[2:4], "little" if packet[0] == 0x54 else "big")


def _find(path: Path) -> Path:
    if path.is_file():
        return path
    if not path.is_dir():
        raise FileNotFoundError(errno.ENOENT, "no such log", str(path))
    for name in NAMES:
        if (path / name).is_file():
            return path / name
    others = sorted(path.glob("*.lsf")) + sorted(path.glob("*.lsf.*"))
    if len(others) != 1:
        raise FileNotFoundError(errno.ENOENT, f"no log in the folder (one of {', '.join(NAMES)})", str(path))
    return others[0]


def _familiar(schema: Schema) -> Schema:
    """The schema with the built-in classes for the messages that are the same."""
    ours = builtin()
    if schema == ours:
        return ours
    if schema.sync == ours.sync:
        same = (n for n, t in ours.types_by_id.items() if _shape(ours, t) == _shape(schema, schema.types_by_id.get(n)))
        schema.adopt({number: ours.by_id(number) for number in same})
    return schema


def _shape(schema: Schema, message: MessageType | None) -> object:
    """All of a message that its class has: name, types, names of fields and of their values."""
    if message is None:
        return None
    values = [[(value.abbrev, value.id) for value in schema.values_of(field)] for field in message.fields]
    return message.abbrev, message.wire, [field.attribute for field in message.fields], values


def _scan(chunks: Iterator[bytes], sync: int, lose: Callable[[int, int, str], None]) -> Iterator[tuple[int, bytes]]:
    """Offset and bytes of each good packet; what lies between them goes to `lose`."""
    search = re.compile(b"|".join(map(re.escape, (sync.to_bytes(2, "little"), sync.to_bytes(2, "big"))))).search
    buffer, base, pos = b"", 0, 0
    lost, reason = -1, ""
    for chunk, last in _marking_last(chunks):
        buffer, base, pos = buffer[pos:] + chunk, base + pos, 0
        while pos < len(buffer):
            packet, why = _packet_at(buffer, pos, sync)
            if packet:
                if lost >= 0:
                    lose(lost, base + pos - lost, reason)
                    lost = -1
                yield base + pos, packet
                pos += len(packet)
                continue
            if why is CUT and not last:
                break
            if lost < 0:
                lost, reason = base + pos, why
            found = search(buffer, pos + 1)
            pos = found.start() if found else max(pos + 1, len(buffer) - 1)
    if lost >= 0:
        lose(lost, base + pos - lost, reason)


def _packet_at(buffer: bytes, pos: int, sync: int) -> tuple[bytes, str]:
    """The packet that begins at `pos`, else why there is none; CUT where more bytes could make it one."""
    if pos + 6 > len(buffer):
        begin = buffer[pos : pos + 2]
        possible = sync.to_bytes(2, "little").startswith(begin) or sync.to_bytes(2, "big").startswith(begin)
        return b"", CUT if possible else NO_SYNC
    found, size = _SYNC_AND_SIZE(buffer, pos)
    big = found != sync
    if big:
        if found != (sync >> 8 | (sync & 0xFF) << 8):
            return b"", NO_SYNC
        size = size >> 8 | (size & 0xFF) << 8
    size += OVERHEAD
    packet = buffer[pos : pos + size]
    if len(packet) < size:
        return b"", CUT
    # The CRC-16/ARC of data with their CRC behind them, low byte first, is zero.
    good = crc16.arc(packet[:-2] + packet[:-3:-1] if big else packet) == 0
    return (packet, "") if good else (b"", BAD_CRC)


def _marking_last(chunks: Iterator[bytes]) -> Iterator[tuple[bytes, bool]]:
    for chunk in chunks:
        yield chunk, False
    yield b"", True
