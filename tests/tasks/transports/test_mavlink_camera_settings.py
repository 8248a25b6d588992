"""The cameras of a shipped vehicle: what a ground station or the profile sets, and what the documentation says."""

import math
import re
import struct
from pathlib import Path

import pytest

from mavlink.vehicle.camera.camera_telemetry import ALL
from mavlink.vehicle.camera.component import parse_video
from tests.tasks.transports.mavlink_dive import (
    ACCEPTED,
    FISHEYE,
    INT32,
    MUG,
    REAL32,
    REQUEST_MESSAGE,
    TEXT,
    UNSUPPORTED,
    Dive,
    named,
)


@pytest.mark.heavy
def test_settings_are_numbers_texts_and_lists(dive):
    found = named(dive.ask("PARAM_EXT_REQUEST_LIST", seconds=2.0), "PARAM_EXT_VALUE")
    values = {m.values["param_id"]: m.values for m in found}
    assert [m.values["param_index"] for m in found] == list(range(found[0].values["param_count"]))
    assert {m.component for m in found} == {FISHEYE}
    assert (values[b"SCENE"]["param_value"], values[b"SCENE"]["param_type"]) == (b"Seabed", TEXT)
    assert (values[b"MUGS"]["param_value"], values[b"MUGS"]["param_type"]) == (b"1.0 0.3", TEXT)
    assert values[b"FRAME_RATE"]["param_type"] == REAL32
    assert values[b"SAVE_IMAGES"]["param_type"] == INT32
    (one,) = dive.ask("PARAM_EXT_REQUEST_READ", param_id=b"SCENE", param_index=-1)
    assert one.values == values[b"SCENE"]
    (one,) = dive.ask("PARAM_EXT_REQUEST_READ", param_index=found[3].values["param_index"])
    assert one.values == found[3].values


@pytest.mark.parametrize(
    ("name", "value", "kind", "attribute", "expected"),
    [
        (b"SCENE", b"Sea Surface", TEXT, "scene", "Sea Surface"),
        (b"SCENE", b"Seabed", TEXT, "scene", "Seabed"),
        (b"MUGS", b"1 2, 3 4", TEXT, "mugs", ["1 2", "3 4"]),
        (b"FRAME_RATE", struct.pack("<f", 0.9), REAL32, "frame_rate", 0.9),
        (b"FRAME_RATE", struct.pack("<f", 1.0), REAL32, "frame_rate", 1.0),
    ],
)
def test_a_setting_is_changed_and_all_learn_it(dive, name, value, kind, attribute, expected):
    dive.said(1)
    found = dive.ask("PARAM_EXT_SET", param_id=name, param_value=value, param_type=kind)
    (ack,) = named(found, "PARAM_EXT_ACK")
    assert (ack.component, ack.values["param_id"], ack.values["param_result"]) == (FISHEYE, name, 0)
    assert getattr(dive.vehicle.task("Vision.FisheyeCamera"), attribute) == expected
    (told,) = named(dive.said(1), "PARAM_EXT_VALUE")
    assert told.values["param_value"] == ack.values["param_value"]


@pytest.mark.parametrize(
    ("name", "value", "kind", "result"),
    [
        (b"SCENE", b"Moon", TEXT, 1),
        (b"SCENE", b"\xff\xfe", TEXT, 1),
        (b"SCENE", struct.pack("<i", 1), INT32, 1),
        (b"FRAME_RATE", struct.pack("<f", math.nan), REAL32, 1),
        (b"FRAME_RATE", struct.pack("<f", -1.0), REAL32, 1),
        (b"SAVE_IMAGES", struct.pack("<i", 7), INT32, 1),
        (b"NOTHING", b"x", TEXT, 1),
        (b"VISIBILITY", struct.pack("<f", 0.01), REAL32, 2),  # valid, but the task refuses it
    ],
)
def test_a_bad_setting_is_refused(dive, name, value, kind, result):
    before = dive.vehicle.task("Vision.FisheyeCamera").parameter_set.snapshot()
    found = dive.ask("PARAM_EXT_SET", param_id=name, param_value=value, param_type=kind, seconds=2.0)
    (ack,) = named(found, "PARAM_EXT_ACK")
    assert (ack.values["param_id"], ack.values["param_result"]) == (name, result)
    assert dive.vehicle.task("Vision.FisheyeCamera").parameter_set.snapshot() == before


def test_a_long_text_is_cut_and_not_lost(dive):
    camera = dive.vehicle.task("Vision.FisheyeCamera")
    before, camera.mugs = camera.mugs, [f"{n} {n}" for n in range(60)]
    (shown,) = dive.ask("PARAM_EXT_REQUEST_READ", param_id=b"MUGS", param_index=-1)
    value = shown.values["param_value"]
    assert len(value) <= 128
    assert value.decode().endswith("…")
    (ack,) = named(dive.ask("PARAM_EXT_SET", param_id=b"MUGS", param_value=value, param_type=TEXT), "PARAM_EXT_ACK")
    assert ack.values["param_result"] == 0
    assert len(camera.mugs) == 60
    camera.mugs = before


def test_a_camera_has_the_video_of_the_profile(tmp_path):
    address = "rtsp://127.0.0.1:8554/down"
    dive = Dive(tmp_path, video_streams=[f"Fisheye Camera={address}"], peer_timeout=60.0)
    for command, *params in ((REQUEST_MESSAGE, 269), (2504, 0)):
        result, (video,) = dive.order(command, *params)
        assert (result, video.name, video.values["uri"]) == (ACCEPTED, "VIDEO_STREAM_INFORMATION", address.encode())
        assert (video.values["count"], video.values["type"], video.values["hfov"]) == (1, 0, 180)
    assert dive.order(521)[1][0].values["flags"] == 2 | 256
    assert dive.order(2504, 0, component=MUG)[0] == UNSUPPORTED
    (told,) = dive.ask("DATA_TRANSMISSION_HANDSHAKE", type=1)
    assert told.values["text"] == b"Fisheye Camera has taken no picture yet"
    dive.vehicle.close()


@pytest.mark.parametrize("words", ["Fisheye Camera", "Fisheye Camera=http://x", "=rtsp://x", "A=rtsp://" + "x" * 200])
def test_a_wrong_video_is_refused(words):
    with pytest.raises(ValueError, match="is not ENTITY LABEL=rtsp://ADDRESS"):
        parse_video(words)


def test_cameras_can_be_hidden(tmp_path):
    dive = Dive(tmp_path, cameras=False)
    dive.run(3.0)
    assert {m.component for m in dive.said()} == {1}
    assert not dive.ask("COMMAND_LONG", command=521)
    dive.vehicle.close()


def test_the_documentation_lists_what_cameras_say(dive):
    page = (Path(__file__).parents[3] / "docs" / "mavlink.md").read_text()
    section = page.partition("## Cameras")[2].partition("\n## ")[0]
    rows = re.findall(r"^\| ([A-Z0-9_]+) \| (.+?) \| (.+?) \|$", section, re.MULTILINE)
    shown = [(name, float(hertz) if hertz.isdecimal() else 0.0, sources) for name, hertz, sources in rows]
    assert shown == [(name, rate, sources) for name, rate, sources, _ in ALL]
    said = {pair for part in dive.sessions[0].cameras for pair in part.source.rates(False).items()}
    assert {"HEARTBEAT", "ADSB_VEHICLE"} < dict(said).keys()
    assert said < {(name, rate) for name, rate, _ in shown}
