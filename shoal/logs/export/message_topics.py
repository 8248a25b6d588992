"""The ROS topics of one message as it comes: its own, and those of standard types, as in an MCAP file of a log."""

from collections.abc import Callable
from functools import cache, partial
from typing import NamedTuple

import numpy as np

import imc
from imc.layout import ADDRESS_FIELDS, VARIABLE, numpy_columns
from runtime.logs import Array, label_text
from shoal.logs.export import ros_standard_conversion as standard
from shoal.logs.export.cdr import ENCAPSULATION, CdrError, CdrRecords, Item
from shoal.logs.export.ros_message_encoder import RosMessageEncoder
from shoal.logs.export.ros_types import RosType
from shoal.logs.export.topic_channels import ros_name

BILLION = 1_000_000_000
PICTURES = {b"\xff\xd8\xff": "jpeg", b"\x89PNG": "png", b"RIFF": "webp"}
"""First bytes of a picture, and the name of its format in ROS."""
Fill = Callable[[Array, Array, imc.Message], object]
RosEncoder = Callable[[imc.Message, int], bytes]


class MessageTopic(NamedTuple):
    """A topic for a message: the parts of its name, its type, and what encodes it at a time (ns since 1970 UTC) in CDR.

    `encode` raises CdrError if the type cannot hold the message.
    """

    parts: tuple[str, ...]
    type: RosType
    encode: RosEncoder


class MessageTopics:
    """The topics of the messages of a schema. The frame `map` has its origin at the first reference position."""

    def __init__(self, schema: imc.Schema) -> None:
        self._schema = schema
        self._encoder = RosMessageEncoder(schema)
        self._origin: standard.MapOrigin | None = None
        self._moving: dict[str, int] = {}
        self._posed: tuple[imc.Message | None, Array] = None, np.empty(0)
        self._record = cache(_plain_record)
        self._layout = cache(_row_layout)

    def topics_of(self, message: imc.Message, system: str, label: str | None) -> list[MessageTopic]:
        """The topics of all messages like this one: of its type, system and entity, whose label may be unknown.

        One of unknown id has none.
        """
        if isinstance(message, imc.Unknown):
            return []
        kind = self._schema.types[type(message).__name__]
        entity, frame = label_text(label, message.src_ent), ros_name(system)

        def encode(message: imc.Message, time: int) -> bytes:
            return self._encoder.encode(message, kind, *divmod(time, BILLION), frame)

        own = system, kind.abbrev, entity
        return [
            MessageTopic(own, self._encoder.type_of(kind), encode),
            *self._standard(message, kind, own, frame),
        ]

    def _standard(
        self, message: imc.Message, kind: imc.MessageType, own: tuple[str, ...], frame: str
    ) -> list[MessageTopic]:
        if kind.abbrev == "LogBookEntry":
            return [MessageTopic(("rosout",), standard.LOG, partial(_log, f"{own[0]}.{own[2]}"))]
        if kind.abbrev == "CompressedImage":
            camera = f"{frame}/{ros_name(own[2])}".encode()
            return [MessageTopic((own[0], own[2], "image"), standard.IMAGE, partial(_picture, camera))]
        names = {field.attribute for field in kind.fields}
        if names >= standard.STATE:
            return self._of_state(message, kind, own, frame.encode())
        if kind.abbrev == "GpsFix" and names >= standard.FIX:
            layout = standard.location_layout(frame.encode())
            encode = self._rows(kind, layout, lambda records, fixes, _: standard.fill_gps_location(records, fixes))
            return [MessageTopic((*own, "location"), standard.LOCATION, encode)]
        return []

    def _of_state(
        self, message: imc.Message, kind: imc.MessageType, own: tuple[str, ...], frame: bytes
    ) -> list[MessageTopic]:
        layout = standard.location_layout(frame)
        encode = self._rows(kind, layout, lambda records, states, _: standard.fill_state_location(records, states))
        found = [MessageTopic((*own, "location"), standard.LOCATION, encode)]

        def fill_pose(records: Array, states: Array, message: imc.Message) -> None:
            poses = self._poses(states, message)
            for name in standard.PLACE:
                records[name] = poses[name]

        def fill_odometry(records: Array, states: Array, message: imc.Message) -> None:
            standard.fill_odometry(records, self._poses(states, message), states)

        def fill_transform(records: Array, states: Array, message: imc.Message) -> None:
            fill_pose(records, states, message)
            records["count"] = 1

        found.append(MessageTopic((*own, "pose"), standard.POSE, self._rows(kind, standard.pose_layout(), fill_pose)))
        if {field.attribute for field in kind.fields} >= standard.MOTION:
            encode = self._rows(kind, standard.odometry_layout(frame), fill_odometry)
            found.append(MessageTopic((*own, "odometry"), standard.ODOMETRY, encode))
        entity = self._moving.setdefault(own[0], message.src_ent) if kind.abbrev == "EstimatedState" else None
        if entity == message.src_ent:  # one transform per vehicle
            encode = self._rows(kind, standard.transform_layout(frame), fill_transform)
            found.append(MessageTopic(("tf",), standard.TRANSFORM, encode))
        return found

    def _poses(self, states: Array, message: imc.Message) -> Array:
        """The pose of a state, which is computed once for all its topics."""
        if self._posed[0] is not message:
            poses = self._record(standard.pose_layout()).zeros(1)
            standard.fill_pose(poses, states, self._origin_of_map(states))
            self._posed = message, poses
        return self._posed[1]

    def _origin_of_map(self, states: Array) -> standard.MapOrigin:
        """Raises CdrError before the first position: a vehicle without one reports 0, 0."""
        if self._origin is None:
            found = standard.first_origin(states)
            if found is None or found[:2] == imc.coordinates.NOWHERE:
                raise CdrError("the frame map has no origin before the first position")
            self._origin = found
        return self._origin

    def _rows(self, kind: imc.MessageType, layout: tuple[Item, ...], fill: Fill) -> RosEncoder:
        record = self._record(layout)

        def encode(message: imc.Message, time: int) -> bytes:
            records = record.zeros(1)
            fill(records, self._row(kind, message), message)
            records["sec"], records["nanosec"] = divmod(time, BILLION)
            return records.tobytes()

        return encode

    def _row(self, kind: imc.MessageType, message: imc.Message) -> Array:
        """A message as an array of one row, as logs have them."""
        layout = self._layout(kind)
        return np.array([tuple(getattr(message, name) for name in layout.names or ())], layout)


def _plain_record(items: tuple[Item, ...]) -> CdrRecords:
    return CdrRecords((), items)


def _row_layout(kind: imc.MessageType) -> np.dtype[np.void]:
    pairs = zip(kind.fields, kind.wire_codes, strict=True)
    numbers = {field.attribute: code for field, code in pairs if code not in VARIABLE}
    return np.dtype(numpy_columns({**ADDRESS_FIELDS, **numbers}))


def _log(speaker: str, message: imc.Message, time: int) -> bytes:
    return ENCAPSULATION + standard.log_body(time, message, speaker)


def _picture(camera: bytes, message: imc.Message, time: int) -> bytes:
    data = bytes(getattr(message, "data", b""))
    form = next((name for mark, name in PICTURES.items() if data.startswith(mark)), None)
    if form is None:
        raise CdrError("CompressedImage is no picture that viewers show")
    return ENCAPSULATION + standard.image_body(time, camera, form, data)
