"""Finds the packets in the bytes of a log, many at a time, even in a damaged log."""

from collections.abc import Callable, Iterable, Iterator
from itertools import chain, repeat
from typing import TYPE_CHECKING, Any, NamedTuple

from fastcrc.crc16 import arc

from imc.layout import ADDRESS_FIELDS, NUMPY, OFFSETS, SMALLEST_PACKET
from imc.lsf.batch_crc_check import valid_crcs

if TYPE_CHECKING:
    import numpy as np
    from numpy.typing import NDArray

PIECE = 1 << 19  # small enough for a processor's cache
GROUP = 16  # packets whose CRCs are checked together
# Costs in units of the time that `valid_crcs` takes for one byte:
COST_OF_ONE = 32  # units that one call of `arc` takes
COST_OF_PREFIXES = 128  # bytes that `arc` checks in one unit
NO_SYNC, BAD_CRC, CUT = "no packet begins here", "wrong CRC", "packet cut short"
_FAR = 1 << 62  # end of a candidate whose size lies beyond the bytes read so far

Lose = Callable[[int, int, str], None]
"""Called with offset, length and reason of bytes that are not a packet."""


class Batch(NamedTuple):
    """Packets in one piece of a log; all arrays have one element per packet, in the order of the log."""

    base: int
    """Offset of `data` in the log."""
    data: Any
    """A buffer."""
    starts: "NDArray[np.int64]"
    """Offsets of the packets in `data`."""
    ends: "NDArray[np.int64]"
    heads: "NDArray[np.uint32]"
    """Message id, and size of the payload in the upper 16 bits."""
    big: "NDArray[np.bool_]"
    """Whether the packet is big endian."""
    rows: "NDArray[np.uint8] | None" = None
    """The packets again, if at hand: little endian, all of the same size; shape (n, size)."""

    def packets(self) -> Iterator[tuple[int, bytes]]:
        """Offset in the log, and bytes, of each packet."""
        starts, data = self.starts.tolist(), bytes(self.data)
        cuts = map(slice, starts, self.ends.tolist())
        return zip(map(self.base.__add__, starts), map(data.__getitem__, cuts), strict=True)

    def select(self, mask: "NDArray[np.bool_]") -> "Batch":
        """The packets for which `mask` is true."""
        arrays = self.starts[mask], self.ends[mask], self.heads[mask], self.big[mask]
        return Batch(self.base, self.data, *arrays)

    def times(self) -> "NDArray[np.float64]":
        """Timestamps, in s since 1970 UTC."""
        return self.header_values("timestamp")

    def header_values(self, name: str) -> "NDArray[Any]":
        """A field of each packet's header (a name of `imc.layout.ADDRESS_FIELDS`)."""
        offset, kind = OFFSETS[name], NUMPY[ADDRESS_FIELDS[name]]
        found = read_at_offsets(self.data, self.starts + offset, "<" + kind)
        if self.big.any():
            found[self.big] = read_at_offsets(self.data, self.starts[self.big] + offset, ">" + kind)
        return found


def read_at_offsets(data: Any, offsets: "NDArray[np.int64]", dtype: Any) -> "NDArray[Any]":
    """The values at the offsets in a buffer, as an array of `dtype`. Raises IndexError beyond its end."""
    import numpy as np

    kind = np.dtype(dtype)
    count = len(data) - kind.itemsize + 1
    if count <= 0 or not kind.itemsize:
        if offsets.size and kind.itemsize:
            raise IndexError(f"{kind.itemsize} bytes at {offsets[0]} of {len(data)}")
        return np.empty(offsets.size, kind)
    # A view with one element per byte: the elements overlap, so that they may begin at any offset.
    return np.ndarray((count,), kind, data, 0, (1,))[offsets]


