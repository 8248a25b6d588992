"""The IMC protocol: messages, codec, schema, logs."""

from imc import messages
from imc.codec import Codec, encode, encode_as, header, with_header
from imc.errors import DecodeError, EncodeError, SchemaError
from imc.message import Header, Message, Unknown
from imc.messages import *  # noqa: F403  (the names are in messages.__all__)
from imc.schema import Schema
from imc.schema_files import builtin, load

_CODEC = Codec(messages.BY_ID.__getitem__, Message.SYNC)
decode = _CODEC.decode

__all__ = [
    "Codec",
    "DecodeError",
    "EncodeError",
    "Header",
    "Message",
    "Schema",
    "SchemaError",
    "Unknown",
    "builtin",
    "decode",
    "encode",
    "encode_as",
    "header",
    "load",
    "with_header",
]
__all__ += messages.__all__
