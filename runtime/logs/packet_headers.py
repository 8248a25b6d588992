"""The headers of a log's packets as arrays, block by block, so that memory does not grow with the log."""

from collections.abc import Iterator
from typing import Any, NamedTuple, TypeAlias

import numpy as np
from numpy.typing import NDArray

import imc
from imc.layout import HEADER_FIELDS, HEADER_SIZE, columns
from imc.lsf import Losses, ReportShare, at_each, chunks, scan

Array: TypeAlias = NDArray[Any]

HEADER = np.dtype(columns(HEADER_FIELDS))


class Block(NamedTuple):
    """Consecutive packets: their bytes, their offsets in the unpacked log, their headers (an array of HEADER)."""

    packets: list[bytes]
    offsets: list[int]
    headers: Array


def blocks(log: imc.Log, losses: list[imc.Loss], progress: ReportShare | None = None) -> Iterator[Block]:
    """All good packets of a log; the damage is in `losses` at the end. `progress` gets the share read, 0 to 1."""
    lose = Losses()
    for batch in scan(chunks(log.path, lose, progress=progress, spread=log.spread), log.schema.sync, lose):
        heads = at_each(batch.data, batch.starts, HEADER)
        if batch.big.any():
            heads[batch.big] = at_each(batch.data, batch.starts[batch.big], HEADER.newbyteorder(">")).astype(HEADER)
        data: bytes = batch.data
        cuts = zip(batch.starts.tolist(), batch.ends.tolist(), strict=True)
        yield Block([data[begin:end] for begin, end in cuts], (batch.starts + batch.base).tolist(), heads)
    losses.extend(lose.sorted())


def headers(packets: list[bytes], sync: int) -> Array:
    """The headers of packets in either byte order, an array of HEADER."""
    found = np.frombuffer(b"".join([packet[:HEADER_SIZE] for packet in packets]), HEADER)
    big = found["sync"] != sync
    if big.any():
        found = found.copy()
        found[big] = found[big].view(HEADER.newbyteorder(">")).astype(HEADER)
    return found
