"""The cameras of a shipped vehicle as components of their own: pictures, detections, settings."""

import json
import math
import re
import struct
import subprocess
import sys
import threading
from pathlib import Path

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

import imc
from imc.coordinates import displacement
from mavlink import FLAVOURS, encode, load_dialect, split
from runtime.kernel import parse_clock
from runtime.profile import load_profile
from runtime.vehicle import build
from shoal.missions import prepare
from tasks.transports.mavlink import MAVLink
from tasks.transports.mavlink_protocol.camera_streams import ALL
from tasks.transports.mavlink_protocol.cameras import parse_video
from tasks.transports.mavlink_protocol.links import Link
from tests.outside import free_port

DIALECT = load_dialect()
PROFILE = "lauv-noptilus-1"
FISHEYE, MUG = 100, 101
ACCEPTED, REJECTED, DENIED, UNSUPPORTED = range(4)
REQUEST_MESSAGE, START, STOP = 512, 2000, 2001
TEXT, REAL32, INT32 = 11, 9, 6
PATIENCE = 60.0


class Dive:
    """An AUV with both cameras, and a ground station without a socket."""

    def __init__(self, folder, **parameters):
        quiet = [f"Vision.FisheyeCamera:{option}" for option in ("Save Images=false", "Size=64", "Face Size=32")]
        loaded = load_profile(PROFILE, overrides=quiet)
        made = build(
            loaded,
            loaded.select(["Kinematic", "Camera"]),
            clock=parse_clock("virtual", loaded.start_time_ns),
            log_root=folder / "log",
            state_folder=folder / "db",
        )
        self.vehicle = made.vehicle
        links = [f"udpin:127.0.0.1:{free_port()}:px4"]
        self.task = self.vehicle.add(MAVLink, "Transports.MAVLink", links=links, **{"peer_timeout": 1e6, **parameters})
        self.truths, self.mugs = [], []
        self.vehicle.tap(imc.SimulatedState, self.truths.append)
        self.vehicle.tap(imc.EstimatedMugState, self.mugs.append)
        self.vehicle.start()
        self.run(2.0)
        self.sessions = [self._meet(number) for number in range(2)]

    def _meet(self, number):
        frames = []
        link: Link = self.task.open_links[0]
        session = link.sessions["station", number] = self.task.meet(FLAVOURS["px4"], frames.append)
        session.frames = frames
        return session

    def run(self, seconds):
        self.vehicle.run(seconds)

    def said(self, station=0):
        """What a station got since the last call."""
        frames = self.sessions[station].frames
        found = [message for frame in frames for message in split(frame, DIALECT)[0]]
        frames.clear()
        return found

    def ask(self, name, component=FISHEYE, *, station=0, seconds=0.4, **fields):
        """The answers of cameras and autopilot to a message, without what is streamed."""
        definition = DIALECT.by_name[name]
        fields = {"target_system": self.task.autopilot.system, "target_component": component, **fields}
        (message,), _ = split(encode(definition, definition.pack(fields), 0, 255, 190), DIALECT)
        self.said(station)
        self.task.obey(self.sessions[station], message)
        if seconds:
            self.run(seconds)
        streams = {name for name, rate in self.task.rates.items() if rate} | {"CAMERA_TRACKING_GEO_STATUS"}
        streams |= {"ADSB_VEHICLE"}
        return [m for m in self.said(station) if m.name not in streams and (m.name, m.component) != ("STATUSTEXT", 1)]

    def order(self, command, *params, component=FISHEYE, **more):
        """The result of an order and what else came."""
        named = {f"param{number}": value for number, value in enumerate(params, 1)}
        found = self.ask("COMMAND_LONG", component, command=command, **named, **more)
        (ack,) = [m for m in found if m.name == "COMMAND_ACK"]
        assert (ack.values["command"], ack.values["target_system"]) == (command, 255)
        return ack.values["result"], [m for m in found if m is not ack]

    def texts(self, station=0):
        return [m.values["text"].decode() for m in self.said(station) if m.name == "STATUSTEXT"]


