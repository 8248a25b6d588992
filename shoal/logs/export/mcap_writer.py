"""Writes MCAP files chunk by chunk, with the records of the `mcap` package and messages in whole blocks."""

import struct
import zlib
from collections import Counter
from typing import IO, NamedTuple

import numpy as np
import zstandard
from mcap import records
from mcap.data_stream import RecordBuilder
from mcap.opcode import Opcode
from mcap.writer import MCAP0_MAGIC

from runtime.logs import Array

MESSAGE: tuple[tuple[str, str], ...] = (
    ("opcode", "B"),
    ("length", "q"),
    ("channel", "H"),
    ("sequence", "I"),
    ("log_time", "q"),
    ("publish_time", "q"),
)
"""Header before the data of a message; `length` counts the bytes after itself."""
MESSAGE_HEAD = struct.Struct("<" + "".join(code for _, code in MESSAGE))
MESSAGE_LENGTH = MESSAGE_HEAD.size - 9  # without the data
LEVEL = 1
_INDEX = np.dtype([("time", "<u8"), ("offset", "<u8")])


class MessageIndex(NamedTuple):
    """Messages in a chunk: for each its channel, log time (ns) and offset in the chunk."""

    channels: Array
    times: Array
    offsets: Array


class McapChunk:
    """Messages that are compressed together."""

    def __init__(self) -> None:
        self.size: int = 0
        self._parts: list[bytes] = []
        self._places: list[MessageIndex] = []
        self._single: list[tuple[int, int, int]] = []

    def add_block(self, data: bytes, size: int, channels: Array, times: Array) -> None:
        """Add complete message records of `size` bytes each."""
        offsets = np.arange(len(channels), dtype=np.int64) * size + self.size
        self._places.append(MessageIndex(channels, times, offsets))
        self._append(data)

    def add(self, channel: int, sequence: int, time: int, data: bytes | bytearray) -> None:
        """Add one message; time in ns since 1970 UTC."""
        self._single.append((channel, time, self.size))
        length = MESSAGE_LENGTH + len(data)
        self._append(MESSAGE_HEAD.pack(Opcode.MESSAGE, length, channel, sequence, time, time) + data)

    def records_and_index(self) -> tuple[bytes, MessageIndex]:
        """All records, and their index, sorted by channel and time."""
        single = np.array(self._single, np.int64).reshape(-1, 3).T
        places = [*self._places, MessageIndex(*single)]
        channels, times, offsets = (np.concatenate(columns) for columns in zip(*places, strict=True))
        order = np.lexsort((times, channels))
        return b"".join(self._parts), MessageIndex(channels[order], times[order], offsets[order])

    def _append(self, data: bytes) -> None:
        self._parts.append(data)
        self.size += len(data)


