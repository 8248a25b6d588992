"""Frames of AirSim over its own protocol, from a stand-in whose colors tell where each pixel looks."""

import math
import struct
import zlib

import msgspec
import numpy as np
import pytest
import yaml
from PIL import Image

import imc
from runtime import ParameterError, State
from runtime.kernel import WallClock
from runtime.testing import START, simulate
from runtime.vehicle.thread_pool import WorkerThreads
from support.pose import Pose
from tasks.vision.airsim import AirSim
from tasks.vision.airsim_api.rpc_messages import MessageEnd
from tests.outside import REFUSED, free_port
from tests.tasks.mission.stalling_clock import StallingClock
from tests.tasks.vision.airsim_standin import SETTINGS, StandIn, colors

LAT, LON = math.radians(41.185), math.radians(-8.7062)
PLACE = {"x": 12.0, "y": -7.0, "z": 3.0, "phi": 0.1, "theta": -0.2, "psi": 2.0}


def truth(time=0.0, **fields):
    return imc.SimulatedState(timestamp=time, lat=LAT, lon=LON, **{**PLACE, **fields})


def shot(server, seconds=0.9, feed=None, **options):
    options = {"size": 48, "frame_rate": 5.0, "timeout": 1.0, **options}
    settings = {"World": {"Origin": "41.185, -8.7062"}}
    feed = [truth(t / 10) for t in range(round(seconds * 10))] if feed is None else feed
    return simulate(AirSim, feed, seconds=seconds, port=server.port, settings=settings, **options)


def seen(frame):
    """The colors that each pixel of a frame has to have, and which pixels show anything."""
    height, width, _ = frame.image.shape
    u, v = np.meshgrid(np.arange(width) + 0.5, np.arange(height) + 0.5)
    rays, valid = frame.optics.unproject(np.stack((u, v), axis=-1))
    return colors(np.nan_to_num(rays) @ frame.pose[:3, :3].T + 1e-12), valid


def apart(frame):
    expected, valid = seen(frame)
    assert valid.sum() > 0.7 * valid.size
    return np.abs(frame.image[valid, :3].astype(int) - expected[valid].astype(int)).max()


@pytest.mark.parametrize("version", [1, 4])
def test_five_views_become_a_picture_that_looks_where_the_frame_says(version):
    with StandIn(128, 128, version) as server:
        run = shot(server, interpolation="bilinear")
        assert len(run.frames) == 4
        assert [apart(frame) <= 3 for frame in run.frames] == [True] * 4
        assert run.task.entity.state is State.NORMAL
        images = [given for method, given in server.calls if method == "simGetImages"]
        assert [len(given[0]) for given in images] == [5] * 4


def test_the_vehicle_is_where_it_truly_is_at_the_exposure():
    with StandIn() as server:
        run = shot(server, feed=[truth(0.0, u=2.0)], origin=[100.0, 0.0, -10.0])
        vehicle = Pose(*PLACE.values()).transform
        for frame in run.frames:
            there = vehicle[:3, 3] + vehicle[:3, 0] * 2.0 * (frame.time - run.vehicle.start_time)
            np.testing.assert_allclose(frame.pose[:3, 3], there + vehicle[:3, :3] @ server.lever, atol=1e-5)
        first = run.frames[0]
        np.testing.assert_allclose(first.mount[:3, 3], server.lever, atol=1e-5)
        np.testing.assert_allclose(first.mount[:3, :3], Pose(theta=-math.pi / 2).rotation @ FORWARD, atol=1e-5)
        assert server.place[0] == pytest.approx(112.0, abs=1.5)


FORWARD = np.array([[0.0, 0.0, 1.0], [1.0, 0.0, 0.0], [0.0, 1.0, 0.0]])


