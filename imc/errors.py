"""Errors in definitions, messages and packets."""

from support.diagnostics import LocatedError


class SchemaError(LocatedError):
    """A definition file is wrong; the text begins with file:line if known."""


class EncodeError(ValueError):
    """A message that does not fit the wire; the text names message and field."""


class DecodeError(ValueError):
    """Bytes that are not a packet of the schema; `reason` is the cause."""

    def __init__(self, reason: str) -> None:
        super().__init__(reason)
        self.reason = reason
