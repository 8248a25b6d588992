"""Reads MCAP files with the packages `mcap` and `rosbags`."""

from mcap.reader import make_reader
from rosbags.typesys import Stores, get_types_from_msg, get_typestore


class Reader:
    """The content that two packages find in an MCAP file of a profile."""

    def __init__(self, path, profile="ros2"):
        self.types = get_typestore(Stores.EMPTY)
        self.messages = []
        with path.open("rb") as file:
            reader = make_reader(file, validate_crcs=True)
            self.summary = reader.get_summary()
            assert reader.get_header().profile == profile
            for schema in self.summary.schemas.values():
                assert schema.encoding == "ros2msg"
                self.register(get_types_from_msg(schema.data.decode(), schema.name))
            last = 0
            for schema, channel, message in reader.iter_messages():
                assert message.log_time >= last
                last = message.log_time
                self.messages.append((channel, message, self.types.deserialize_cdr(message.data, schema.name)))
            self.attachments = {item.name: item.data for item in reader.iter_attachments()}
            self.metadata = {item.name: item.metadata for item in reader.iter_metadata()}

    def register(self, types):
        for name, definition in types.items():
            if name in self.types.fielddefs:
                assert self.types.fielddefs[name] == definition
        self.types.register({name: types[name] for name in types if name not in self.types.fielddefs})

    def on(self, topic):
        return [(message, said) for channel, message, said in self.messages if channel.topic == topic]

    @property
    def topics(self):
        return {channel.topic for channel in self.summary.channels.values()}
