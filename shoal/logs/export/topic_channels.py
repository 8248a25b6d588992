"""Names of ROS topics and frames, and the channels of the topics in an MCAP file or of a live connection."""

import re
from typing import Protocol

from shoal.logs.export.ros_types import RosType


def ros_name(text: str) -> str:
    """A name that ROS accepts for a part of a topic or for a frame: letters, digits, underscores, no digit in front."""
    name = re.sub(r"[^A-Za-z0-9]+", "_", text).strip("_") or "unnamed"
    return "_" * name[0].isdigit() + name


class ChannelSink(Protocol):
    """Takes the types and channels when they are first needed; each gets a number."""

    def add_schema(self, name: str, definition: str) -> int:
        """A ROS 2 message type."""
        ...

    def add_channel(self, topic: str, schema: int, metadata: dict[str, str]) -> int:
        """A topic with messages of a type."""
        ...


class TopicChannels:
    """Types and channels, given to the sink when they are first needed."""

    def __init__(self, sink: ChannelSink):
        self._sink = sink
        self._schemas: dict[str, int] = {}
        self._channels: dict[tuple[str, int], int] = {}
        self._owners: dict[str, tuple[str, ...]] = {}

    def channel(self, parts: tuple[str, ...], type_: RosType, **metadata: str) -> int:
        """The number of the channel with this type and a topic of these parts.

        Different names that are the same in ROS get a number at the end.
        """
        schema = self._schemas.get(type_.full_name)
        if schema is None:
            schema = self._schemas[type_.full_name] = self._sink.add_schema(type_.full_name, type_.definition)
        topic = self._topic(parts)
        channel = self._channels.get((topic, schema))
        if channel is None:
            channel = self._channels[topic, schema] = self._sink.add_channel(topic, schema, metadata)
        return channel

    def _topic(self, parts: tuple[str, ...]) -> str:
        plain = topic = "/" + "/".join(map(ros_name, parts))
        number = 2
        while self._owners.setdefault(topic, parts) != parts:
            topic, number = f"{plain}_{number}", number + 1
        return topic