def scan(chunks: Iterable[bytes], sync: int, lose: Lose, crc: bool = True) -> Iterator[Batch]:
    """The packets in the bytes of a log, in order; calls `lose` for the bytes between them.

    A packet is accepted if its CRC is right. The search then continues after it, otherwise one byte later. With
    crc=False, a packet is also accepted if another one or the end of the log follows it immediately.
    """
    data, base = b"", 0
    clean, reason = 0, ""
    for chunk, last in _marking_last(_in_pieces(chunks)):
        data = data + chunk if data else chunk
        batch, stop = _find(data, base, sync, last, crc)
        if batch.starts.size:
            for gap, end in _gaps(batch, clean):
                lose(gap, end - gap, reason or no_packet_reason(data, gap - base, sync))
                reason = ""
            clean = base + int(batch.ends[-1])
            yield batch
        if base + stop > clean:
            reason = reason or no_packet_reason(data, clean - base, sync)
        data, base = data[stop:], base + stop
    if base > clean:
        lose(clean, base - clean, reason)


def no_packet_reason(data: bytes, pos: int, sync: int) -> str:
    """Reason why no packet begins at `pos`."""
    little, big = sync.to_bytes(2, "little"), sync.to_bytes(2, "big")
    begin = data[pos : pos + 2]
    if not (little.startswith(begin) or big.startswith(begin)):
        return NO_SYNC
    size = data[pos + 4 : pos + 6]
    end = pos + SMALLEST_PACKET + int.from_bytes(size, "little" if begin == little else "big")
    return CUT if len(size) < 2 or end > len(data) else BAD_CRC


def _find(data: bytes, base: int, sync: int, last: bool, crc: bool) -> tuple[Batch, int]:
    """The packets in `data`, and where to continue the search when more data has come."""
    import numpy as np

    starts, big = _candidates(data, sync)
    heads = _heads(data, starts, big)
    ends = starts + SMALLEST_PACKET + (heads >> 16)
    ends[starts + 6 > len(data)] = _FAR
    good = np.empty(starts.size, np.bool_)
    if starts.size:
        good[:-1] = ends[:-1] == starts[1:]
        good[-1] = last and ends[-1] == len(data)
    # `good`: candidates that end exactly where the next one begins. These are almost surely packets, with no candidate
    # inside them, so their CRCs are checked in groups below. The others are checked alone, in order: each may be
    # garbage, a packet before garbage, or a packet whose payload looks like another; a right CRC rejects all
    # candidates inside the packet.
    stop, begin = len(data), 0
    kept = good.copy()
    alone, checked = _without_most_wrong(data, np.flatnonzero(~good), starts, ends, big)
    for index in alone.tolist():
        start, end = int(starts[index]), int(ends[index])
        if start < begin:
            continue
        if end > len(data):
            if last:
                continue
            stop = start
            kept[index:] = False
            break
        if checked or has_valid_crc(data[start:end], bool(big[index])):
            kept[index] = True
            kept[index + 1 : np.searchsorted(starts, end)] = False
            begin = end
    if crc and (chosen := np.flatnonzero(kept & good)).size:
        kept[chosen] = _crcs_right(data, chosen, starts, ends, big)
    batch = Batch(base, data, starts, ends, heads, big)
    batch = batch if kept.all() else batch.select(kept)
    if not last and stop == len(data) and data and data[-1] in sync.to_bytes(2, "little"):
        stop = max(stop - 1, int(batch.ends[-1]) if batch.ends.size else 0)
    return batch, stop


def _candidates(data: bytes, sync: int) -> tuple["NDArray[np.int64]", "NDArray[np.bool_]"]:
    """Offsets of the synchronization number in either byte order, and whether it is the big-endian one."""
    import numpy as np

    octets = np.frombuffer(data, np.uint8)
    first, second = sync & 0xFF, sync >> 8
    places = np.flatnonzero(octets == second)
    little = places[octets[places - 1] == first] - 1
    if little.size and little[0] < 0:
        little = little[1:]
    behind = places + 1
    if behind.size and behind[-1] == octets.size:
        behind = behind[:-1]
    big = behind[octets[behind] == first] - 1 if first != second else behind[:0]
    if not big.size:
        return little, np.zeros(little.size, np.bool_)
    starts = np.concatenate((little, big))
    order = np.argsort(starts, kind="stable")
    return starts[order], order >= little.size


def _heads(data: bytes, starts: "NDArray[np.int64]", big: "NDArray[np.bool_]") -> "NDArray[np.uint32]":
    """Id and size of each candidate; zero if `data` ends within them."""
    import numpy as np

    whole = int(np.searchsorted(starts, len(data) - 5))
    heads = np.zeros(starts.size, np.uint32)
    heads[:whole] = read_at_offsets(data, starts[:whole] + 2, "<u4")
    if big.any():
        swapped = heads[big]
        heads[big] = (swapped & 0x00FF00FF) << 8 | swapped >> 8 & 0x00FF00FF
    return heads


