"""Makes a log again of an MCAP file that holds its packets."""

from collections.abc import Iterator
from pathlib import Path
from typing import IO

from mcap.exceptions import McapError
from mcap.reader import make_reader
from mcap.records import Attachment, Channel, Chunk, Message
from mcap.stream_reader import StreamReader, breakup_chunk

from imc.lsf import LsfWriter
from runtime.logs.mcap import BESIDE, LARGEST_BESIDE, PACKETS, PACKETS_TOPIC

TOPIC = "/" + "/".join(PACKETS_TOPIC)
LARGEST_CHUNK = 1 << 28


class BadFile(ValueError):
    """A file that cannot be imported; the text says which and why."""


def import_mcap(path: Path, folder: Path) -> str:
    """Write the packets of an MCAP file to Data.lsf.gz in `folder`, byte for byte, and what it has of IMC.xml.gz,
    IMC.xml and Config.ini beside it; returns what is wrong with the file, "" if nothing is.

    Of a file that ends early, all complete chunks are read. Raises BadFile where it holds no packets, OSError.
    """
    wrong, count = "", 0
    with path.open("rb") as file:
        writer = LsfWriter(folder / "Data.lsf.gz")
        try:
            for item in _items(file):
                if isinstance(item, Attachment):
                    if item.name in BESIDE and len(item.data) <= LARGEST_BESIDE:
                        (folder / item.name).write_bytes(item.data)
                    continue
                writer.write(_packets(item.data))
                count += 1
        except (McapError, EOFError, ValueError, KeyError) as error:
            wrong = f"{path}: damaged: {error or type(error).__name__}"
        finally:
            writer.close()
    if not count:
        raise BadFile(wrong or f"{path}: there are no IMC packets in it (topic {TOPIC}, type {PACKETS.full_name})")
    return wrong


def _items(file: IO[bytes]) -> Iterator[Attachment | Message]:
    """Attachments and messages with packets, in the order of the file."""
    reader = make_reader(file, validate_crcs=True)
    try:
        summary = reader.get_summary()
    except (McapError, ValueError):
        summary = None
    if summary is None or not summary.chunk_indexes:
        file.seek(0)
        yield from _salvaged(file)
        return
    yield from reader.iter_attachments()
    numbers = {channel.id for channel in summary.channels.values() if channel.topic == TOPIC}
    for index in summary.chunk_indexes:
        if numbers & index.message_index_offsets.keys():
            _check(index.uncompressed_size)
    for _, _, message in reader.iter_messages(topics=[TOPIC], log_time_order=False):
        yield message


def _salvaged(file: IO[bytes]) -> Iterator[Attachment | Message]:
    """The same of a file without its end."""
    numbers: set[int] = set()
    for record in StreamReader(file, emit_chunks=True, record_size_limit=LARGEST_CHUNK).records:
        if isinstance(record, Channel) and record.topic == TOPIC:
            numbers.add(record.id)
        elif isinstance(record, Attachment):
            yield record
        elif isinstance(record, Chunk):
            _check(record.uncompressed_size)
            for inner in breakup_chunk(record, validate_crc=True):
                if isinstance(inner, Message) and inner.channel_id in numbers:
                    yield inner


def _check(size: int) -> None:
    if size > LARGEST_CHUNK:
        raise ValueError(f"a chunk of {size} bytes; {LARGEST_CHUNK} at most")


def _packets(body: bytes) -> bytes:
    size = int.from_bytes(body[4:8], "little")
    if len(body) != 8 + size:
        raise ValueError(f"a message on {TOPIC} has {len(body)} bytes and says {8 + size}")
    return body[8:]
