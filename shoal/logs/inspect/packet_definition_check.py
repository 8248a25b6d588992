"""Compares the packets of a log with its definitions."""

from collections import Counter
from typing import NamedTuple

import numpy as np

import imc
from imc.layout import NUMBERS
from runtime.logs import PacketBlock

SAMPLE = 1000  # packets of each message of variable size that are decoded
MOST_KINDS = 10  # of misfits of one message that are listed
_BYTES = {"int8_t": 1, "uint8_t": 1, "int16_t": 2, "uint16_t": 2, "int32_t": 4, "uint32_t": 4, "fp32_t": 4}


class SchemaMismatch(NamedTuple):
    """A message that is not as defined: how, in how many packets, and where the first is."""

    how: str
    packets: int
    offset: int


class SchemaCheck:
    """Counts the packets that are longer or shorter than in the definitions, and those of unknown ids."""

    def __init__(self, schema: imc.Schema):
        self._schema = schema
        self._fixed = {number: _fixed_size(message) for number, message in schema.types_by_id.items()}
        self._left = Counter({number: SAMPLE for number, size in self._fixed.items() if size is None})
        self._found: dict[tuple[int, str], SchemaMismatch] = {}
        self.unknown: Counter[int] = Counter()

    @property
    def mismatches(self) -> dict[int, list[SchemaMismatch]]:
        """Mismatches by id of the message."""
        found: dict[int, list[SchemaMismatch]] = {}
        for (number, _), misfit in self._found.items():
            found.setdefault(number, []).append(misfit)
        return found

    def __call__(self, block: PacketBlock) -> None:
        heads = block.headers
        for number in np.unique(heads["id"]).tolist():
            places = np.flatnonzero(heads["id"] == number)
            if number not in self._fixed:
                self.unknown[number] += len(places)
            elif (size := self._fixed[number]) is not None:
                for place in places[heads["size"][places] != size]:
                    self._note(number, f"{heads['size'][place]} bytes of fields in place of {size}", block, place)
            else:
                taken = places[: self._left[number]]
                self._left[number] -= len(taken)
                for place in taken:
                    self._decode(number, block, place)

    def _decode(self, number: int, block: PacketBlock, place: int) -> None:
        try:
            message = self._schema.decode(block.packets[place])
        except imc.DecodeError as error:
            self._note(number, error.reason, block, place)
        else:
            if message.surplus:
                self._note(number, f"{len(message.surplus)} bytes after the last field", block, place)

    def _note(self, number: int, how: str, block: PacketBlock, place: int) -> None:
        if (number, how) not in self._found and sum(number == other for other, _ in self._found) >= MOST_KINDS:
            how = "wrong in other ways"
        before = self._found.get((number, how), SchemaMismatch(how, 0, block.offsets[place]))
        self._found[number, how] = before._replace(packets=before.packets + 1)


def _fixed_size(message: imc.MessageType) -> int | None:
    """Bytes of the fields; None if they differ from packet to packet."""
    if any(field.type not in NUMBERS for field in message.fields):
        return None
    return sum(_BYTES.get(field.type, 8) for field in message.fields)