def _without_most_wrong(
    data: bytes,
    alone: "NDArray[np.int64]",
    starts: "NDArray[np.int64]",
    ends: "NDArray[np.int64]",
    big: "NDArray[np.bool_]",
) -> tuple["NDArray[np.int64]", bool]:
    """The candidates to check alone, and whether those that end in `data` are known to have right CRCs."""
    # Candidates may overlap, as in data full of synchronization numbers with large sizes. Checking each would then
    # take quadratic time; `valid_crcs` takes the same time however many there are.
    wrong = ends[alone] <= len(data)
    chosen = alone[wrong]
    parts = starts[chosen], ends[chosen]
    if chosen.size * COST_OF_ONE + int((parts[1] - parts[0]).sum()) // COST_OF_PREFIXES <= len(data):
        return alone, False
    wrong[wrong] = ~valid_crcs(data, *parts, big[chosen])
    return alone[~wrong], True


def has_valid_crc(packet: bytes, big: bool) -> bool:
    return not arc(packet[:-2] + packet[:-3:-1] if big else packet)


def _crcs_right(
    data: bytes,
    chosen: "NDArray[np.int64]",
    starts: "NDArray[np.int64]",
    ends: "NDArray[np.int64]",
    big: "NDArray[np.bool_]",
) -> "NDArray[np.bool_]":
    """Whether the CRCs of the chosen packets, which do not overlap, are right."""
    import numpy as np

    # CRC-16/ARC over data and its own CRC, low byte first, is zero, and so is that over several such packets in a row.
    # One call for a group saves most of the calls; only a group with another result is checked packet by packet (it
    # has damage, or a big-endian packet). The damage of several packets may cancel in 1 of 65536 cases, no more often
    # than a CRC misses the damage of one packet.
    new = np.arange(chosen.size) % GROUP == 0
    new[1:] |= np.diff(chosen) != 1
    firsts = np.flatnonzero(new)
    lasts = np.append(firsts[1:], chosen.size) - 1
    right = np.ones(chosen.size, np.bool_)
    for group in np.flatnonzero(_remainders(data, starts[chosen[firsts]], ends[chosen[lasts]])).tolist():
        for index in range(firsts[group], lasts[group] + 1):
            number = chosen[index]
            packet = data[starts[number] : ends[number]]
            right[index] = has_valid_crc(packet, bool(big[number]))
    return right


def _remainders(data: bytes, starts: "NDArray[np.int64]", ends: "NDArray[np.int64]") -> "NDArray[np.uint16]":
    import numpy as np

    cuts = map(slice, starts.tolist(), ends.tolist())
    return np.fromiter(map(arc, map(data.__getitem__, cuts)), np.uint16, starts.size)


def _gaps(batch: Batch, clean: int) -> list[tuple[int, int]]:
    """Start and end, in the log, of the gaps between packets; the packet before the batch ended at `clean`."""
    import numpy as np

    starts = batch.starts + batch.base
    befores = np.empty_like(starts)
    befores[0] = clean
    befores[1:] = batch.ends[:-1] + batch.base
    apart = np.flatnonzero(starts != befores)
    return list(zip(befores[apart].tolist(), starts[apart].tolist(), strict=True))


def _in_pieces(chunks: Iterable[bytes]) -> Iterator[bytes]:
    """The same bytes in pieces of PIECE, the last one shorter."""
    waiting: list[bytes] = []
    size = 0
    for chunk in chunks:
        for begin in range(0, len(chunk), PIECE):
            part = chunk[begin : begin + PIECE]
            waiting.append(part)
            size += len(part)
            if size >= PIECE:
                yield waiting[0] if len(waiting) == 1 else b"".join(waiting)
                waiting, size = [], 0
    if size:
        yield b"".join(waiting)


def _marking_last(chunks: Iterable[bytes]) -> Iterator[tuple[bytes, bool]]:
    return chain(zip(chunks, repeat(False)), [(b"", True)])