@pytest.fixture(scope="module")
def dive(tmp_path_factory):
    """Under water, on its first circle."""
    found = Dive(tmp_path_factory.mktemp("vehicle"), detection_markers=True)
    found.run(40.0)
    yield found
    found.vehicle.close()


@pytest.fixture(autouse=True)
def attentive(dive):
    """Both stations are heard of, and have read everything."""
    for station in range(2):
        dive.ask("HEARTBEAT", 0, station=station, seconds=0, type=6)


def pose(event):
    """Latitude and longitude in degrees, depth in m."""
    told = dict(item.split("=") for item in event.data.split(";"))
    return tuple(float(told[name]) for name in ("lat", "lon", "depth"))


def named(messages, name):
    return [m for m in messages if m.name == name]


def test_each_camera_is_a_component_with_its_own_numbers(dive):
    dive.said()
    dive.run(3.0)
    found = dive.said()
    for component, kind, autopilot in ((1, 12, 12), (FISHEYE, 30, 8), (MUG, 30, 8)):
        mine = [m for m in found if m.component == component]
        beats = named(mine, "HEARTBEAT")
        assert len(beats) == 3
        assert (beats[0].values["type"], beats[0].values["autopilot"]) == (kind, autopilot)
        first = mine[0].sequence
        assert [m.sequence for m in mine] == [(first + n) % 256 for n in range(len(mine))]


def test_a_camera_says_what_it_is(dive):
    for component, model, size, flags in (
        (FISHEYE, b"Fisheye Camera", (64, 64), 2),
        (MUG, b"MUG Camera", (1280, 960), 2048),
    ):
        for asked in (dive.order(REQUEST_MESSAGE, 259, component=component), dive.order(521, 1, component=component)):
            result, (about,) = asked
            assert (result, about.name, about.component) == (ACCEPTED, "CAMERA_INFORMATION", component)
            values = about.values
            assert bytes(values["model_name"]).rstrip(b"\0") == model
            assert (values["resolution_h"], values["resolution_v"], values["flags"]) == (*size, flags)
            assert math.isnan(values["focal_length"])
        for number, old, name in (
            (260, 522, "CAMERA_SETTINGS"),
            (261, 525, "STORAGE_INFORMATION"),
            (262, 527, "CAMERA_CAPTURE_STATUS"),
        ):
            for command, *params in ((REQUEST_MESSAGE, number), (old, 1)):
                result, (message,) = dive.order(command, *params, component=component)
                assert (result, message.name, message.component) == (ACCEPTED, name, component)
    _, (storage,) = dive.order(REQUEST_MESSAGE, 261)
    total, used, free = (storage.values[f"{part}_capacity"] for part in ("total", "used", "available"))
    assert 0 < free < total >= used > 0
    assert dive.order(REQUEST_MESSAGE, 269)[0] == dive.order(2504, 1)[0] == UNSUPPORTED, "it has no video"
    assert dive.order(REQUEST_MESSAGE, 148)[0] == UNSUPPORTED, "that is the autopilot's"
    assert dive.order(REQUEST_MESSAGE, 259, component=1)[0] == UNSUPPORTED


def test_each_station_chooses_the_rates_of_a_camera(dive):
    assert dive.order(511, 262, 500_000)[0] == ACCEPTED
    dive.said(), dive.said(1)
    dive.run(2.0)
    assert len(named(dive.said(), "CAMERA_CAPTURE_STATUS")) == 4
    assert not named(dive.said(1), "CAMERA_CAPTURE_STATUS")
    assert dive.order(510, 262)[1][0].values["interval_us"] == 500_000
    assert dive.order(511, 262, -1)[0] == ACCEPTED
    assert dive.order(511, 30, 100_000)[0] == DENIED


