"""The headers of a log's packets as arrays, block by block, so that memory does not grow with the log."""

from collections.abc import Iterator
from typing import Any, NamedTuple, TypeAlias

import numpy as np
from numpy.typing import NDArray

import imc
from imc.layout import HEADER_FIELDS, HEADER_SIZE, numpy_columns
from imc.lsf import DamageList, ReportProgress, read_at_offsets, scan, unpacked_chunks

Array: TypeAlias = NDArray[Any]

HEADER = np.dtype(numpy_columns(HEADER_FIELDS))


class PacketBlock(NamedTuple):
    """Consecutive packets: their bytes, their offsets in the unpacked log, their headers (an array of HEADER)."""

    packets: list[bytes]
    offsets: list[int]
    headers: Array


def packet_blocks(
    log: imc.Log, losses: list[imc.Loss], progress: ReportProgress | None = None
) -> Iterator[PacketBlock]:
    """All good packets of a log; the damage is in `losses` at the end. `progress` gets the share read, 0 to 1."""
    lose = DamageList()
    for batch in scan(unpacked_chunks(log.path, lose, progress=progress, spread=log.spread), log.schema.sync, lose):
        heads = read_at_offsets(batch.data, batch.starts, HEADER)
        if batch.big.any():
            heads[batch.big] = read_at_offsets(batch.data, batch.starts[batch.big], HEADER.newbyteorder(">")).astype(
                HEADER
            )
        data: bytes = batch.data
        cuts = zip(batch.starts.tolist(), batch.ends.tolist(), strict=True)
        yield PacketBlock([data[begin:end] for begin, end in cuts], (batch.starts + batch.base).tolist(), heads)
    losses.extend(lose.sorted())


def packet_headers(packets: list[bytes], sync: int) -> Array:
    """The headers of packets in either byte order, an array of HEADER."""
    found = np.frombuffer(b"".join([packet[:HEADER_SIZE] for packet in packets]), HEADER)
    big = found["sync"] != sync
    if big.any():
        found = found.copy()
        found[big] = found[big].view(HEADER.newbyteorder(">")).astype(HEADER)
    return found