class McapWriter:
    """An MCAP file being written to an open binary file, which stays open. Raises OSError."""

    def __init__(self, file: IO[bytes], profile: str, library: str):
        self._file = file
        self._place = 0
        self._schemas: list[records.Schema] = []
        self._channels: list[records.Channel] = []
        self._chunks: list[records.ChunkIndex] = []
        self._attachments: list[records.AttachmentIndex] = []
        self._metadata: list[records.MetadataIndex] = []
        self._counts: Counter[int] = Counter()
        self._times: list[tuple[int, int]] = []
        self._packer = zstandard.ZstdCompressor(level=LEVEL)
        self._write(MCAP0_MAGIC)
        self._record(records.Header(profile, library))

    @property
    def message_count(self) -> int:
        """The number of messages."""
        return self._counts.total()

    def add_schema(self, name: str, definition: str) -> int:
        """A ROS 2 message type; returns its number."""
        number = len(self._schemas) + 1
        self._schemas.append(records.Schema(number, definition.encode(), "ros2msg", name))
        self._record(self._schemas[-1])
        return number

    def add_channel(self, topic: str, schema: int, metadata: dict[str, str]) -> int:
        """A topic with messages of a type; returns its number."""
        number = len(self._channels) + 1
        self._channels.append(records.Channel(number, topic, "cdr", metadata, schema))
        self._record(self._channels[-1])
        return number

    def add_attachment(self, name: str, media_type: str, time: int, data: bytes) -> None:
        offset, length = self._record(records.Attachment(time, time, name, media_type, data))
        self._attachments.append(records.AttachmentIndex(offset, length, time, time, len(data), name, media_type))

    def add_metadata(self, name: str, values: dict[str, str]) -> None:
        offset, length = self._record(records.Metadata(name, values))
        self._metadata.append(records.MetadataIndex(offset, length, name))

    def add_chunk(self, chunk: McapChunk) -> None:
        """Compress and write the messages of a chunk; one without messages is skipped."""
        data, place = chunk.records_and_index()
        if not len(place.channels):
            return
        first, last = int(place.times.min()), int(place.times.max())
        packed = self._packer.compress(data)
        offset, length = self._record(records.Chunk("zstd", packed, last, first, zlib.crc32(data), len(data)))
        indexed = self._place
        offsets: dict[int, int] = {}
        channels, begins = np.unique(place.channels, return_index=True)
        ends = [*begins[1:].tolist(), len(place.channels)]
        for channel, begin, end in zip(channels.tolist(), begins.tolist(), ends, strict=True):
            offsets[channel] = self._place
            self._counts[channel] += end - begin
            entries = np.empty(end - begin, _INDEX)
            entries["time"], entries["offset"] = place.times[begin:end], place.offsets[begin:end]
            size = entries.nbytes
            self._write(struct.pack("<BQHI", Opcode.MESSAGE_INDEX, size + 6, channel, size) + entries.tobytes())
        self._times.append((first, last))
        self._chunks.append(
            records.ChunkIndex(
                chunk_length=length,
                chunk_start_offset=offset,
                compression="zstd",
                compressed_size=len(packed),
                message_end_time=last,
                message_index_length=self._place - indexed,
                message_index_offsets=offsets,
                message_start_time=first,
                uncompressed_size=len(data),
            )
        )

    def finish(self) -> None:
        """Write the summary, with which readers find everything; nothing can be added afterward."""
        self._record(records.DataEnd(0))
        start, summary = self._place, RecordBuilder()
        groups: list[records.SummaryOffset] = []
        for opcode, group in (
            (Opcode.SCHEMA, self._schemas),
            (Opcode.CHANNEL, self._channels),
            (Opcode.STATISTICS, [self._statistics()]),
            (Opcode.CHUNK_INDEX, self._chunks),
            (Opcode.ATTACHMENT_INDEX, self._attachments),
            (Opcode.METADATA_INDEX, self._metadata),
        ):
            begin = summary.count
            for record in group:
                record.write(summary)
            if group:
                groups.append(records.SummaryOffset(opcode, start + begin, summary.count - begin))
        offsets_start = start + summary.count
        for record in groups:
            record.write(summary)
        data = summary.end()
        # The CRC of the summary also covers the footer, up to the CRC itself.
        footer = struct.pack("<BQQQ", Opcode.FOOTER, 20, start, offsets_start)
        self._write(data)
        self._record(records.Footer(start, offsets_start, zlib.crc32(footer, zlib.crc32(data))))
        self._write(MCAP0_MAGIC)
        self._file.flush()

    def _statistics(self) -> records.Statistics:
        return records.Statistics(
            attachment_count=len(self._attachments),
            channel_count=len(self._channels),
            channel_message_counts=dict(self._counts),
            chunk_count=len(self._chunks),
            message_count=self.message_count,
            message_end_time=max((last for _, last in self._times), default=0),
            message_start_time=min((first for first, _ in self._times), default=0),
            metadata_count=len(self._metadata),
            schema_count=len(self._schemas),
        )

    def _record(self, record: records.McapRecord) -> tuple[int, int]:
        builder, place = RecordBuilder(), self._place
        record.write(builder)
        self._write(builder.end())
        return place, self._place - place

    def _write(self, data: bytes) -> None:
        self._file.write(data)
        self._place += len(data)
