"""Logs as MCAP, read by the packages `mcap` and `rosbags`, and imported again."""

import io
import json
import math
from collections import Counter
from pathlib import Path

import numpy as np
import pytest
from PIL import Image
from rosbags.typesys import Stores, get_typestore

import imc
from imc.layout import WIRE_CODES
from runtime.logs import summarize
from shoal.logs.edit.mcap_import import import_mcap
from shoal.logs.export import LogSource
from shoal.logs.export.mcap import export_mcap
from shoal.logs.export.ros_types import ros_type
from shoal.logs.selection import PacketSelection
from support import wgs84
from support.pose import DOWN, Pose
from tasks.vision.cameras.camera_metadata import write_cameras
from tests.shoal.logs.export.mcap_reader import Reader
from world.optics import DoubleSphereModel, PinholeModel

LOGS = Path(__file__).parents[3] / "data" / "logs"
HEADER = {"timestamp": 1.7e9, "src": 0x1A, "src_ent": 7, "dst": 0x1E, "dst_ent": 9}
VALUES = {"T": "añb\t", "R": b"\x00\xff\x01", "f": 0.1, "d": math.pi, "b": -3, "B": 200, "h": -300, "H": 60000}
VALUES |= {"i": -70000, "I": 4_000_000_000, "q": -(1 << 40)}


def packets_of(log):
    return [packet for _, packet in log.packets()]


def source_of(log, **choice):
    opened = imc.Log(log)
    return LogSource(opened, summarize(opened), PacketSelection(**choice))


def check_equal(schema, message, said):
    """Assert that a message read by rosbags equals that of the log."""
    members = ros_type(schema, schema.types_by_id[message.ID]).fields
    for field, member in zip(schema.fields(type(message)), members, strict=True):
        check_field(schema, field.type, getattr(message, field.name), getattr(said, member.name), member.inner)
    assert (said.src, said.src_ent, said.dst, said.dst_ent) == (
        message.src,
        message.src_ent,
        message.dst,
        message.dst_ent,
    )
    assert said.header.stamp.sec + said.header.stamp.nanosec / 1e9 == message.timestamp


def check_field(schema, kind, logged, read, inner):
    if kind == "message" and inner:
        check_field(schema, "message-list", () if logged is None else (logged,), read, inner)
    elif kind == "message-list" and inner:
        assert len(read) == len(logged)
        for item, found in zip(logged, read, strict=True):
            for field, member in zip(schema.fields(type(item)), inner.fields, strict=True):
                check_field(schema, field.type, getattr(item, field.name), getattr(found, member.name), member.inner)
    elif kind == "message":
        assert (None if read == "null" else imc.from_json(read, schema)) == logged
    elif kind == "message-list":
        items = [imc.from_dict(item, schema) if item else None for item in json.loads(read)]
        assert tuple(items) == logged
    else:
        found = bytes(read) if kind == "rawdata" else read
        assert found == logged or (found != found and logged != logged)


@pytest.fixture(scope="module")
def idle(tmp_path_factory):
    """A log of DUNE as MCAP: the log, the file, its contents."""
    path = tmp_path_factory.mktemp("idle") / "idle.mcap"
    source = source_of(LOGS / "dune-idle")
    count = export_mcap(source, path)
    return source, path, Reader(path), count


@pytest.mark.heavy
def test_all_messages_of_a_log_of_dune_are_read_as_they_are(idle):
    source, _, reader, count = idle
    packets = packets_of(source.log)
    found = Counter()
    for channel, message, said in reader.messages:
        if "imc_id" in channel.metadata and said.__msgtype__.startswith("imc_msgs"):
            logged = source.schema.decode(packets[message.sequence])
            assert channel.metadata["message"] == type(logged).__name__
            check_equal(source.schema, logged, said)
            found[type(logged).__name__] += 1
    assert found == source.log.counts()
    assert len(reader.messages) == reader.summary.statistics.message_count == count
    assert source.packets == 6647
    assert not source.skipped


def test_topics_name_system_message_and_entity_as_ros_allows(idle):
    _, _, reader, _ = idle
    assert "/lauv_noptilus_1/EstimatedState/Navigation" in reader.topics
    assert len(reader.on("/lauv_noptilus_1/EstimatedState/Navigation")) == 100
    channel = next(c for c in reader.summary.channels.values() if c.topic.endswith("EstimatedState/Navigation"))
    assert channel.metadata["system"] == "lauv-noptilus-1"
    assert channel.metadata["entity"] == "Navigation"
    for topic in reader.topics:
        assert all(part.isidentifier() and part.isascii() for part in topic[1:].split("/")), topic


