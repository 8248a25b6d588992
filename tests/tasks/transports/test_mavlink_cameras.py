"""The cameras of a shipped vehicle as components of their own: pictures, detections, settings."""

import io
import json
import math
import struct
import subprocess
import sys
import threading
from pathlib import Path

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from PIL import Image

import imc
from mavlink import encode, split
from shoal.missions import prepare
from support.wgs84 import displacement
from tests.outside import free_port, until
from tests.tasks.transports.mavlink_dive import (
    ACCEPTED,
    DENIED,
    DIALECT,
    FISHEYE,
    INT32,
    MUG,
    PATIENCE,
    PROFILE,
    REJECTED,
    REQUEST_MESSAGE,
    START,
    STOP,
    UNSUPPORTED,
    named,
)
from tests.tasks.transports.mavlink_station import deliver


def pose(event):
    """Latitude and longitude in degrees, depth in m."""
    told = dict(item.split("=") for item in event.data.split(";"))
    return tuple(float(told[name]) for name in ("lat", "lon", "depth"))


@pytest.mark.heavy
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
    before = dive.task.endpoint.cameras[0].taken
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
    file = dive.task.endpoint._files._files._tree.open(url)
    assert file.read(0, 8) == b"\x89PNG\r\n\x1a\n"
    file.close()
    result, (again,) = dive.order(REQUEST_MESSAGE, 263, before)
    assert (result, again.values) == (ACCEPTED, values)
    assert dive.order(REQUEST_MESSAGE, 263, before + 1)[0] == DENIED
    assert dive.order(REQUEST_MESSAGE, 263, math.inf)[0] == DENIED


def test_the_last_picture_comes_as_a_thumbnail(dive):
    dive.order(START, 0, 0, 1, 0)
    dive.run(2.0)
    found = dive.ask("DATA_TRANSMISSION_HANDSHAKE", type=1, jpg_quality=60, seconds=2.0)
    (about,) = named(found, "DATA_TRANSMISSION_HANDSHAKE")
    pieces = named(found, "ENCAPSULATED_DATA")
    assert {m.component for m in (about, *pieces)} == {FISHEYE}
    assert [m.values["seqnr"] for m in pieces] == list(range(about.values["packets"]))
    jpeg = b"".join(bytes(m.values["data"]) for m in pieces)[: about.values["size"]]
    with Image.open(io.BytesIO(jpeg)) as picture:
        picture.load()
        assert (picture.format, picture.size) == ("JPEG", (about.values["width"], about.values["height"]))
    assert not named(dive.ask("DATA_TRANSMISSION_HANDSHAKE", type=1, size=10, packets=1), "ENCAPSULATED_DATA")


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
    assert status.values["image_count"] == dive.task.endpoint.cameras[0].taken


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


@pytest.mark.heavy
@pytest.mark.computing
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
def test_no_message_to_a_camera_raises(diving, data):
    definition = data.draw(st.sampled_from(list(DIALECT.by_id.values())))
    payload = bytearray(definition.pad_payload(data.draw(st.binary(max_size=255))))
    place = 0
    for field in definition.fields:
        size = struct.calcsize(f"<{field.length or ''}{field.kind}")
        if field.name in ("target_system", "target_component"):
            payload[place] = diving.task.endpoint.model.system if field.name == "target_system" else FISHEYE
        place += size
    (message,), _ = split(encode(definition, bytes(payload), 0, 255, 190), DIALECT)
    deliver(diving.task, diving.sessions[1], message)
    diving.said(1)


@settings(max_examples=300)
@given(
    st.sampled_from([510, 511, 512, 521, 522, 525, 527, 530, 2000, 2001, 2504, 2505]),
    st.lists(st.floats(width=32), min_size=7, max_size=7),
    st.sampled_from([FISHEYE, MUG]),
)
def test_no_order_to_a_camera_raises(diving, command, params, component):
    fields = {f"param{number}": value for number, value in enumerate(params, 1)}
    found = diving.ask("COMMAND_LONG", component, seconds=0, command=command, **fields)
    assert [m.component for m in named(found, "COMMAND_ACK")] == [component]


def test_a_mission_switches_the_camera(dive):
    chosen = dive.task.endpoint.model.conversion_settings()
    assert (chosen.camera, chosen.switch) == ("Fisheye Camera", "Save Images")


@pytest.mark.heavy
def test_mavsdk_uses_the_cameras(tmp_path):
    port = free_port()
    options = [f"Transports.MAVLink:Links=udpout:127.0.0.1:{port}:px4", "Vision.FisheyeCamera:Save Images=false"]
    options += ["Vision.FisheyeCamera:Size=128", "Vision.FisheyeCamera:Frame Rate=5"]
    profiles = ["Kinematic", "Camera"]
    folders = {"log_root": tmp_path / "log", "state_folder": tmp_path / "db"}
    vehicle = prepare(PROFILE, profiles, clock="2x", overrides=options, **folders).vehicle
    told = []
    vehicle.observe(imc.Event, lambda event: told.append(pose(event)) if event.topic == "Picture" else None)
    vehicle.start()
    thread = threading.Thread(target=vehicle.run, daemon=True)
    thread.start()
    try:
        camera = vehicle.task("Vision.FisheyeCamera").entity
        assert until(lambda: camera.state == imc.EntityState.State.NORMAL), "before its first frame it takes no picture"
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
