"""Parameters under MAVLink's names, in the order of their indices."""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from typing import Generic, TypeVar

from mavlink.vehicle.interfaces import ParameterDeclaration, ParameterView


@dataclass(frozen=True, slots=True)
class NamedParameter:
    """One parameter: its MAVLink name, index and type."""

    id: str
    index: int
    type: int
    view: ParameterView

    @property
    def declaration(self) -> ParameterDeclaration:
        return self.view.declaration


P = TypeVar("P", bound=NamedParameter)


class NamedParameters(Generic[P]):
    """A sequence of parameters, by index."""

    def __init__(self, entries: Sequence[P]):
        self._entries = entries

    def __len__(self) -> int:
        return len(self._entries)

    def __iter__(self) -> Iterator[P]:
        return iter(self._entries)

    def at(self, index: int) -> P | None:
        """The parameter of an index; None if there is none."""
        return self._entries[index] if 0 <= index < len(self._entries) else None