def test_a_stall_of_the_computer_is_no_missing_state(monkeypatch):
    monkeypatch.setattr(WorkerThreads, "submit", lambda _, title, work: work())  # however slow this computer is
    feed = [truth(t / 10) for t in range(120) if not 30 < t < 75]
    with StandIn() as server:
        run = shot(server, 12.0, feed, cameras=["front_center"], clock=StallingClock(round(START * 1e9), [(3.1, 4.35)]))
    assert len(run.frames) > 30
    assert [m.description for m in run.of(imc.EntityState) if m.state >= State.FAULT] == []


def test_one_camera_is_a_pinhole_as_airsim_has_it():
    with StandIn(80, 60, fov=80.0) as server:
        frame = shot(server, cameras=["front_center"]).frames[-1]
        assert frame.image.shape == (60, 80, 4)
        assert frame.optics.fx == pytest.approx(40 / math.tan(math.radians(40)))
        assert apart(frame) <= 1


@pytest.mark.parametrize("options", [{"compress": True}, {"depth": 4}, {}])
def test_all_forms_of_pixels_are_one_picture(options):
    with StandIn() as server:
        server.depth = options.pop("depth", 3)
        assert apart(shot(server, cameras=["front_center"], **options).frames[0]) <= 1


def test_six_views_fill_more_than_five():
    with StandIn(128, 128) as server:
        six = shot(server, cameras=list(SETTINGS)[:6], field_of_view=320.0, interpolation="bilinear")
        assert apart(six.frames[0]) <= 4


def test_pictures_are_kept_on_request_with_their_camera(tmp_path):
    order = imc.Event(timestamp=0.3, topic="Take Pictures", data="count=2", dst=0x1A)
    estimate = imc.EstimatedState(timestamp=0.0, lat=LAT, lon=LON, x=11.0, depth=2.5)
    with StandIn() as server:
        feed = [estimate, *[truth(t / 10) for t in range(9)], order]
        run = shot(server, feed=feed, log_root=tmp_path, cameras=["front_center"], entity_label="Front")
    folder = tmp_path / "lauv-noptilus-1"
    told = [message for message in run.of(imc.CameraFrame) if message.file]
    assert [message.index for message in told] == [1, 2]
    for message in told:
        with Image.open(folder / message.file) as picture:
            assert np.array_equal(np.asarray(picture), run.frames[message.index].image)
    known = yaml.safe_load((folder / "Photos" / "cameras.yaml").read_text())["Front"]
    np.testing.assert_allclose(known["T_BS"], run.frames[0].mount, atol=1e-6)
    assert known["intrinsics"][0] == pytest.approx(32.0)
    assert told[0].est_x == pytest.approx(11.5, abs=0.6)


def test_airsim_moves_and_its_motion_is_the_truth():
    with StandIn() as server:
        server.place, server.turn = np.array([5.0, 6.0, -7.0]), np.array([math.sqrt(0.5), 0.0, 0.0, math.sqrt(0.5)])
        run = shot(server, feed=[], pose_from="AirSim", publish_truth=True)
        state = run.of(imc.SimulatedState)[0]
        assert (state.x, state.y, state.z) == (5.0, 6.0, -7.0)
        assert (state.psi, state.u, state.v) == pytest.approx((math.pi / 2, 3.0, 0.0), abs=1e-6)
        assert (state.p, state.q, state.r) == pytest.approx((0.1, 0.2, 0.3))
        assert (state.lat, state.lon, state.height) == pytest.approx((math.radians(41.185), math.radians(-8.706), 50.0))
        assert state.timestamp == run.frames[0].time
        np.testing.assert_allclose(run.frames[0].mount[:3, 3], server.lever, atol=1e-6)
        assert not [method for method, _ in server.calls if method == "simSetVehiclePose"]


def test_without_truth_the_estimate_counts_and_without_both_it_waits():
    with StandIn() as server:
        run = shot(server, feed=[imc.EstimatedState(timestamp=0.5, lat=LAT, lon=LON, **PLACE)])
        assert len(run.frames) == 2
        assert server.place == pytest.approx([12.0, -7.0, 3.0], abs=1e-4)
        assert shot(server, feed=[]).task.entity.description == "waiting for SimulatedState"


