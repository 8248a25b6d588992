"""The settings of a camera by MAVLink's extended parameters, which can also be texts and lists."""

import struct
from collections.abc import Iterable
from dataclasses import dataclass
from typing import Any

from mavlink.vehicle.interfaces import ParameterDeclaration, ParameterView
from mavlink.vehicle.parameters.named_parameters import NamedParameter, NamedParameters
from mavlink.vehicle.parameters.names import parameter_ids
from mavlink.vehicle.parameters.table import HIGHEST, INT32, LOWEST, REAL32, shortest_float32
from support.text_length import CUT, clip_utf8

TEXT = 11  # MAV_PARAM_EXT_TYPE_CUSTOM
LONGEST = 128  # bytes of a value
PACKED = {INT32: struct.Struct("<i"), REAL32: struct.Struct("<f")}


@dataclass(frozen=True, slots=True)
class ExtendedParameter(NamedParameter):
    """One parameter of a camera."""

    @property
    def text(self) -> str:
        """The present value as written in a profile."""
        return self.view.text()

    @property
    def encoded(self) -> bytes:
        """The present value: four bytes of a number, or a text, of which what is too long is cut off."""
        if self.type == TEXT:
            return _cut(self.text)
        value = self.view.value()
        return PACKED[self.type].pack(max(LOWEST, min(HIGHEST, int(value))) if self.type == INT32 else value)

    def decode_param_value(self, raw: bytes, kind: int) -> str:
        """The value in PARAM_EXT_SET as written in a profile. Raises ValueError with the reason."""
        if kind != self.type:
            raise ValueError(f"type {kind} instead of {self.type}")
        parameter = self.declaration
        if kind == TEXT:
            text = raw.partition(b"\0")[0]
            if text == self.encoded:
                return self.text  # perhaps it was cut off
            return parameter.format(parameter.parse(text.decode()))
        (value,) = PACKED[kind].unpack(raw[:4])
        if parameter.type is bool and value not in (0, 1):
            raise ValueError(f"{value} is neither 0 nor 1")
        return parameter.format(parameter.check(parameter.type(shortest_float32(value) if kind == REAL32 else value)))


class ExtendedParameterTable(NamedParameters[ExtendedParameter]):
    """The editable ones among parameters, by MAVLink's names: numbers and booleans, all others as texts."""

    def __init__(self, parameters: Iterable[ParameterView]):
        self._views = {view.declaration.name: view for view in parameters}
        editable = {name: view for name, view in self._views.items() if view.declaration.editable}
        named = parameter_ids(("", name) for name in editable)
        settings = [
            ExtendedParameter(name, index, _kind(editable[parameter].declaration), editable[parameter])
            for index, ((_, parameter), name) in enumerate(named.items())
        ]
        super().__init__(settings)
        self._by_id = {setting.id.encode(): setting for setting in settings}

    def named(self, name: bytes) -> ExtendedParameter | None:
        return self._by_id.get(name)

    def value(self, name: str) -> Any:
        """The value of the parameter with this name in profiles; None if there is none."""
        view = self._views.get(name)
        return None if view is None else view.value()


def _kind(parameter: ParameterDeclaration) -> int:
    if parameter.is_list or parameter.type is str:
        return TEXT
    return REAL32 if parameter.type is float else INT32


def _cut(text: str) -> bytes:
    return clip_utf8(text, LONGEST, CUT).encode()
