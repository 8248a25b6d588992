"""Messages one by one are the same topics, types and bytes as in the MCAP file of their log."""

import math

import pytest
from mcap.reader import make_reader
from rosbags.typesys import Stores, get_types_from_msg, get_typestore

import imc
from runtime.logs import summarize
from shoal.logs.export import CdrError, LogSource, MessageTopics, TopicChannels
from shoal.logs.export.mcap import export_mcap
from tests.shoal.logs.export.mcap_reader import Reader

HEADER = {"timestamp": 1.7e9, "src": 0x1A, "src_ent": 7, "dst": 0x1E, "dst_ent": 9}
POSITION = {"lat": 0.7, "lon": -0.15, "height": 2.0}
ATTITUDE = {"phi": 0.1, "theta": 0.2, "psi": 0.3}
MOTION = {"u": 1.0, "v": 0.2, "w": 0.3, "p": 0.01, "q": 0.02, "r": 0.03}
VALID = imc.GpsFix.Validity.VALID_POS | imc.GpsFix.Validity.VALID_HACC | imc.GpsFix.Validity.VALID_VACC
MESSAGES = [
    imc.EstimatedState(**POSITION, **ATTITUDE, **MOTION, x=10.0, y=20.0, z=5.0, **HEADER),
    imc.SimulatedState(**POSITION, **ATTITUDE, **MOTION, **HEADER),
    imc.GpsFix(**POSITION, validity=VALID, hacc=2.0, vacc=3.0, **HEADER),
    imc.LogBookEntry(text="añb", context="here", type=imc.LogBookEntry.Type.WARNING, **HEADER),
    imc.PlanControl(plan_id="a", arg=imc.PlanSpecification(plan_id="a"), **HEADER),
    imc.Temperature(value=math.nan, **HEADER),
]


class Sink:
    """Keeps the topics and types that it is given."""

    def __init__(self):
        self.types, self.topics = [], []

    def add_schema(self, name, definition):
        self.types.append((name, definition))
        return len(self.types)

    def add_channel(self, topic, schema, metadata):
        self.topics.append((topic, *self.types[schema - 1]))
        return len(self.topics)


def live(messages):
    """Topic, type, definition and bytes of each message."""
    topics, sink = MessageTopics(imc.builtin()), Sink()
    channels = TopicChannels(sink)
    for message in messages:
        for topic in topics.topics_of(message, "lauv-noptilus-1", None):
            channel = channels.channel(topic.parts, topic.type)
            yield (*sink.topics[channel - 1], topic.encode(message, 1_700_000_000 * 10**9))


def test_each_message_is_encoded_as_in_the_file_of_the_log(make_log, tmp_path):
    log = imc.Log(make_log(MESSAGES))
    export_mcap(LogSource(log, summarize(log)), tmp_path / "a.mcap", raw=False)
    with (tmp_path / "a.mcap").open("rb") as file:
        exported = [
            (channel.topic, schema.name, schema.data.decode(), message.data)
            for schema, channel, message in make_reader(file).iter_messages()
        ]
    found = list(live(MESSAGES))
    assert len(found) == 15
    assert sorted(found) == sorted(exported)


def test_odometry_is_the_type_of_ros_in_the_frame_of_the_vehicle(make_log, tmp_path):
    log = imc.Log(make_log(MESSAGES))
    export_mcap(LogSource(log, summarize(log)), tmp_path / "a.mcap", raw=False)
    reader = Reader(tmp_path / "a.mcap")
    ((_, motion),) = reader.on("/lauv_noptilus_1/EstimatedState/entity_7/odometry")
    ((_, pose),) = reader.on("/lauv_noptilus_1/EstimatedState/entity_7/pose")
    assert (motion.header.frame_id, motion.child_frame_id) == ("map", "lauv_noptilus_1")
    assert motion.pose.pose == pose.pose
    linear, angular = motion.twist.twist.linear, motion.twist.twist.angular
    assert (linear.x, linear.y, linear.z) == pytest.approx((1.0, -0.2, -0.3))
    assert (angular.x, angular.y, angular.z) == pytest.approx((0.01, -0.02, -0.03))
    store = get_typestore(Stores.ROS2_JAZZY)
    (definition,) = {definition for topic, _, definition, _ in live(MESSAGES) if topic.endswith("/odometry")}
    for name, fields in get_types_from_msg(definition, "nav_msgs/msg/Odometry").items():
        assert fields == store.fielddefs[name], name


def test_a_vehicle_without_a_position_has_no_pose_and_sets_no_origin():
    topics = MessageTopics(imc.builtin())
    lost = imc.EstimatedState(**HEADER)
    named = {topic.parts[-1]: topic for topic in topics.topics_of(lost, "a", "Navigation")}
    assert set(named) == {"Navigation", "location", "pose", "odometry", "tf"}
    with pytest.raises(CdrError, match="before the first position"):
        named["pose"].encode(lost, 0)
    assert named["pose"].encode(MESSAGES[0], 0)
    assert named["pose"].encode(lost, 0)


def test_a_picture_has_the_format_of_its_first_bytes():
    topics = MessageTopics(imc.builtin())
    _, topic = topics.topics_of(imc.CompressedImage(**HEADER), "a", "Camera")
    assert (topic.parts, topic.type.full_name) == (("a", "Camera", "image"), "sensor_msgs/msg/CompressedImage")
    store = get_typestore(Stores.ROS2_JAZZY)
    picture = store.deserialize_cdr(
        topic.encode(imc.CompressedImage(data=b"\xff\xd8\xff\xe0", **HEADER), 5), topic.type.full_name
    )
    assert (picture.format, picture.header.frame_id, picture.header.stamp.nanosec) == ("jpeg", "a/Camera", 5)
    assert bytes(picture.data) == b"\xff\xd8\xff\xe0"
    with pytest.raises(CdrError, match="no picture"):
        topic.encode(imc.CompressedImage(data=b"raw", **HEADER), 5)


def test_a_message_of_unknown_id_has_no_topic():
    assert MessageTopics(imc.builtin()).topics_of(imc.Unknown(id=65000, payload=b"x"), "a", None) == []