def test_definitions_carry_units_and_enumerations(idle):
    _, _, reader, _ = idle
    text = next(s.data.decode() for s in reader.summary.schemas.values() if s.name == "imc_msgs/msg/EntityState")
    assert "uint8 STATE_NORMAL=1\n" in text
    text = next(s.data.decode() for s in reader.summary.schemas.values() if s.name == "imc_msgs/msg/EstimatedState")
    assert "float64 lat  # Latitude (WGS-84), rad\n" in text


def test_standard_types_are_those_of_ros(idle):
    _, _, reader, _ = idle
    theirs = get_typestore(Stores.ROS2_HUMBLE).fielddefs
    names = [name for name in reader.types.fielddefs if not name.startswith("imc_msgs")]
    assert {"tf2_msgs/msg/TFMessage", "sensor_msgs/msg/NavSatFix", "rcl_interfaces/msg/Log"} <= set(names)
    for name in names:
        assert reader.types.fielddefs[name][1] == theirs[name][1], name


def test_the_log_book_is_on_rosout(idle):
    source, _, reader, _ = idle
    entries = sorted(source.log.messages("LogBookEntry"), key=lambda entry: entry.timestamp)
    said = [said for _, said in reader.on("/rosout")]
    assert sorted(s.msg for s in said) == sorted(entry.text for entry in entries)
    assert {s.level for s in said} <= {10, 20, 30, 40, 50}
    assert all(s.name.startswith("lauv-noptilus-1.") for s in said)


def test_positions_are_those_of_the_coordinates_module(idle):
    source, _, reader, _ = idle
    packets = packets_of(source.log)
    found = reader.on("/lauv_noptilus_1/EstimatedState/Navigation/location")
    for message, said in found:
        lat, lon, height = imc.coordinates.absolute_position(source.schema.decode(packets[message.sequence]))
        assert said.latitude == pytest.approx(math.degrees(lat), abs=1e-11)
        assert said.longitude == pytest.approx(math.degrees(lon), abs=1e-11)
        assert said.altitude == pytest.approx(height, abs=1e-6)
    assert len(found) == 100


def rotation(q):
    x, y, z, w = q.x, q.y, q.z, q.w
    return np.array(
        [
            [1 - 2 * (y * y + z * z), 2 * (x * y - z * w), 2 * (x * z + y * w)],
            [2 * (x * y + z * w), 1 - 2 * (x * x + z * z), 2 * (y * z - x * w)],
            [2 * (x * z - y * w), 2 * (y * z + x * w), 1 - 2 * (x * x + y * y)],
        ]
    )


def test_poses_are_east_north_up_and_forward_left_up(make_log, tmp_path):
    states = [
        imc.EstimatedState(lat=0.7, lon=-0.15, height=2.0, x=10.0, y=20.0, z=5.0, psi=0.0, **HEADER),
        imc.EstimatedState(lat=0.7, lon=-0.15, height=2.0, psi=math.pi / 2, **HEADER),
        imc.EstimatedState(lat=0.7, lon=-0.15, height=2.0, theta=0.5, **HEADER),
        imc.EstimatedState(lat=0.7, lon=-0.15, height=2.0, phi=0.5, **HEADER),
        imc.EstimatedState(lat=0.70001, lon=-0.15, height=2.0, **HEADER),
    ]
    export_mcap(source_of(make_log(states)), tmp_path / "a.mcap")
    reader = Reader(tmp_path / "a.mcap")
    poses = [said.pose for _, said in reader.on("/lauv_noptilus_1/EstimatedState/entity_7/pose")]
    place = poses[0].position
    assert (place.x, place.y, place.z) == pytest.approx((20.0, 10.0, -5.0), abs=1e-6)
    forward, left, up = east, north, _ = np.eye(3)
    assert rotation(poses[0].orientation) @ forward == pytest.approx(north, abs=1e-12)
    assert rotation(poses[0].orientation) @ left == pytest.approx(-east, abs=1e-12)
    assert rotation(poses[1].orientation) @ forward == pytest.approx(east, abs=1e-6)
    assert (rotation(poses[2].orientation) @ forward)[2] == pytest.approx(math.sin(0.5))  # bow up
    assert (rotation(poses[3].orientation) @ left)[2] == pytest.approx(math.sin(0.5))  # starboard down
    assert (rotation(poses[3].orientation) @ up)[2] == pytest.approx(math.cos(0.5))
    ahead = wgs84.displacement(0.7, -0.15, 2.0, 0.70001, -0.15, 2.0)
    assert poses[4].position.y == pytest.approx(ahead[0], abs=1e-6)
    moves = [said.transforms[0] for _, said in reader.on("/tf")]
    assert {(move.header.frame_id, move.child_frame_id) for move in moves} == {("map", "lauv_noptilus_1")}
    assert [move.transform.translation.y for move in moves] == [pose.position.y for pose in poses]
    assert reader.metadata["map"]["latitude_rad"] == "0.7"


