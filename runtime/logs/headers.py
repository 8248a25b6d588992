"""The headers of a log's packets as arrays, block by block, so that memory does not grow with the log."""

from collections.abc import Iterable, Iterator
from typing import Any, NamedTuple, TypeAlias

import numpy as np
from numpy.typing import NDArray

BLOCK = 1 << 15  # packets
SIZE = 20
OVERHEAD = SIZE + 2  # bytes of a packet without payload

Array: TypeAlias = NDArray[Any]

HEADER = np.dtype(
    [
        ("sync", "<u2"),
        ("id", "<u2"),
        ("size", "<u2"),
        ("timestamp", "<f8"),
        ("src", "<u2"),
        ("src_ent", "u1"),
        ("dst", "<u2"),
        ("dst_ent", "u1"),
    ]
)


class Block(NamedTuple):
    """Consecutive packets: their bytes, their offsets in the unpacked log, their headers (an array of HEADER)."""

    packets: list[bytes]
    offsets: list[int]
    headers: Array


def blocks(packets: Iterable[tuple[int, bytes]], sync: int, size: int = BLOCK) -> Iterator[Block]:
    """The packets (offset, bytes), `size` at a time."""
    found: list[bytes] = []
    offsets: list[int] = []
    for offset, packet in packets:
        offsets.append(offset)
        found.append(packet)
        if len(found) == size:
            yield Block(found, offsets, headers(found, sync))
            found, offsets = [], []
    if found:
        yield Block(found, offsets, headers(found, sync))


def headers(packets: list[bytes], sync: int) -> Array:
    """The headers of packets in either byte order, an array of HEADER."""
    found = np.frombuffer(b"".join([packet[:SIZE] for packet in packets]), HEADER)
    big = found["sync"] != sync
    if big.any():
        found = found.copy()
        found[big] = found[big].view(HEADER.newbyteorder(">")).astype(HEADER)
    return found
