"""Reads the numbers of a simulated vehicle from a section [VSIM/Model/...] of its profile."""

import math
from collections.abc import Callable, Sequence

from support.number_parsing import leading_numbers


class ModelError(ValueError):
    """A number in a section [VSIM/Model/...] is missing or invalid."""


class ModelSection:
    """The section of the model `name`; `value(section, option)` returns its texts. All methods raise ModelError."""

    def __init__(self, value: Callable[[str, str], str], name: str):
        self._value = value
        self._section = f"VSIM/Model/{name}"

    def error(self, reason: str) -> ModelError:
        """A ModelError that names the section."""
        return ModelError(f"[{self._section}] {reason}")

    def text(self, option: str) -> str:
        """The text of an option; empty if it is not set."""
        return self._value(self._section, option)

    def numbers(self, option: str, count: int, default: Sequence[float] | None = None) -> tuple[float, ...]:
        """`count` finite numbers; an option without a default is required."""
        text = self.text(option)
        if not text and default is not None:
            return tuple(default)
        try:
            found = tuple(leading_numbers(text))
        except ValueError:
            found = ()
        if len(found) != count or not all(map(math.isfinite, found)):
            wanted = "a number" if count == 1 else f"{count} numbers"
            raise self.error(f"{option} is not {wanted}: {text!r}" if text else f"has no {option}")
        return found

    def positive_numbers(
        self, option: str, count: int = 1, default: Sequence[float] | None = None
    ) -> tuple[float, ...]:
        """`count` numbers above 0."""
        found = self.numbers(option, count, default)
        if min(found) <= 0.0:
            raise self.error(f"{option} must be more than 0")
        return found

    def count(self, option: str) -> int:
        """A whole number from 0 to 255; 0 if it is not set."""
        (found,) = self.numbers(option, 1, (0,))
        if found not in range(256):
            raise self.error(f"{option} is not a whole number from 0 to 255")
        return int(found)
