"""Restores a log from an MCAP file that has its packets."""

import struct
from collections.abc import Generator, Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import IO

from mcap.data_stream import ReadDataStream
from mcap.exceptions import McapError
from mcap.reader import make_reader
from mcap.records import Attachment, Channel, Chunk, McapRecord, Message
from mcap.stream_reader import StreamReader, breakup_chunk
from zstandard import ZstdError

from imc.lsf import LsfWriter
from shoal.logs.export.mcap import BESIDE, LARGEST_BESIDE, PACKETS, PACKETS_TOPIC

TOPIC = "/" + "/".join(PACKETS_TOPIC)
LARGEST_CHUNK = 1 << 28
RECORD_HEAD = 9


class BadMcapFile(ValueError):
    """A file that cannot be imported; the text says which and why."""


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
    with path.open("rb") as file:
        writer = LsfWriter(folder / "Data.lsf.gz")
        try:
            for data in _attached(file, wrong):
                if data.name in BESIDE and len(data.data) <= LARGEST_BESIDE:
                    (folder / data.name).write_bytes(data.data)
            for chunk, numbers in _chunks(file, wrong):
                for packets in _packets(chunk, numbers, wrong):
                    writer.write(packets)
                    count += 1
        finally:
            writer.close()
    if not count:
        why = f"; {wrong[0]}" if wrong else ""
        raise BadMcapFile(f"{path}: there are no IMC packets in it (topic {TOPIC}, type {PACKETS.full_name}){why}")
    return [f"{path}: {text}" for text in dict.fromkeys(wrong)]


def expected_packets(path: Path) -> int:
    """How many packets a file says that it has; 0 if its end, which says so, is missing. Raises OSError."""
    with path.open("rb") as file, _noting([], "its end"):
        summary = make_reader(file).get_summary()
        if summary is not None and summary.statistics is not None:
            counts = summary.statistics.channel_message_counts
            return sum(counts.get(channel.id, 0) for channel in summary.channels.values() if channel.topic == TOPIC)
    return 0


def _attached(file: IO[bytes], wrong: list[str]) -> Iterator[Attachment]:
    with _noting(wrong, "its list of attachments"):
        yield from make_reader(file).iter_attachments()


def _chunks(file: IO[bytes], wrong: list[str]) -> Iterator[tuple[Chunk, set[int]]]:
    """The chunks that may have packets, in file order, each with the numbers of the channels of packets."""
    summary = None
    with _noting(wrong, "its end"):
        file.seek(0)
        summary = make_reader(file).get_summary()
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
        for record in _Records(file, emit_chunks=True, record_size_limit=LARGEST_CHUNK).records:
            if isinstance(record, Channel) and record.topic == TOPIC:
                numbers.add(record.id)
            elif isinstance(record, Chunk):
                yield record, numbers


def _packets(chunk: Chunk, numbers: set[int], wrong: list[str]) -> Iterator[bytes]:
    if chunk.uncompressed_size > LARGEST_CHUNK:
        wrong.append(f"damaged: a chunk of {chunk.uncompressed_size} bytes; the limit is {LARGEST_CHUNK}")
        return
    with _noting(wrong, "a chunk"):
        for record in breakup_chunk(chunk, validate_crc=True):
            if isinstance(record, Message) and record.channel_id in numbers:
                size = int.from_bytes(record.data[4:8], "little")
                if len(record.data) != 8 + size:
                    raise ValueError(f"a message of {len(record.data)} bytes in place of {8 + size}")
                yield record.data[8:]


@contextmanager
def _noting(wrong: list[str], what: str) -> Generator[None]:
    """Adds errors of the reader to `wrong`."""
    try:
        yield
    except (McapError, ZstdError, struct.error, EOFError, ValueError, LookupError, MemoryError, OverflowError) as error:
        wrong.append(f"{what} is damaged: {error}".removesuffix(": "))
