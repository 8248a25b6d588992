"""Messages one by one as ROS 2 messages of their types in CDR."""

import struct
from collections.abc import Callable
from operator import attrgetter

import imc
from imc.layout import ADDRESS_FIELDS
from shoal.logs.export.cdr import ENCAPSULATION, CdrWriter, cdr_string, make_cdr_writer
from shoal.logs.export.ros_types import RosType, ros_type

ADDRESSES = {name: code for name, code in ADDRESS_FIELDS.items() if name != "timestamp"}
_addresses = attrgetter(*ADDRESSES)


class RosMessageEncoder:
    """The types of the messages of a schema, and their encoding."""

    def __init__(self, schema: imc.Schema) -> None:
        self._schema = schema
        self._types: dict[int, tuple[RosType, CdrWriter]] = {}
        self._heads: dict[str, tuple[Callable[..., bytes], bytes]] = {}

    def type_of(self, message: imc.MessageType) -> RosType:
        return self._known(message)[0]

    def encode(self, message: imc.Message, kind: imc.MessageType, seconds: int, nanoseconds: int, frame: str) -> bytes:
        """A message of a type in CDR with its time since 1970 and its frame. Raises CdrError."""
        pack, name = self._heads.get(frame) or self._head(frame)
        body = bytearray(pack(seconds, nanoseconds, name, *_addresses(message)))
        self._known(kind)[1](message, body)
        return ENCAPSULATION + body

    def _known(self, message: imc.MessageType) -> tuple[RosType, CdrWriter]:
        found = self._types.get(message.id)
        if found is None:
            type_ = ros_type(self._schema, message)
            found = self._types[message.id] = (type_, make_cdr_writer(type_))
        return found

    def _head(self, frame: str) -> tuple[Callable[..., bytes], bytes]:
        """Packs header and addresses of messages in a frame: the function, and the name to give it."""
        name = cdr_string(frame.encode())
        layout = struct.Struct(f"<II{len(name)}s{len(name) % 2}xHBxHB")
        self._heads[frame] = layout.pack, name
        return self._heads[frame]