def test_a_picture_is_taken_where_and_when_it_says(dive):
    before = dive.task.autopilot.cameras[0].taken
    dive.said(1)
    result, _ = dive.order(START, 0, 0, 1, 0)
    assert result == ACCEPTED
    dive.run(2.0)
    (shown,) = named(dive.said(1), "CAMERA_IMAGE_CAPTURED")
    values = shown.values
    assert (shown.component, values["image_index"], values["capture_result"]) == (FISHEYE, before, 1)
    truth = min(dive.truths, key=lambda t: abs(t.timestamp - values["time_utc"] / 1e6))
    assert truth.timestamp == pytest.approx(values["time_utc"] / 1e6, abs=0.1)
    lat, lon = (math.radians(values[name] * 1e-7) for name in ("lat", "lon"))
    reference = imc.EstimatedState(lat=truth.lat, lon=truth.lon, x=truth.x, y=truth.y)
    north, east, _ = displacement(reference.lat, reference.lon, 0.0, lat, lon, 0.0)
    assert math.hypot(north - truth.x, east - truth.y) < 5.0, "the navigation's error is a few meters"
    assert values["relative_alt"] == pytest.approx(-1000 * truth.z, abs=700)
    w, _, _, z = values["q"]
    assert math.cos(2 * math.atan2(z, w) - truth.psi) > math.cos(0.1)
    url = values["file_url"]
    assert url.startswith(b"mftp://[;comp=1]/logs/")
    file = dive.task.autopilot.transfers._files._tree.open(url)
    assert file.read(0, 8) == b"\x89PNG\r\n\x1a\n"
    file.close()
    result, (again,) = dive.order(REQUEST_MESSAGE, 263, before)
    assert (result, again.values) == (ACCEPTED, values)
    assert dive.order(REQUEST_MESSAGE, 263, before + 1)[0] == DENIED
    assert dive.order(REQUEST_MESSAGE, 263, math.inf)[0] == DENIED


def test_a_repeated_order_takes_one_picture(dive):
    for _ in range(3):
        assert dive.order(START, 0, 0, 1, 77)[0] == ACCEPTED
    dive.run(4.0)
    assert len(named(dive.said(1), "CAMERA_IMAGE_CAPTURED")) == 1


def test_a_series_goes_on_until_it_is_stopped(dive):
    dive.said(1)
    assert dive.order(START, 0, 2.0, 0, 0)[0] == ACCEPTED
    dive.run(7.0)
    (status,) = dive.order(527, 1)[1]
    assert (status.values["image_status"], status.values["image_interval"]) == (2, 2.0)
    assert dive.order(STOP)[0] == ACCEPTED
    dive.run(1.0)
    assert len(named(dive.said(1), "CAMERA_IMAGE_CAPTURED")) == 4
    dive.run(5.0)
    assert not named(dive.said(1), "CAMERA_IMAGE_CAPTURED")
    (status,) = dive.order(527, 1)[1]
    assert status.values["image_status"] == 0
    assert status.values["image_count"] == dive.task.autopilot.cameras[0].taken


def test_stop_also_ends_the_saving_of_each_image(dive):
    camera = dive.vehicle.task("Vision.FisheyeCamera")
    dive.ask("PARAM_EXT_SET", param_id=b"SAVE_IMAGES", param_value=struct.pack("<i", 1), param_type=INT32)
    assert camera.save_images
    dive.order(STOP)
    assert not camera.save_images


def test_pictures_that_make_no_sense_are_denied(dive):
    for params in ((0, 0, -1), (0, math.nan, 2), (0, -1, 0), (0, 0, math.nan), (0, math.inf, 0), (0, 0, 0.5)):
        assert dive.order(START, *params)[0] == DENIED
    assert dive.order(START, 0, 0, 1, component=MUG)[0] == UNSUPPORTED
    assert dive.order(530, 0, 0)[0] == ACCEPTED
    assert dive.order(530, 0, 1)[0] == DENIED