@pytest.mark.heavy
def test_every_message_of_the_schema_is_read_as_it_is(make_log, tmp_path):
    schema = imc.builtin()
    messages = [filled(schema, schema.by_id(number), 2).replace(**HEADER) for number in sorted(schema.types_by_id)]
    source = source_of(make_log(messages))
    export_mcap(source, tmp_path / "a.mcap", raw=False)
    reader, seen = Reader(tmp_path / "a.mcap"), set()
    for channel, message, said in reader.messages:
        if said.__msgtype__.startswith("imc_msgs"):
            check_equal(schema, imc.decode(imc.encode(messages[message.sequence])), said)
            seen.add(channel.metadata["message"])
    assert seen == set(schema.types)
    assert not source.skipped


def filled(schema, cls, depth):
    """A message with a value in each field."""
    values = {}
    for field in schema.types_by_id[cls.ID].fields:
        code = WIRE_CODES[field.type]
        if code in "ML":
            allowed = sorted(schema.allowed_messages(field.message_type)) or ["Goto"]
            items = [filled(schema, schema[allowed[0]], depth - 1)] * 2 if depth else []
            values[field.attribute] = tuple(items) if code == "L" else (items[0] if items else None)
        else:
            values[field.attribute] = VALUES[code]
    return cls(**values)


def test_what_ros_cannot_hold_comes_back_too_and_is_reported(make_log, tmp_path):
    odd = [
        imc.encode(imc.Heartbeat(**HEADER)),
        imc.encode(imc.EstimatedState(x=1.5, **HEADER), "big"),
        imc.encode(imc.Unknown(id=9999, payload=b"abc", **HEADER)),
        imc.encode(imc.EstimatedState(x=2.5, surplus=b"newer", **HEADER)),
        imc.encode(imc.LogBookControl(msg=(imc.Heartbeat(),), **HEADER)),
        imc.encode(imc.LogBookControl(msg=(None, imc.LogBookEntry(text="a")), **HEADER)),
        imc.encode(imc.Heartbeat(**{**HEADER, "timestamp": math.nan})),
        imc.encode(imc.Heartbeat(**{**HEADER, "timestamp": -1.0})),
        imc.encode(imc.LogBookEntry(text="\udcff", **HEADER)),
    ]
    source = source_of(make_log(odd))
    export_mcap(source, tmp_path / "a.mcap")
    assert source.skipped == {"message id 9999 is unknown": 1, "LogBookControl.msg holds Heartbeat": 1}
    reader = Reader(tmp_path / "a.mcap")
    states = reader.on("/lauv_noptilus_1/EstimatedState/entity_7")
    assert [said.x for _, said in states] == [1.5, 2.5]
    assert [len(said.msg) for _, said in reader.on("/lauv_noptilus_1/LogBookControl/entity_7")] == [1]
    assert [m.log_time for m, _ in reader.on("/lauv_noptilus_1/Heartbeat/entity_7")] == [1_700_000_000 * 10**9] * 3
    (tmp_path / "back").mkdir()
    import_mcap(tmp_path / "a.mcap", tmp_path / "back")
    assert packets_of(imc.Log(tmp_path / "back")) == odd


def test_good_packets_of_a_damaged_log_are_exported(make_log, tmp_path):
    packets = [imc.encode(imc.Rpm(value=number, **HEADER)) for number in range(50)]
    packets[20] = packets[20][:-1] + b"\0"
    packets[30] = b"garbage"
    source = source_of(make_log(packets, compression="none"))
    export_mcap(source, tmp_path / "a.mcap")
    found = [said.value for _, said in Reader(tmp_path / "a.mcap").on("/lauv_noptilus_1/Rpm/entity_7")]
    assert found == [number for number in range(50) if number not in (20, 30)]
    assert len(source.log.losses) == 2


