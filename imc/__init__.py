"""The IMC protocol: messages, codec, schema, logs."""

from imc import coordinates, messages
from imc.codec import (
    Codec,
    datagram_packet,
    decode,
    decode_datagram,
    encode,
    encode_with_header,
    header,
    packet_id,
    packet_source,
    with_header,
)
from imc.dict_codec import from_dict, from_json
from imc.encodability import Violation
from imc.errors import DecodeError, EncodeError, SchemaError
from imc.lsf import Log
from imc.message import Header, Message, Unknown
from imc.messages import *
from imc.schema import (
    Enumeration,
    Field,
    FieldInfo,
    Group,
    MessageType,
    Schema,
    Value,
    builtin,
    definition_checksum,
    dump,
    fields,
    load,
)
from imc.stream import Loss, StreamParser
from imc.validation import validate

__all__ = [
    "Codec",
    "DecodeError",
    "EncodeError",
    "Enumeration",
    "Field",
    "FieldInfo",
    "Group",
    "Header",
    "Log",
    "Loss",
    "Message",
    "MessageType",
    "Schema",
    "SchemaError",
    "StreamParser",
    "Unknown",
    "Value",
    "Violation",
    "builtin",
    "coordinates",
    "datagram_packet",
    "decode",
    "decode_datagram",
    "definition_checksum",
    "dump",
    "encode",
    "encode_with_header",
    "fields",
    "from_dict",
    "from_json",
    "header",
    "load",
    "packet_id",
    "packet_source",
    "validate",
    "with_header",
]
__all__ += messages.__all__
