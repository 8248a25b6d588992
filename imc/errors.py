"""Errors in definitions, messages and packets."""


class SchemaError(ValueError):
    """A definition file is wrong; the text begins with file:line if known."""

    def __init__(self, text: str, where: str = "") -> None:
        super().__init__(f"{where}: {text}" if where else text)


class EncodeError(ValueError):
    """A message that does not fit the wire; the text names message and field."""


class DecodeError(ValueError):
    """Bytes that are not a packet of the schema; `reason` says why."""

    def __init__(self, reason: str) -> None:
        super().__init__(reason)
        self.reason = reason
