"""Types of messages as callers name them: by class or name."""

from imc.message import Message
from imc.schema import MessageType, Schema
from support.terminal_text import quoted, with_suggestion

Kind = type[Message] | str


def kind_name(kind: Kind) -> str:
    return kind if isinstance(kind, str) else kind.__name__


def message_type(schema: Schema, kind: Kind) -> MessageType:
    """The type in a schema. Raises KeyError with the nearest name."""
    name = kind_name(kind)
    if name not in schema.types:
        raise KeyError(with_suggestion(f"there is no message {quoted(name)}", name, schema.types))
    return schema.types[name]
