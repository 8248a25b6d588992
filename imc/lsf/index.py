"""Positions of the packets of a log, by type; small enough to keep in memory and beside the log."""

from collections.abc import Iterable, Iterator
from itertools import chain, pairwise
from typing import TYPE_CHECKING, Any, NamedTuple

from imc.layout import SMALLEST_PACKET
from imc.lsf.byte_reader import Members
from imc.lsf.scanner import Batch
from imc.stream import Loss

if TYPE_CHECKING:
    import numpy as np
    from numpy.typing import NDArray

TOGETHER = 1 << 16  # packets sorted by type in one step


class PacketPositions(NamedTuple):
    """Packets of a log, one element for each, in the order of the log."""

    offsets: "NDArray[np.int64]"
    heads: "NDArray[np.uint32]"
    """Message id, and size of the payload in the upper 16 bits."""
    big: "NDArray[np.bool_]"

    @property
    def ends(self) -> "NDArray[np.int64]":
        """Offsets of the ends of the packets in the log."""
        return self.offsets + (self.heads >> 16) + SMALLEST_PACKET

    def select(self, chosen: Any) -> "PacketPositions":
        """The packets chosen by a mask, a slice or an array of indices."""
        return PacketPositions(self.offsets[chosen], self.heads[chosen], self.big[chosen])


class TypeIndex(NamedTuple):
    """The packets of one message id. An array of one element stands for that value everywhere."""

    total: int
    steps: "NDArray[np.unsignedinteger[Any]]"
    """Bytes from the start of the previous packet of this id to the start of each; first, from the start of the log."""
    sizes: "NDArray[np.uint16]"
    big: "NDArray[np.uint8]"


class LogIndex(NamedTuple):
    """All good packets of a log, and its damage."""

    types: dict[int, TypeIndex]
    losses: list[Loss]
    members: Members
    crc: bool
    """Whether all CRCs have been checked."""
    length: int
    """Unpacked bytes of the log."""

    def counts(self) -> dict[int, int]:
        """Number of packets of each id, by id."""
        return {number: self.types[number].total for number in sorted(self.types)}

    def packet_positions(self, ids: Iterable[int] = ()) -> PacketPositions:
        """The packets with these ids; all packets if no ids are given."""
        import numpy as np

        chosen = set(ids) or set(self.types)
        found = [_places(number, self.types[number]) for number in sorted(chosen & set(self.types))]
        if len(found) == 1:
            return found[0]
        if not found:
            return PacketPositions(np.empty(0, np.int64), np.empty(0, np.uint32), np.empty(0, np.bool_))
        offsets, heads, bigs = zip(*found, strict=True)
        places = PacketPositions(np.concatenate(offsets), np.concatenate(heads), np.concatenate(bigs))
        return places.select(np.argsort(places.offsets, kind="stable"))


def build_index(batches: Iterable[Batch]) -> dict[int, TypeIndex]:
    """Index the offsets of the packets, by id."""
    import numpy as np

    steps: dict[int, list[NDArray[Any]]] = {}
    sizes: dict[int, list[NDArray[np.uint16]]] = {}
    bigs: dict[int, list[NDArray[np.uint8]]] = {}
    lasts: dict[int, int] = {}
    for places in _joined(batches):
        ids = places.heads.astype(np.uint16)
        order = np.argsort(ids, kind="stable")
        sorted_ids, sorted_places = ids[order], places.select(order)
        begins = np.flatnonzero(sorted_ids[1:] != sorted_ids[:-1]) + 1
        all_sizes, all_bigs = (sorted_places.heads >> 16).astype(np.uint16), sorted_places.big.view(np.uint8)
        for begin, end in pairwise([0, *begins.tolist(), ids.size]):
            number = int(sorted_ids[begin])
            offsets = sorted_places.offsets[begin:end]
            step = np.diff(offsets, prepend=lasts.get(number, 0))
            lasts[number] = int(offsets[-1])
            # | 0x100: at least two bytes, as the index file requires
            steps.setdefault(number, []).append(step.astype(np.min_scalar_type(int(step.max()) | 0x100)))
            sizes.setdefault(number, []).append(all_sizes[begin:end])
            bigs.setdefault(number, []).append(all_bigs[begin:end])
    types: dict[int, TypeIndex] = {}
    for number in list(steps):
        joined = np.concatenate(steps.pop(number))
        size, big = np.concatenate(sizes.pop(number)), np.concatenate(bigs.pop(number))
        types[number] = TypeIndex(joined.size, joined, _shortened(size), _shortened(big))
    return types


def _joined(batches: Iterable[Batch]) -> Iterator[PacketPositions]:
    """Offsets of the packets of the batches, several batches at a time."""
    import numpy as np

    waiting: list[PacketPositions] = []
    for batch in chain(batches, [None]):
        if batch is not None:
            waiting.append(PacketPositions(batch.starts + batch.base, batch.heads, batch.big))
        if waiting and (batch is None or sum(places.offsets.size for places in waiting) >= TOGETHER):
            offsets, heads, bigs = zip(*waiting, strict=True)
            yield PacketPositions(np.concatenate(offsets), np.concatenate(heads), np.concatenate(bigs))
            waiting = []


def _shortened(values: "NDArray[Any]") -> "NDArray[Any]":
    return values[:1].copy() if (values == values[0]).all() else values


def _places(number: int, found: TypeIndex) -> PacketPositions:
    import numpy as np

    offsets = np.cumsum(found.steps, dtype=np.int64)
    heads = (found.sizes.astype(np.uint32) << 16 | number).astype(np.uint32, copy=False)
    big = found.big.astype(np.bool_)
    return PacketPositions(offsets, np.broadcast_to(heads, offsets.shape), np.broadcast_to(big, offsets.shape))
