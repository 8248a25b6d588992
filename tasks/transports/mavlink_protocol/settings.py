"""The settings of a camera by MAVLink's extended parameters, which can also be texts and lists."""

import struct
from collections.abc import Iterator
from dataclasses import dataclass
from typing import Any

from runtime import Task
from runtime.task import Parameter
from tasks.transports.mavlink_protocol.names import identifiers
from tasks.transports.mavlink_protocol.parameters import HIGHEST, INT32, LOWEST, REAL32, written

TEXT = 11  # MAV_PARAM_EXT_TYPE_CUSTOM
LONGEST = 128  # bytes of a value
CUT = "…"
PACKED = {INT32: struct.Struct("<i"), REAL32: struct.Struct("<f")}


@dataclass(frozen=True, slots=True)
class Setting:
    """One parameter of the camera's task: its MAVLink name, index and type."""

    id: str
    index: int
    type: int
    parameter: Parameter
    task: Task

    @property
    def text(self) -> str:
        """The present value as written in a profile."""
        return self.task.parameter_set.text(self.parameter)

    @property
    def encoded(self) -> bytes:
        """The present value: four bytes of a number, or a text, of which what is too long is cut off."""
        if self.type == TEXT:
            return _cut(self.text)
        value = self.task.parameter_set.value(self.parameter)
        return PACKED[self.type].pack(max(LOWEST, min(HIGHEST, int(value))) if self.type == INT32 else value)

    def wanted(self, raw: bytes, kind: int) -> str:
        """The value in PARAM_EXT_SET as written in a profile. Raises ValueError with the reason."""
        if kind != self.type:
            raise ValueError(f"type {kind} instead of {self.type}")
        parameter = self.parameter
        if kind == TEXT:
            text = raw.partition(b"\0")[0]
            if text == self.encoded:
                return self.text  # perhaps it was cut off
            return parameter.format(parameter.parse(text.decode()))
        (value,) = PACKED[kind].unpack(raw[:4])
        if parameter.type is bool and value not in (0, 1):
            raise ValueError(f"{value} is neither 0 nor 1")
        return parameter.format(parameter.check(parameter.type(written(value) if kind == REAL32 else value)))


class SettingsTable:
    """The editable parameters of a task, by MAVLink's names: numbers and booleans, all others as texts."""

    def __init__(self, task: Task):
        editable = {name: p for name, p in task.parameter_set.declarations.items() if p.editable}
        named = identifiers(("", name) for name in editable)
        self._owner = task.parameter_set
        self._settings = [
            Setting(name, index, _kind(editable[parameter]), editable[parameter], task)
            for index, ((_, parameter), name) in enumerate(named.items())
        ]
        self._by_id = {setting.id.encode(): setting for setting in self._settings}

    def __len__(self) -> int:
        return len(self._settings)

    def __iter__(self) -> Iterator[Setting]:
        return iter(self._settings)

    def at(self, index: int) -> Setting | None:
        return self._settings[index] if 0 <= index < len(self._settings) else None

    def named(self, name: bytes) -> Setting | None:
        return self._by_id.get(name)

    def value(self, name: str) -> Any:
        """Of the parameter with its name in profiles; None if the task has none."""
        parameter = self._owner.declarations.get(name)
        return None if parameter is None else self._owner.value(parameter)


def _kind(parameter: Parameter) -> int:
    if parameter.is_list or parameter.type is str:
        return TEXT
    return REAL32 if parameter.type is float else INT32


def _cut(text: str) -> bytes:
    raw = text.encode(errors="replace")
    if len(raw) <= LONGEST:
        return raw
    mark = CUT.encode()
    return raw[: LONGEST - len(mark)].decode(errors="ignore").encode() + mark