def test_an_absent_server_is_named_and_asked_again_more_and_more_rarely():
    port = free_port()
    feed = [truth(t / 10) for t in range(300)]
    run = simulate(AirSim, feed, seconds=30.0, port=port, frame_rate=10.0)
    entity = run.task.entity
    assert entity.state is State.ERROR
    assert entity.description == f"127.0.0.1:{port}: {REFUSED} ({run.task.failed} failed)"
    assert 7 <= run.task.failed <= 9
    assert len([text for text in run.log if REFUSED in text]) == 1


def garbage(method, answer):
    return b"\xc1\x00\x01" if method == "simGetImages" else answer


def short(method, answer):
    if method != "simGetImages":
        return answer
    kind, number, error, images = msgspec.msgpack.decode(answer)
    images[3]["image_data_uint8"] = images[3]["image_data_uint8"][:-7]
    return msgspec.msgpack.encode([kind, number, error, images])


def changed(**fields):
    def change(method, answer):
        if method != "simGetImages":
            return answer
        kind, number, error, images = msgspec.msgpack.decode(answer)
        images[2] = {**images[2], **fields}
        return msgspec.msgpack.encode([kind, number, error, images])

    return change


def lost(method, answer):
    if method != "simGetImages":
        return answer
    kind, number, error, images = msgspec.msgpack.decode(answer)
    return msgspec.msgpack.encode([kind, number, error, images[:4]])


def png(width, height):
    def part(kind, data):
        return struct.pack(">I", len(data)) + kind + data + struct.pack(">I", zlib.crc32(kind + data))

    head = struct.pack(">IIBBBBB", width, height, 8, 2, 0, 0, 0)
    few = zlib.compress(bytes(100))
    return b"\x89PNG\r\n\x1a\n" + part(b"IHDR", head) + part(b"IDAT", few) + part(b"IEND", b"")


NOWHERE = {"x_val": math.nan, "y_val": 0.0, "z_val": 0.0}


@pytest.mark.parametrize(
    ("fault", "said"),
    [
        (garbage, "simGetImages: 0xc1 is no msgpack"),
        (short, "fisheye_back: 12281 bytes are no picture of 64 x 64 px"),
        (lost, "4 pictures instead of 5"),
        (lambda m, a: a + b"\x00" if m == "simGetImages" else a, "simGetImages: 1 bytes after the answer"),
        (lambda m, a: msgspec.msgpack.encode([1, 99, None, 1]), "an answer of kind 1 to request 99 instead of 1"),
        (lambda m, a: msgspec.msgpack.encode([1, 1, None, "one"]), "not understood: "),
        (lambda m, a: msgspec.msgpack.encode("\u00e4" * 9), "not understood"),
        (changed(width=0, message="no such camera"), "fisheye_right: a picture of 0 x 64 px: no such camera"),
        (changed(width=10**9, height=10**9), "fisheye_right: a picture of 1000000000 x"),
        (changed(width="64"), "not understood: "),
        (changed(camera_position=NOWHERE), "a pose that is none"),
        (changed(camera_position={**NOWHERE, "x_val": 1e300}), "a pose that is none"),
        (changed(image_data_uint8=png(30000, 30000)), "fisheye_right: a damaged PNG: "),
        (changed(image_data_uint8=png(64, 64)), "fisheye_right: a damaged PNG: "),
        (lambda m, a: b"\x94\x01\x01" + b"\x91" * 9999 + b"\xc0" * 2, "not understood: "),
        (changed(time_stamp=1), "s apart"),
        (changed(width=32, height=128), "the views are not squares of one size: fisheye_down 64 x 64"),
        (lambda m, a: b"\xdf\xff\xff\xff\xff" * 3, "no answer within 1 s"),
        (lambda m, a: None, "no answer within 1 s"),
        (lambda m, a: a[:-20], "no answer within 1 s"),
    ],
)
def test_what_cannot_be_used_is_named_counted_and_got_over(fault, said):
    with StandIn() as server:
        server.fault = fault
        healed = []

        def heal(method, answer):
            healed.append(method)
            return answer

        def once(method, answer):
            changed = fault(method, answer)
            if changed != answer:
                server.fault = heal
            return changed

        server.fault = once
        run = shot(server, seconds=1.5, timeout=1.0 if "within" in said else 10.0)
        reports = [text for text in run.log if said in text]
        assert len(reports) == 1
        assert reports[0].startswith(f"127.0.0.1:{server.port}: ")
        assert run.task.failed == 1
        assert run.task.entity.state is State.NORMAL
        assert len(run.frames) >= 4


