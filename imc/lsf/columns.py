"""Messages of one type as a NumPy structured array: a row per message, a column per number."""

import struct
from collections.abc import Callable, Sequence
from typing import TYPE_CHECKING, Any

from imc.errors import DecodeError
from imc.layout import ADDRESS_FIELDS, FOOTER_SIZE, NUMPY, OFFSETS, SMALLEST_PACKET, VARIABLE, numpy_columns
from imc.lsf.index import PacketPositions
from imc.lsf.packet_reader import PacketReader
from imc.lsf.scanner import Batch, Lose, read_at_offsets
from imc.message import Message
from imc.schema import MessageType

if TYPE_CHECKING:
    import numpy as np
    from numpy.typing import NDArray

_ROW_BEGINS = OFFSETS["timestamp"]

Decode = Callable[[bytes], Message]


def dtype_of(kind: MessageType, order: str = "<") -> "np.dtype[Any]":
    """The type of a row: header, then all fields that are numbers, without padding."""
    import numpy as np

    numbers = {f.attribute: code for f, code in zip(kind.fields, kind.wire_codes, strict=True) if code in NUMPY}
    return np.dtype(numpy_columns({**ADDRESS_FIELDS, **numbers}, order))


def smallest_payload(kind: MessageType) -> int:
    """Bytes in the smallest payload of this type."""
    return sum(2 if code in VARIABLE else struct.calcsize("<" + code) for code in kind.wire_codes)


def without_short_packets(kind: MessageType, places: PacketPositions, lose: Lose) -> PacketPositions:
    """The packets whose payloads are not too short for the type; calls `lose` for the others."""
    import numpy as np

    sizes = places.heads >> 16
    fits = sizes >= smallest_payload(kind)
    if fits.all():
        return places
    for index in np.flatnonzero(~fits).tolist():
        _lose_short(kind, int(places.offsets[index]), int(sizes[index]), lose)
    return places.select(fits)


class ColumnReader:
    """Reads messages of one type into rows of `dtype_of(kind)`, one per packet.

    Short packets must be left out, see `without_short_packets`. `whole` marks the rows that are whole messages; `lose`
    is called for the others.
    """

    def __init__(self, kind: MessageType, places: PacketPositions, decode: Decode, lose: Lose):
        import numpy as np

        self.kind = kind
        self.places = places
        self.rows: NDArray[Any] = np.empty(places.offsets.size, dtype_of(kind))
        self.whole: NDArray[np.bool_] = np.ones(places.offsets.size, np.bool_)
        self._decode = decode
        self._lose = lose
        self._codes = kind.wire_codes
        self._fixed = next((index for index, code in enumerate(self._codes) if code in VARIABLE), len(self._codes))
        self._fronts = {order: self._front(order) for order in "<>"}

    def read(self, reader: PacketReader) -> "NDArray[Any]":
        """Fill all rows, and return those that are whole. Raises StaleIndex."""
        begin = 0
        for batch in reader.batches(self.places):
            self.fill(slice(begin, begin + batch.starts.size), batch)
            begin += batch.starts.size
        return self.complete_rows()

    def complete_rows(self) -> "NDArray[Any]":
        """The rows that are whole messages."""
        return self.rows if self.whole.all() else self.rows[self.whole]

    def fill(self, part: slice, batch: Batch) -> None:
        """Fill part of the rows from their packets."""
        import numpy as np

        rows, whole = self.rows[part], self.whole[part]
        if batch.big.any():
            for big in (False, True):
                chosen = batch.big == big
                self._fill(batch.select(chosen), rows, whole, np.flatnonzero(chosen), "<>"[big])
        else:
            self._fill(batch, rows, whole, slice(None), "<")
        if self._fixed < len(self._codes):
            for index in np.flatnonzero(~whole).tolist():
                start, end = int(batch.starts[index]), int(batch.ends[index])
                self._lose_malformed(batch.base + start, bytes(batch.data[start:end]))

    def _front(self, order: str) -> "np.dtype[Any]":
        """Header and numbers before the first field of variable size."""
        import numpy as np

        row = dtype_of(self.kind, order)
        return np.dtype([(name, row[name]) for name in (row.names or ())[: len(ADDRESS_FIELDS) + self._fixed]])

    def _fill(self, batch: Batch, rows: "NDArray[Any]", whole: "NDArray[np.bool_]", chosen: Any, order: str) -> None:
        """Fill the chosen rows from the packets of a batch, which are all in one byte order."""
        import numpy as np

        codes, front = self._codes, self._fronts[order]
        if self._fixed == len(codes) and batch.rows is not None:
            rows.view("u1").reshape(rows.size, -1)[:] = batch.rows[:, _ROW_BEGINS : _ROW_BEGINS + front.itemsize]
            return
        found = read_at_offsets(batch.data, batch.starts + _ROW_BEGINS, f"V{front.itemsize}")
        if self._fixed == len(codes) and order == "<":
            rows.view(found.dtype)[chosen] = found
            return
        for name in front.names or ():
            rows[name][chosen] = found.view(front)[name]
        if set(codes) & {"M", "L"}:
            self._fill_decoded(batch, rows, whole, np.arange(whole.size)[chosen].tolist())
            return
        at = batch.starts + _ROW_BEGINS + front.itemsize
        behind = batch.ends - FOOTER_SIZE
        good = np.ones(at.size, np.bool_)
        for field, code in zip(self.kind.fields[self._fixed :], codes[self._fixed :], strict=True):
            width = 2 if code in VARIABLE else struct.calcsize("<" + code)
            good &= at + width <= behind
            # If a message has ended, read from its start, to stay inside the buffer; `whole` drops the row.
            place = np.where(good, at, batch.starts)
            if code in VARIABLE:
                at = place + 2 + read_at_offsets(batch.data, place, order + "u2")
            else:
                rows[field.attribute][chosen] = read_at_offsets(batch.data, place, order + NUMPY[code])
                at = place + width
        whole[chosen] = good & (at <= behind)

    def _fill_decoded(self, batch: Batch, rows: "NDArray[Any]", whole: "NDArray[np.bool_]", indices: list[int]) -> None:
        """Fill the other columns from decoded messages: only decoding finds where a message inside another ends."""
        rest = zip(self.kind.fields[self._fixed :], self._codes[self._fixed :], strict=True)
        names = [field.attribute for field, code in rest if code not in VARIABLE]
        for index, (_, packet) in zip(indices, batch.packets(), strict=True):
            try:
                message = self._decode(packet)
            except DecodeError:
                whole[index] = False
            else:
                for name in names:
                    rows[name][index] = getattr(message, name)

    def _lose_malformed(self, offset: int, packet: bytes) -> None:
        try:
            self._decode(packet)
        except DecodeError as error:
            self._lose(offset, len(packet), error.reason)
        else:
            _lose_short(self.kind, offset, len(packet) - SMALLEST_PACKET, self._lose)


def read_tables(tables: Sequence[ColumnReader], reader: PacketReader) -> None:
    """Fill several tables in one pass over the log. Raises StaleIndex."""
    for found in reader.table_batches([table.places for table in tables]):
        for number, part, batch in found:
            tables[number].fill(part, batch)


def _lose_short(kind: MessageType, offset: int, size: int, lose: Lose) -> None:
    lose(offset, size + SMALLEST_PACKET, f"{kind.abbrev}: payload of {size} bytes is too short")