def test_an_order_to_all_is_for_those_who_know_it(dive):
    found = dive.ask("COMMAND_LONG", 0, command=521, param1=1)
    assert sorted((m.name, m.component) for m in found) == [
        ("CAMERA_INFORMATION", FISHEYE),
        ("CAMERA_INFORMATION", MUG),
        ("COMMAND_ACK", FISHEYE),
        ("COMMAND_ACK", MUG),
    ]
    for command, params in ((520, (1,)), (REQUEST_MESSAGE, (148,)), (31000, ())):
        named_ = {f"param{number}": value for number, value in enumerate(params, 1)}
        acks = named(dive.ask("COMMAND_LONG", 0, command=command, **named_), "COMMAND_ACK")
        assert [m.component for m in acks] == [1]
    assert not dive.ask("COMMAND_LONG", 102, command=520)


def test_a_detected_glider_is_shown_where_it_is(dive):
    dive.said()
    count = len(dive.mugs)
    for _ in range(300):
        dive.run(1.0)
        if len(dive.mugs) > count:
            break
        dive.said()
    mug, truth = dive.mugs[-1], dive.truths[-1]
    dive.run(1.0)
    found = dive.said()
    shown = named(found, "CAMERA_TRACKING_GEO_STATUS")[-1]
    assert (shown.component, shown.values["tracking_status"]) == (MUG, 1)
    for message in (shown, named(found, "ADSB_VEHICLE")[-1]):
        lat, lon = (math.radians(message.values[name] * 1e-7) for name in ("lat", "lon"))
        north, east, _ = displacement(truth.lat, truth.lon, 0.0, lat, lon, 0.0)
        assert (north - truth.x, east - truth.y) == pytest.approx((mug.x, mug.y), abs=8.0)
    assert shown.values["dist"] > math.hypot(mug.x, mug.y) - 3.0
    assert message.values["callsign"] == b"MUG 1"
    dive.vehicle.task("Simulators.MUGDetectionCamera").detection_rate = 0.001
    dive.run(5.0)
    dive.said()
    dive.run(2.0)
    later = dive.said()
    assert not named(later, "CAMERA_TRACKING_GEO_STATUS")
    assert named(later, "ADSB_VEHICLE")[-1].values["tslc"] >= 6
    dive.run(60.0)
    dive.said()
    dive.run(2.0)
    assert not named(dive.said(), "ADSB_VEHICLE")


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


def test_a_camera_in_trouble_says_why_it_takes_no_picture(dive):
    camera = dive.vehicle.task("Vision.FisheyeCamera")
    state = camera.entity.state
    camera.entity.state = imc.EntityState.State.FAULT
    result, found = dive.order(START, 0, 0, 1, 0)
    camera.entity.state = state
    assert result == REJECTED
    assert any(b"Fisheye Camera is in FAULT" in m.values["text"] for m in named(found, "STATUSTEXT"))


@settings(max_examples=300)
@given(st.data())
def test_no_message_to_a_camera_raises(dive, data):
    definition = data.draw(st.sampled_from(list(DIALECT.by_id.values())))
    payload = bytearray(definition.fill(data.draw(st.binary(max_size=255))))
    place = 0
    for field in definition.fields:
        size = struct.calcsize(f"<{field.length or ''}{field.kind}")
        if field.name in ("target_system", "target_component"):
            payload[place] = dive.task.autopilot.system if field.name == "target_system" else FISHEYE
        place += size
    (message,), _ = split(encode(definition, bytes(payload), 0, 255, 190), DIALECT)
    dive.task.obey(dive.sessions[1], message)
    dive.said(1)


@settings(max_examples=300)
@given(
    st.sampled_from([510, 511, 512, 521, 522, 525, 527, 530, 2000, 2001, 2504, 2505]),
    st.lists(st.floats(width=32), min_size=7, max_size=7),
    st.sampled_from([FISHEYE, MUG]),
)
def test_no_order_to_a_camera_raises(dive, command, params, component):
    fields = {f"param{number}": value for number, value in enumerate(params, 1)}
    found = dive.ask("COMMAND_LONG", component, seconds=0, command=command, **fields)
    assert [m.component for m in named(found, "COMMAND_ACK")] == [component]


