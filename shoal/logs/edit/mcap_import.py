"""Restores a log from an MCAP file that has its packets."""

import io
import struct
import zlib
from collections.abc import Generator, Iterator
from contextlib import contextmanager
from dataclasses import replace
from pathlib import Path
from typing import IO, Any

from lz4.frame import LZ4FrameDecompressor  # pyright: ignore[reportMissingTypeStubs, reportUnknownVariableType]
from mcap.data_stream import ReadDataStream
from mcap.exceptions import McapError
from mcap.reader import SeekingReader
from mcap.records import Attachment, Channel, Chunk, McapRecord, Message
from mcap.stream_reader import StreamReader, breakup_chunk
from zstandard import ZstdDecompressor, ZstdError

from imc.lsf import LsfWriter
from shoal.logs.export.mcap import BESIDE, LARGEST_BESIDE, PACKETS, PACKETS_TOPIC

TOPIC = "/" + "/".join(PACKETS_TOPIC)
LARGEST_CHUNK = 1 << 26  # bytes, unpacked; an IMC packet has up to 64 KiB
MOST_REASONS = 3
LARGEST_RECORD = 1 << 28  # bytes; other channels may have pictures
RECORD_HEAD = 9


class BadMcapFile(ValueError):
    """A file that cannot be imported; the text gives its name and the reason."""


class _BoundedFile(io.BufferedReader):
    """A file whose reads are limited to the largest size of a record, for any length that the file claims."""

    def read(self, size: int | None = -1, /) -> bytes:
        if size is None or not 0 <= size <= LARGEST_RECORD:
            raise McapError(f"a field of {size} bytes; the limit is {LARGEST_RECORD}")
        return super().read(size)


class _Records(StreamReader):
    """Ends where zeros begin, as after a crash of the recorder: no record has the code 0, and each would be skipped."""

    def _read_record(self, opcode: int, length: int) -> McapRecord | None:
        if opcode == 0:
            raise McapError("no record begins with 0")
        return super()._read_record(opcode, length)


def import_mcap(path: Path, folder: Path) -> list[str]:
    """Write the packets of an MCAP file, unchanged, to Data.lsf.gz in `folder`, and its IMC.xml.gz, IMC.xml and
    Config.ini, if it has them; returns what is wrong with the file.

    Damaged chunks are skipped; if the file ends early, all complete chunks are read. Raises BadMcapFile if it has no
    packets, OSError.
    """
    wrong: list[str] = []
    count = 0
    with _BoundedFile(io.FileIO(path)) as file:
        writer = LsfWriter(folder / "Data.lsf.gz")
        try:
            indexed = _indexed(file, wrong)
            for data in _attached(file, indexed, wrong):
                if data.name in BESIDE and len(data.data) <= LARGEST_BESIDE:
                    (folder / data.name).write_bytes(data.data)
            for chunk, numbers in _chunks(file, indexed, wrong):
                for packets in _packets(chunk, numbers, wrong):
                    writer.write(packets)
                    count += 1
        finally:
            writer.close()
    if not count:
        why = "".join(f"; {text}" for text in list(dict.fromkeys(wrong))[:MOST_REASONS])
        raise BadMcapFile(f"{path}: there are no IMC packets in it (topic {TOPIC}, type {PACKETS.full_name}){why}")
    return [f"{path}: {text}" for text in dict.fromkeys(wrong)]


def expected_packets(path: Path) -> int:
    """Number of packets by the summary at the end of a file; 0 if the end is missing. Raises OSError."""
    with _BoundedFile(io.FileIO(path)) as file, _noting([], "its end"):
        summary = _reader(file).get_summary()
        if summary is not None and summary.statistics is not None:
            counts = summary.statistics.channel_message_counts
            return sum(counts.get(channel.id, 0) for channel in summary.channels.values() if channel.topic == TOPIC)
    return 0


def _indexed(file: IO[bytes], wrong: list[str]) -> SeekingReader | None:
    """A reader by the indexes at the end of the file; None if there are none."""
    with _noting(wrong, "its end"):
        reader = _reader(file)
        return reader if reader.get_summary() is not None else None
    return None