def test_cameras_that_look_elsewhere_are_named():
    wrong = {**SETTINGS, "fisheye_left": {"Yaw": -80.0}}
    with StandIn(settings=wrong) as server:
        run = shot(server)
        assert "fisheye_left looks 10.0° from where it should: see its Pitch and Yaw" in run.task.entity.description
    with StandIn(fov=100.0) as server:
        assert "its pictures have 100 x 100°, not 90: see FOV_Degrees" in shot(server).task.entity.description
    with StandIn() as server:
        run = shot(server, cameras=["elsewhere"])
        assert "simGetCameraInfo: rpclib: no camera 'elsewhere'" in run.task.entity.description


def test_a_server_that_ends_and_comes_back_is_found_again():
    with StandIn() as first:
        port = first.port

        def restart(method, answer):
            if method == "simGetImages" and len(first.calls) > 20:
                first.__exit__()
                return None
            return answer

        first.fault = restart
        run = simulate(AirSim, [truth(t / 10) for t in range(60)], seconds=6.0, port=port, size=32, timeout=0.5)
    assert run.task.failed > 1
    taken = run.task.taken
    with StandIn(port=port) as second:
        again = shot(second)
    assert taken > 0 < again.task.taken


def test_a_hanging_server_does_not_keep_the_vehicle():
    with StandIn() as server:
        server.fault = lambda method, answer: None
        feed = [truth(t / 100) for t in range(40)]
        run = shot(server, seconds=0.5, feed=feed, clock=WallClock(), timeout=30.0, frame_rate=20.0)
        assert run.vehicle.bus.delivered >= 40
        assert run.task.dropped >= 5


@pytest.mark.heavy
def test_in_real_time_too():
    with StandIn() as server:
        run = shot(server, seconds=1.0, clock=WallClock(), pose_from="AirSim")
        assert len(run.frames) >= 2
        assert apart(run.frames[0]) < 12


@pytest.mark.parametrize(
    ("wrong", "said"),
    [
        ({"cameras": ["a", "b"]}, "2 instead of one, five or six"),
        ({"publish_truth": True}, "needs Pose From = AirSim"),
        ({"field_of_view": 400.0}, "400"),
    ],
)
def test_impossible_settings(wrong, said):
    with pytest.raises(ParameterError, match=said):
        simulate(AirSim, **wrong)


def test_the_end_of_an_answer_is_found_in_any_portions():
    value = [None, True, 1, 300, -5, -40000, 1.5, "x" * 40, b"y" * 300, "z" * 70000, {"a": [1, 2]}, list(range(40))]
    value += [
        2**40,
        -(2**40),
        {str(n): n for n in range(20)},
        [[] for _ in range(70000)],
        msgspec.msgpack.Ext(1, b"12345"),
    ]
    data = msgspec.msgpack.encode(value)
    for step in (1, 7, 4096, len(data)):
        extent, arrived = MessageEnd(), bytearray()
        for start in range(0, len(data), step):
            assert not extent.is_complete(arrived)
            arrived += data[start : start + step]
        assert extent.is_complete(arrived)
