"""The vehicle's parameters under MAVLink's 16-character names, as INT32 and REAL32."""

import math
import struct
from collections.abc import Iterable
from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from mavlink import Flavor
from mavlink.vehicle.interfaces import ParameterDeclaration, ParameterView
from mavlink.vehicle.parameters.named_parameters import NamedParameter, NamedParameters
from mavlink.vehicle.parameters.names import STANDARD, parameter_ids
from support.float32 import shortest_float32

INT32, REAL32 = 6, 9
DOES_NOT_EXIST, OUT_OF_RANGE, PERMISSION_DENIED, TYPE_MISMATCH = 1, 2, 3, 7
UNLISTED = 0xFFFF  # the index of a name that is not in the list
LOWEST, HIGHEST = -(1 << 31), (1 << 31) - 1


class ParameterRefusal(ValueError):
    """A value that a parameter cannot have; `code` is the MAV_PARAM_ERROR."""

    def __init__(self, code: int, reason: str):
        super().__init__(reason)
        self.code = code


@dataclass(frozen=True, slots=True)
class ParameterEntry(NamedParameter):
    """One parameter of the vehicle."""

    @property
    def value(self) -> int | float:
        """The present value."""
        return self.to_number(self.view.value())

    def to_number(self, value: Any) -> int | float:
        """A value as MAVLink has it: of a choice among texts its index, and integers within 32 bits."""
        if self.declaration.type is str:
            return self.declaration.choices.index(value)
        return value if self.type == REAL32 else max(LOWEST, min(HIGHEST, int(value)))

    def encoded(self, flavor: Flavor) -> bytes:
        """The four bytes of PARAM_VALUE.param_value: an integer's own bytes, or the float nearest to it."""
        if self.type == INT32 and flavor.bytewise:
            return struct.pack("<i", self.value)
        return np.float32(self.value).astype("<f4").tobytes()

    def decode_param_value(self, raw: bytes, kind: int, flavor: Flavor) -> str:
        """The four bytes of PARAM_SET.param_value, of type `kind`, as written in a profile. Raises ParameterRefusal."""
        if flavor.bytewise and kind != self.type:
            raise ParameterRefusal(TYPE_MISMATCH, f"type {kind} instead of {self.type}")
        if flavor.bytewise and self.type == INT32:
            value: float = struct.unpack("<i", raw)[0]
        else:
            value = struct.unpack("<f", raw)[0]
            if not math.isfinite(value):
                raise ParameterRefusal(OUT_OF_RANGE, f"{value} is not a finite number")
        return self._checked(value)

    def _checked(self, value: float) -> str:
        parameter = self.declaration
        if self.type == REAL32:
            wanted = shortest_float32(value)
        elif value != int(value):
            raise ParameterRefusal(OUT_OF_RANGE, f"{value:g} is not an integer")
        elif parameter.type is int:
            wanted = int(value)
        else:
            offered = (False, True) if parameter.type is bool else parameter.choices
            if not 0 <= value < len(offered):
                raise ParameterRefusal(OUT_OF_RANGE, f"{value:g} is not within 0 to {len(offered) - 1}")
            wanted = offered[int(value)]
        try:
            return parameter.format(parameter.check(wanted))
        except ValueError as error:
            raise ParameterRefusal(OUT_OF_RANGE, str(error)) from None


class ParameterTable(NamedParameters[ParameterEntry]):
    """The parameters that ground stations may see and set; order and names stay the same while the vehicle runs.

    These are the editable numbers, booleans and choices of all tasks; MAVLink has no parameters for texts and lists.
    """

    def __init__(self, parameters: Iterable[ParameterView]):
        found = {
            (view.label, view.declaration.name): view
            for view in parameters
            if is_valid_mavlink_parameter(view.declaration, view.value())
        }
        entries: list[ParameterEntry] = []
        for (pair, name), index in zip(parameter_ids(found).items(), range(len(found)), strict=True):
            view = found[pair]
            kind = REAL32 if view.declaration.type is float else INT32
            entries.append(ParameterEntry(name, index, kind, view))
        super().__init__(entries)
        self._by_id = {entry.id: entry for entry in entries}
        self._by_name = {(e.view.label, e.declaration.name): e for e in entries}
        self._by_id |= {
            name: replace(self._by_name[pair], id=name, index=UNLISTED)
            for name, pair in STANDARD.items()
            if pair in self._by_name
        }

    def named(self, name: bytes) -> ParameterEntry | None:
        """The entry with a MAVLink name, or with a standard one, which the list does not have."""
        return self._by_id.get(name.decode("ascii", errors="replace"))

    def find_entity_parameter(self, label: str, parameter: str) -> ParameterEntry | None:
        """The entry of an entity's parameter."""
        return self._by_name.get((label, parameter))


def is_valid_mavlink_parameter(parameter: ParameterDeclaration, value: Any) -> bool:
    """Whether MAVLink can show and set a parameter that has a value."""
    if parameter.is_list or not parameter.editable:
        return False
    if parameter.type is int:
        return LOWEST <= value <= HIGHEST
    return parameter.type is not str or bool(parameter.choices)