def test_names_that_ros_writes_alike_stay_apart(make_log, tmp_path):
    infos = [imc.EntityInfo(id=n, label=f"GPS{mark}1", **{**HEADER, "src_ent": n}) for n, mark in ((1, " "), (2, "-"))]
    export_mcap(source_of(make_log(infos)), tmp_path / "a.mcap")
    topics = {topic for topic in Reader(tmp_path / "a.mcap").topics if "EntityInfo" in topic}
    assert topics == {"/lauv_noptilus_1/EntityInfo/GPS_1", "/lauv_noptilus_1/EntityInfo/GPS_1_2"}


def packed(form):
    data = io.BytesIO()
    Image.new("RGB", (64, 48)).save(data, format=form)
    return data.getvalue()


def test_pictures_of_the_log_are_shown_when_they_were_taken(make_log, tmp_path):
    log = make_log([imc.Heartbeat(**HEADER)])
    (log / "Photos").mkdir()
    (log / "Photos" / "Front_Camera_000003_0.500.png").write_bytes(png := packed("PNG"))
    (log / "Photos" / "1700000002.25.jpg").write_bytes(jpeg := packed("JPEG"))
    (log / "Photos" / "readme.png").write_bytes(b"no time")
    export_mcap(source_of(log), tmp_path / "a.mcap")
    reader = Reader(tmp_path / "a.mcap")
    ((message, said),) = reader.on("/lauv_noptilus_1/Front_Camera/image")
    assert (message.log_time, bytes(said.data), said.format) == (1_700_000_000_500_000_000, png, "png")
    ((message, said),) = reader.on("/lauv_noptilus_1/Camera/image")
    assert (message.log_time, bytes(said.data), said.format) == (1_700_000_002_250_000_000, jpeg, "jpeg")
    export_mcap(source_of(log), tmp_path / "b.mcap", images=False)
    assert "/lauv_noptilus_1/Camera/image" not in Reader(tmp_path / "b.mcap").topics


def test_cameras_have_their_models_and_places(make_log, tmp_path):
    """As a vehicle writes them to Photos/cameras.yaml."""
    log = make_log([imc.Heartbeat(**HEADER)])
    mounts = {"Front Camera": Pose(0.5, -0.1, 0.2, 0.0, 0.0, math.pi / 2), "Odd": DOWN}
    pinhole = PinholeModel(64, 48, 40.0, 41.0, 32.5, 24.5, -0.1, 0.01, 1e-3, 2e-3)
    models = {"Front Camera": pinhole, "Odd": DoubleSphereModel(64, 48, 40.0, 40.0, 32.5, 24.5, 0.1, 0.6)}
    write_cameras(log / "Photos", {name: (models[name], mount) for name, mount in mounts.items()})
    for camera in ("Front_Camera", "Odd"):
        (log / "Photos" / f"{camera}_000000_1700000000.500000.png").write_bytes(packed("PNG"))
    source = source_of(log)
    export_mcap(source, tmp_path / "a.mcap")
    assert source.notes == ["no CameraInfo of Odd: ROS has no model ds with none"]
    reader = Reader(tmp_path / "a.mcap")
    ((message, info),) = reader.on("/lauv_noptilus_1/Front_Camera/camera_info")
    assert (message.log_time, info.width, info.height) == (1_700_000_000_500_000_000, 64, 48)
    assert (info.distortion_model, list(info.d)) == ("plumb_bob", [-0.1, 0.01, 1e-3, 2e-3, 0.0])
    assert list(info.k) == [40.0, 0.0, 32.0, 0.0, 41.0, 24.0, 0.0, 0.0, 1.0]
    assert list(info.p)[:7] == [40.0, 0.0, 32.0, 0.0, 0.0, 41.0, 24.0]
    assert "/lauv_noptilus_1/Odd/camera_info" not in reader.topics, "ROS has no double sphere"
    found = {said.transforms[0].child_frame_id: said.transforms[0] for _, said in reader.on("/tf")}
    assert set(found) == {"lauv_noptilus_1/Front_Camera", "lauv_noptilus_1/Odd"}
    front = found["lauv_noptilus_1/Front_Camera"]
    ((_, picture),) = reader.on("/lauv_noptilus_1/Front_Camera/image")
    assert picture.header.frame_id == info.header.frame_id == front.child_frame_id
    assert front.header.frame_id == "lauv_noptilus_1"
    place, turn = front.transform.translation, front.transform.rotation
    assert (place.x, place.y, place.z) == pytest.approx((0.5, 0.1, -0.2))
    w, x, y, z = turn.w, turn.x, turn.y, turn.z
    ahead = [2 * (x * z + w * y), 2 * (y * z - w * x), 1 - 2 * (x * x + y * y)]
    assert ahead == pytest.approx([0.0, -1.0, 0.0], abs=1e-9), "to starboard"
