"""Selects messages of a log by their headers; a sequence of messages that decodes on access."""

from collections.abc import Callable, Iterable, Iterator, Sequence
from functools import cached_property
from pathlib import Path
from typing import TYPE_CHECKING, Any, NamedTuple, TypedDict, TypeVar, overload
from weakref import finalize

from imc.lsf.index import PacketPositions
from imc.lsf.packet_reader import PacketReader
from imc.lsf.scanner import Batch
from imc.message import Message
from imc.reserved_ids import UNKNOWN_ENTITY

if TYPE_CHECKING:
    import numpy as np
    from numpy.typing import NDArray

NEAR = 64  # messages read together

T = TypeVar("T")

Decode = Callable[[bytes], Message]


class Conditions(TypedDict, total=False):
    """Conditions on the header of a message, as callers give them."""

    start: float | None
    """s since 1970 UTC, inclusive"""
    end: float | None
    """s since 1970 UTC, exclusive"""
    src: int | str | None
    """a system's id, or its name"""
    entity: int | str | None
    """an entity's id, or its label"""


class HeaderFilter(NamedTuple):
    """The same conditions in numbers. None: no condition."""

    start: float | None = None
    end: float | None = None
    sources: frozenset[int] | None = None
    entities: frozenset[tuple[int | None, int]] | None = None
    """System (None: any) and entity id."""

    @property
    def matches_all(self) -> bool:
        """Whether the filter has no conditions."""
        return self == HeaderFilter()

    def row_mask(self, rows: "NDArray[Any]") -> "NDArray[np.bool_]":
        """Mask of the rows of a structured array of messages that meet the conditions."""
        return self._mask(rows["timestamp"], rows["src"], rows["src_ent"])

    def batch_mask(self, batch: Batch) -> "NDArray[np.bool_]":
        """Mask of the packets that meet the conditions."""
        return self._mask(batch.times(), batch.header_values("src"), batch.header_values("src_ent"))

    def _mask(self, times: "NDArray[Any]", src: "NDArray[Any]", src_ent: "NDArray[Any]") -> "NDArray[np.bool_]":
        import numpy as np

        mask = np.ones(times.size, np.bool_)
        if self.start is not None:
            mask &= times >= self.start
        if self.end is not None:
            mask &= times < self.end
        if self.sources is not None:
            mask &= np.isin(src, list(self.sources))
        if self.entities is not None:
            wanted = [number for system, number in self.entities if system is None]
            pairs = [system << 8 | number for system, number in self.entities if system is not None]
            mask &= np.isin(src_ent, wanted) | np.isin(src.astype(np.uint32) << 8 | src_ent, pairs)
        return mask


class MessageSequence(Sequence[Message]):
    """Messages of a log; each is read and decoded on access. Raises OSError if the log has changed."""

    def __init__(
        self, path: Path, find: Callable[[], PacketPositions], reader: Callable[[], PacketReader], decode: Decode
    ):
        self._path = path
        self._find = find
        self._open = reader
        self._decode = decode
        self._near: tuple[int, list[bytes]] = (0, [])

    def __len__(self) -> int:
        return self._places.offsets.size

    @overload
    def __getitem__(self, index: int) -> Message: ...

    @overload
    def __getitem__(self, index: slice) -> "MessageSequence": ...

    def __getitem__(self, index: int | slice) -> "Message | MessageSequence":
        if isinstance(index, slice):
            return self.select(index)
        number = range(len(self))[index]
        first, packets = self._near
        if not 0 <= number - first < len(packets):
            near = self._places.select(slice(number, number + NEAR))
            batch = next(self._reader.batches(near))
            first, packets = self._near = number, [packet for _, packet in batch.packets()]
        return self._decode(packets[number - first])

    def __iter__(self) -> Iterator[Message]:
        places = self._places
        with self._open() as reader:
            for batch in reader.batches(places):
                for _, packet in batch.packets():
                    yield self._decode(packet)

    def __repr__(self) -> str:
        return f"<messages of {str(self._path)!r}>"

    def select(self, chosen: Any) -> "MessageSequence":
        """The messages chosen by a slice, an array of indices or a mask (of the rows of `Log.array`)."""
        return MessageSequence(self._path, lambda: self._places.select(chosen), self._open, self._decode)

    @cached_property
    def _reader(self) -> PacketReader:
        reader = self._open()
        finalize(self, reader.__exit__)
        return reader

    @cached_property
    def _places(self) -> PacketPositions:
        return self._find()


def select(places: PacketPositions, where: HeaderFilter, reader: PacketReader) -> PacketPositions:
    """The packets that meet the conditions."""
    import numpy as np

    if where.matches_all or not places.offsets.size:
        return places
    return places.select(np.concatenate([where.batch_mask(batch) for batch in reader.batches(places)]))


def keys_with_name(names: dict[T, str], name: str) -> list[T]:
    """The keys with this name. Raises KeyError if there are none."""
    found = [key for key, value in names.items() if value == name]
    if not found:
        raise KeyError(name)
    return found


def entity_labels(messages: Iterable[Message]) -> Iterator[tuple[tuple[int, int], str]]:
    """System and entity id, and label, of each entity in EntityInfo and EntityList messages."""
    for message in messages:
        label = getattr(message, "label", None)
        if isinstance(label, str):
            if message.src_ent != UNKNOWN_ENTITY:
                yield (message.src, message.src_ent), label
        elif getattr(message, "op", None) == 0:
            for part in str(getattr(message, "list", "")).split(";"):
                label, equals, number = part.rpartition("=")
                if equals and number.isascii() and number.isdecimal() and int(number) < UNKNOWN_ENTITY:
                    yield (message.src, int(number)), label
