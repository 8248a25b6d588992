"""The way of published messages through the codec of the vehicle's schema."""

from collections.abc import Callable
from typing import Any

import imc


class CodecRoundTrip(dict[type[imc.Message], Callable[..., Any]]):
    """Takes messages through the codec of a schema, by type; `encodes` is whether the packets are needed, too."""

    def __init__(self, schema: imc.Schema, encodes: bool) -> None:
        self._schema, self._encodes = schema, encodes

    def __missing__(self, kind: type[imc.Message]) -> Callable[..., Any]:
        if not issubclass(kind, imc.Unknown):
            find_equivalent_class(kind, self._schema)
        passage = self[kind] = self._schema.codec.round_trip_function(kind, self._encodes)
        return passage


def find_equivalent_class(kind: type[imc.Message], schema: imc.Schema) -> type[imc.Message]:
    """The class of `schema` for a message of another one. Raises imc.SchemaError if it has no such message."""
    ours = schema.by_id(kind.ID) if kind.ID in schema.types_by_id else None
    if ours is None or imc.definition_checksum(ours) != imc.definition_checksum(kind):
        raise imc.SchemaError(
            f"{kind.__name__} (id {kind.ID}) is not a message of this vehicle: add its file to [General] Messages"
        )
    return ours