def _attached(file: IO[bytes], indexed: SeekingReader | None, wrong: list[str]) -> Iterator[Attachment]:
    with _noting(wrong, "its list of attachments"):
        if indexed is not None:
            yield from indexed.iter_attachments()
            return
    file.seek(0)
    with _noting([], "its end"):
        for record in _Records(file, emit_chunks=True, record_size_limit=LARGEST_RECORD).records:
            if isinstance(record, Attachment):
                yield record


def _reader(file: IO[bytes]) -> SeekingReader:
    return SeekingReader(file, record_size_limit=LARGEST_RECORD)


def _chunks(file: IO[bytes], indexed: SeekingReader | None, wrong: list[str]) -> Iterator[tuple[Chunk, set[int]]]:
    """The chunks that may have packets, in file order, each with the numbers of the channels of packets."""
    summary = indexed.get_summary() if indexed is not None else None
    if summary is None or not summary.chunk_indexes:
        file.seek(0)
        yield from _salvaged(file, wrong)
        return
    numbers = {channel.id for channel in summary.channels.values() if channel.topic == TOPIC}
    for index in sorted(summary.chunk_indexes, key=lambda index: index.chunk_start_offset):
        if numbers & index.message_index_offsets.keys():
            with _noting(wrong, f"the chunk at byte {index.chunk_start_offset}"):
                file.seek(index.chunk_start_offset + RECORD_HEAD)
                yield Chunk.read(ReadDataStream(file)), numbers


def _salvaged(file: IO[bytes], wrong: list[str]) -> Iterator[tuple[Chunk, set[int]]]:
    """All chunks of a file whose end is missing."""
    numbers: set[int] = set()
    with _noting(wrong, "its end"):
        for record in _Records(file, emit_chunks=True, record_size_limit=LARGEST_RECORD).records:
            if isinstance(record, Channel) and record.topic == TOPIC:
                numbers.add(record.id)
            elif isinstance(record, Chunk):
                yield record, numbers


def _packets(chunk: Chunk, numbers: set[int], wrong: list[str]) -> Iterator[bytes]:
    if chunk.uncompressed_size > LARGEST_CHUNK:
        wrong.append(f"damaged: a chunk of {chunk.uncompressed_size} bytes; the limit is {LARGEST_CHUNK}")
        return
    with _noting(wrong, "a chunk"):
        for record in breakup_chunk(_unpacked(chunk)):
            if isinstance(record, Message) and record.channel_id in numbers:
                size = int.from_bytes(record.data[4:8], "little")
                if len(record.data) != 8 + size:
                    raise ValueError(f"a message of {len(record.data)} bytes in place of {8 + size}")
                yield record.data[8:]


def _unpacked(chunk: Chunk) -> Chunk:
    """A chunk without its compression. Raises ValueError if it has not the size or the CRC that it claims."""
    size = chunk.uncompressed_size
    data: bytes = chunk.data
    if chunk.compression == "zstd":
        data = ZstdDecompressor().stream_reader(data).read(size + 1)
    elif chunk.compression == "lz4":
        unpacker: Any = LZ4FrameDecompressor()  # it has no types
        data = unpacker.decompress(data, max_length=size + 1)
    elif chunk.compression:
        raise ValueError(f"{chunk.compression!r} is no compression of MCAP")
    if len(data) != size:
        raise ValueError(f"it has {'more' if len(data) > size else 'fewer'} than the {size} bytes that it claims")
    if chunk.uncompressed_crc and zlib.crc32(data) != chunk.uncompressed_crc:
        raise ValueError("its CRC is wrong")
    return replace(chunk, compression="", data=data)


@contextmanager
def _noting(wrong: list[str], what: str) -> Generator[None]:
    """Adds errors of the reader to `wrong`."""
    try:
        yield
    except (McapError, ZstdError, struct.error, EOFError, ValueError, LookupError, MemoryError, OverflowError) as error:
        wrong.append(f"{what} is damaged: {error}".removesuffix(": "))