def test_a_camera_has_the_video_of_the_profile(tmp_path):
    address = "rtsp://127.0.0.1:8554/down"
    dive = Dive(tmp_path, video_streams=[f"Fisheye Camera={address}"], peer_timeout=60.0)
    for command, *params in ((REQUEST_MESSAGE, 269), (2504, 0)):
        result, (video,) = dive.order(command, *params)
        assert (result, video.name, video.values["uri"]) == (ACCEPTED, "VIDEO_STREAM_INFORMATION", address.encode())
        assert (video.values["count"], video.values["type"], video.values["hfov"]) == (1, 0, 180)
    assert dive.order(521)[1][0].values["flags"] == 2 | 256
    assert dive.order(2504, 0, component=MUG)[0] == UNSUPPORTED
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


def test_a_mission_switches_the_camera(dive):
    chosen = dive.task.autopilot.mission_settings()
    assert (chosen.camera, chosen.switch) == ("Fisheye Camera", "Save Images")


def test_mavsdk_uses_the_cameras(tmp_path):
    port = free_port()
    options = [f"Transports.MAVLink:Links=udpout:127.0.0.1:{port}:px4", "Vision.FisheyeCamera:Save Images=false"]
    options += ["Vision.FisheyeCamera:Size=128", "Vision.FisheyeCamera:Frame Rate=5"]
    profiles = ["Kinematic", "Camera"]
    folders = {"log_root": tmp_path / "log", "state_folder": tmp_path / "db"}
    vehicle = prepare(PROFILE, profiles, clock="2x", overrides=options, **folders).vehicle
    told = []
    vehicle.tap(imc.Event, lambda event: told.append(pose(event)) if event.topic == "Picture" else None)
    vehicle.start()
    thread = threading.Thread(target=vehicle.run, daemon=True)
    thread.start()
    try:
        command = [sys.executable, str(Path(__file__).with_name("mavsdk_camera_client.py")), str(port)]
        done = subprocess.run(command, capture_output=True, text=True, timeout=PATIENCE, check=False)
    finally:
        vehicle.kernel.post(vehicle.stop)
        thread.join(PATIENCE)
        vehicle.close()
    assert done.stdout, done.stderr
    seen = json.loads(done.stdout)
    assert seen["cameras"] == [
        [FISHEYE, "Shoal", "Fisheye Camera", 128, 128],
        [MUG, "Shoal", "MUG Camera", 1280, 960],
    ]
    component, success, index, url = seen["shot"]
    assert (component, success, index) == (FISHEYE, True, 0)
    assert (tmp_path / "log" / PROFILE / url.partition("/logs/")[2]).read_bytes().startswith(b"\x89PNG")
    lat, lon, altitude = seen["place"]
    assert (lat, lon) == pytest.approx(told[0][:2], abs=1e-6)
    assert altitude == pytest.approx(-told[0][2], abs=2e-3)
    assert sum(seen["settings"]) > 10
    assert (seen["scene"], seen["rate"]) == ("Sea Surface", 2.5)


def test_the_documentation_lists_what_cameras_say(dive):
    page = (Path(__file__).parents[3] / "docs" / "mavlink.md").read_text()
    section = page.partition("## Cameras")[2].partition("\n## ")[0]
    rows = re.findall(r"^\| ([A-Z0-9_]+) \| (.+?) \| (.+?) \|$", section, re.MULTILINE)
    shown = [(name, float(hertz) if hertz.isdecimal() else 0.0, sources) for name, hertz, sources in rows]
    assert shown == [(name, rate, sources) for name, rate, sources, _ in ALL]
    said = [stream for camera in dive.task.autopilot.cameras for stream in camera.streams.values()]
    assert {(stream.name, stream.rate, stream.sources) for stream in said} < set(shown)
