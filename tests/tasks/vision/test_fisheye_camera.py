"""Vision.FisheyeCamera on a bus: frames, photos, faults, parameters."""

import hashlib
import math
from pathlib import Path

import numpy as np
import pytest
from PIL import Image

import imc
from imc.coordinates import absolute_position
from runtime import Frame, ParameterError
from runtime.kernel import VirtualClock, WallClock
from runtime.profile import load_profile
from runtime.testing import simulate
from runtime.vehicle import build
from tasks.simulated_world import world_of
from tasks.vision.cameras.picture_files import write_picture
from tasks.vision.fisheye_camera import FisheyeCamera
from tests.repeats import all_but
from world.rendering import ScenePose
from world.rendering.renderer import optical_to_ned_rotation

NORMAL, FAULT, FAILURE = (imc.EntityState.State[name] for name in ("NORMAL", "FAULT", "FAILURE"))
START = 1_767_225_600_000_000_000  # ns
SMALL = {"size": 96, "face_size": 48}


def state(time=0.0, **fields):
    return imc.EstimatedState(timestamp=time, **{"depth": 5.0, "z": 5.0, "alt": 4.0, **fields})


def states(seconds=1.0, rate=20, **fields):
    return [state(n / rate, x=n / rate, **fields) for n in range(int(seconds * rate))]


def photos(folder: Path) -> dict[str, str]:
    return {str(p.relative_to(folder)): hashlib.sha256(p.read_bytes()).hexdigest() for p in folder.rglob("*.png")}


def test_frames_come_at_their_rate_with_pose_and_time():
    run = simulate(FisheyeCamera, feed=states(2.0, psi=0.5), seconds=2.31, frame_rate=5, latency=0.1, **SMALL)
    frames = run.frames
    assert [frame.index for frame in frames] == list(range(11))
    assert [frame.time - run.vehicle.start_time for frame in frames] == pytest.approx(np.arange(1, 12) / 5, abs=1e-6)
    first, last = frames[0], frames[-1]
    assert (first.camera, first.image.shape, first.image.flags.writeable) == ("FisheyeCamera", (96, 96, 4), False)
    assert first.info["fov"] == pytest.approx(math.pi)
    assert first.info["focal_length"] == pytest.approx(96 / math.pi)
    assert (last.info["north"], last.info["height"], last.info["psi"]) == pytest.approx((1.95, 4.0, 0.5))
    assert run.of(imc.EntityState)[-1].state == NORMAL
    assert run.task.entity.description == "11 frames, 0 dropped, from EstimatedState"


def test_gliders_lie_off_the_place_where_the_vehicle_is_first_seen():
    """The reference point moves by 10 m to the north meanwhile."""
    latitude, step = 0.7, 10.0 / 6_361_000.0
    feed = [
        state(0.0, lat=latitude, x=100.0, y=50.0),
        state(0.5, lat=latitude, x=101.0, y=50.0),
        state(1.0, lat=latitude + step, x=91.0, y=50.0),
    ]
    run = simulate(FisheyeCamera, feed=feed, seconds=1.5, frame_rate=2, mugs=["1.0 0.3"], size=256)
    assert run.frames[1].info["north"] == pytest.approx(1.0)
    assert run.frames[-1].info["north"] == pytest.approx(1.0, abs=0.01)
    red, green, blue = np.moveaxis(run.frames[1].image[..., :3].astype(int), -1, 0)
    rows, columns = np.nonzero((red > 150) & (green > 120) & (blue < 90))
    place = run.task.camera.optics.project(
        np.array([0.0, 0.3, 3.92]) @ optical_to_ned_rotation(ScenePose(0.0, 0.0, 4.0))
    )[0]
    assert np.hypot(columns.mean() + 0.5 - place[0], rows.mean() + 0.5 - place[1]) < 1.5


def test_the_same_mugs_as_the_detection_camera_takes():
    for text in ("1.0 0.3, 25 -5", "1.0, 0.3, 25, -5"):
        run = simulate(FisheyeCamera, mugs=[word.strip() for word in text.split(",")])
        things = world_of(run.task).objects
        assert [thing.track[0][1:] for thing in things] == [(1.0, 0.3), (25.0, -5.0)]


def test_photos_go_to_the_folder_of_the_log_and_say_when(tmp_path):
    started, stopped, current = (imc.LoggingControl.Op[name] for name in ("STARTED", "STOPPED", "CURRENT_NAME"))
    feed = [
        *states(2.5),
        imc.LoggingControl(timestamp=0.45, op=started, name="20260101/000000_a"),
        imc.LoggingControl(timestamp=0.6, op=current, name="20260101/000000_a"),
        imc.LoggingControl(timestamp=0.95, op=stopped, name="20260101/000000_a"),
        imc.LoggingControl(timestamp=1.45, op=stopped, name="20260101/000000_a"),
        imc.LoggingControl(timestamp=1.45, op=started, name="20260101/000001"),
    ]
    feed.sort(key=lambda message: message.timestamp)
    run = simulate(
        FisheyeCamera, feed=feed, seconds=1.9, frame_rate=4, save_images=True, log_root=tmp_path, system="ship", **SMALL
    )
    assert sorted(photos(tmp_path)) == [
        "ship/20260101/000000_a/Photos/FisheyeCamera_000000_1767225600.500000.png",
        "ship/20260101/000000_a/Photos/FisheyeCamera_000001_1767225600.750000.png",
        "ship/20260101/000001/Photos/FisheyeCamera_000000_1767225601.500000.png",
        "ship/20260101/000001/Photos/FisheyeCamera_000001_1767225601.750000.png",
        "ship/Photos/FisheyeCamera_000000_1767225600.250000.png",
        "ship/Photos/FisheyeCamera_000000_1767225601.000000.png",
        "ship/Photos/FisheyeCamera_000001_1767225601.250000.png",
    ]
    with Image.open(tmp_path / "ship/20260101/000000_a/Photos/FisheyeCamera_000001_1767225600.750000.png") as photo:
        np.testing.assert_array_equal(np.asarray(photo), run.frames[2].image)


@pytest.mark.parametrize("interpolation", ["nearest", "bilinear"])
def test_two_runs_are_equal_to_the_byte(tmp_path, interpolation):
    runs = [
        simulate(
            FisheyeCamera,
            feed=states(1.0, phi=0.3),
            log_root=tmp_path / name,
            save_images=True,
            interpolation=interpolation,
            field_of_view=220.0,
            **SMALL,
        )
        for name in ("a", "b")
    ]
    assert runs[0].packets == runs[1].packets
    assert photos(tmp_path / "a") == photos(tmp_path / "b") != {}


def ask(time, topic="Take Pictures", data="", **header):
    return imc.Event(timestamp=time, topic=topic, data=data, **header)


def pictures(run):
    events = [dict(item.split("=") for item in e.data.split(";")) for e in run.of(imc.Event) if e.topic == "Picture"]
    return [(float(e["time"]) - run.vehicle.start_time, e) for e in events]


def test_pictures_are_taken_on_request(tmp_path):
    orders = [
        ask(0.3),
        ask(0.9, data="camera=FisheyeCamera;count=2;period=0.5"),
        ask(2.0, data="count=0;period=0.2"),
        ask(2.45, data="camera=Another", topic="Stop Pictures"),
        ask(2.55, topic="Stop Pictures"),
        ask(2.6, data="camera=Another"),
    ]
    feed = sorted([*states(3.0, psi=0.5, lat=0.7, lon=-0.1, height=50.0), *orders], key=lambda m: m.timestamp)
    run = simulate(FisheyeCamera, feed=feed, seconds=3.0, frame_rate=10, log_root=tmp_path, system="ship", **SMALL)
    times = [time for time, _ in pictures(run)]
    assert times == pytest.approx([0.3, 0.9, 1.4, 2.0, 2.2, 2.4], abs=0.11)
    assert {f"ship/{told['file']}" for _, told in pictures(run)} == set(photos(tmp_path))
    assert [int(told["number"]) for _, told in pictures(run)] == list(range(6))
    time, told = pictures(run)[-1]
    lat, lon, height = absolute_position(state(x=time - 0.05, lat=0.7, lon=-0.1, height=50.0))
    assert math.radians(float(told["lat"])) == pytest.approx(lat, abs=2e-8)
    assert math.radians(float(told["lon"])) == pytest.approx(lon, abs=2e-8)
    assert (float(told["height"]), float(told["depth"])) == (pytest.approx(height, abs=1e-3), 5.0)
    assert float(told["yaw"]) == pytest.approx(math.degrees(0.5), abs=1e-3)


def test_a_picture_is_reported_below_a_relative_folder(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    started = imc.LoggingControl(op=imc.LoggingControl.Op.STARTED, name="20260101/000000")
    feed = [started, *states(), ask(0.9)]
    run = simulate(FisheyeCamera, feed=feed, seconds=1.2, log_root=Path("log"), system="ship", **SMALL)
    ((_, told),) = pictures(run)
    assert told["file"].startswith("20260101/000000/Photos/FisheyeCamera_000000_")
    assert (tmp_path / "log/ship" / told["file"]).exists()


@pytest.mark.parametrize("data", ["count=-1", "count=x", "count=1.5", "count=nan", "period=inf", "period=-1"])
def test_a_senseless_order_takes_no_picture(tmp_path, data):
    feed = sorted([*states(), ask(0.1, data=data)], key=lambda m: m.timestamp)
    run = simulate(FisheyeCamera, feed=feed, log_root=tmp_path, **SMALL)
    assert not pictures(run)
    assert any("Take Pictures" in text for text in run.log)


def test_a_log_outside_of_the_root_gets_no_photos(tmp_path):
    feed = [imc.LoggingControl(op=imc.LoggingControl.Op.STARTED, name="../../elsewhere"), state(0.01)]
    run = simulate(
        FisheyeCamera, feed=feed, seconds=0.5, save_images=True, log_root=tmp_path / "log", system="ship", **SMALL
    )
    assert any("outside" in text for text in run.log)
    assert {Path(name).parts[:2] for name in photos(tmp_path)} == {("log", "ship")}


def test_a_full_disk_fails_the_entity_and_frames_go_on(tmp_path):
    (tmp_path / "ship").mkdir()
    (tmp_path / "ship/Photos").write_text("in the way")
    run = simulate(
        FisheyeCamera, feed=states(1.0), seconds=1.1, save_images=True, log_root=tmp_path, system="ship", **SMALL
    )
    assert len(run.frames) == 5
    told = [entity.state for entity in run.of(imc.EntityState)]
    assert set(told[told.index(FAILURE) :]) == {FAILURE}
    assert "cannot write" in run.task.entity.description
    assert "5 pictures lost" in run.task.entity.description
    assert [Path(text.split()[2]).name.split("_")[0] for text in run.log if "cannot write" in text] == [
        "cameras.yaml:",
        "FisheyeCamera",
    ]


@pytest.mark.heavy
@pytest.mark.parametrize("kind", ["PNG", "QOI"])
def test_pictures_that_are_written_again_make_the_entity_normal(tmp_path, kind):
    """As when somebody makes room on a full disk."""
    overrides = [
        f"Vision.FisheyeCamera:{text}" for text in ("Size=32", "Face Size=16", "Frame Rate=5", f"Image Format={kind}")
    ]
    profile = load_profile("lauv-noptilus-1", overrides=overrides)
    selected = profile.parse_modes(["Simulation", "Camera"])
    vehicle = build(profile, selected, clock=VirtualClock(START), log_root=tmp_path).vehicle
    camera = next(task for task in vehicle.tasks if isinstance(task, FisheyeCamera))
    vehicle.start()
    vehicle.run(0.01)
    folder = vehicle.log_folder / "Photos"
    folder.write_text("in the way")
    vehicle.run(2.5)
    assert camera.entity.state == FAILURE
    assert camera.lost == camera.taken > 1
    folder.unlink()
    vehicle.run(2.0)
    vehicle.close()
    assert camera.entity.state == NORMAL
    written = sorted(path.suffix for path in folder.iterdir())
    assert written == sorted([f".{kind.lower()}"] * (camera.taken - camera.lost) + [".yaml"])


def test_a_picture_that_cannot_be_written_leaves_no_part_of_it(tmp_path):
    image = np.zeros((4, 4, 4), np.uint8)
    (tmp_path / "1.png").mkdir()
    (tmp_path / "1.png/in the way").touch()
    assert write_picture(tmp_path / "1.png", image).startswith("cannot write")
    assert [path.name for path in tmp_path.iterdir()] == ["1.png"]
    assert write_picture(tmp_path / "2.png", image) == ""
    assert sorted(path.name for path in tmp_path.iterdir()) == ["1.png", "2.png"]


@pytest.mark.heavy
@pytest.mark.computing
@pytest.mark.parametrize("rate", all_but([30.0], [20.0, 30.0]))
def test_a_latency_drops_no_frames_of_a_shipped_vehicle_on_a_virtual_clock(rate, tmp_path):
    values = {"Enabled": "Always", "Frame Rate": rate, "Size": 16, "Face Size": 16}
    overrides = tuple(f"Vision.FisheyeCamera:{name}={value}" for name, value in values.items())
    profile = load_profile("lauv-noptilus-1", overrides=overrides)
    vehicle = build(profile, profile.parse_modes(["Kinematic"]), clock=VirtualClock(START), log_root=tmp_path).vehicle
    frames = []
    vehicle.observe(Frame, frames.append)
    vehicle.start()
    vehicle.run(12.0)
    vehicle.close()
    times = np.array([frame.time for frame in frames])
    assert len(times) > 10 * rate
    assert np.diff(times) == pytest.approx(1.0 / rate, abs=1e-6)
    assert vehicle.task("Vision.FisheyeCamera").dropped == 0


@pytest.mark.parametrize(
    ("fields", "why"),
    [
        ({"phi": math.nan}, "no position or attitude"),
        ({"x": math.inf}, "no position or attitude"),
        ({"lat": math.nan}, "no position or attitude"),
        ({"depth": math.nan}, "no position or attitude"),
        ({"alt": -1.0}, "no altitude"),
        ({"alt": 0.0}, "no altitude"),
        ({"alt": math.nan}, "no altitude"),
        ({"alt": math.inf}, "no altitude"),
    ],
)
def test_without_a_pose_there_is_no_frame_and_the_entity_says_why(fields, why):
    run = simulate(FisheyeCamera, feed=[state(0.0, **fields)], seconds=0.5, **SMALL)
    assert run.frames == []
    assert run.of(imc.EntityState)[-1].state == FAULT
    assert run.task.entity.description == why
    again = simulate(FisheyeCamera, feed=[state(0.0, **fields), state(0.3)], seconds=0.8, **SMALL)
    assert again.frames
    assert again.of(imc.EntityState)[-1].state == NORMAL


def test_before_the_first_state_it_waits():
    run = simulate(FisheyeCamera, seconds=1.0, **SMALL)
    assert run.frames == []
    assert run.task.entity.description == "waiting for EstimatedState"


def test_over_the_sea_the_height_comes_from_the_altitude_or_from_z():
    feed = [state(0.0, alt=-1.0, z=-30.0, depth=-30.0), state(0.25, alt=12.0, z=-30.0, depth=-30.0)]
    run = simulate(FisheyeCamera, feed=feed, seconds=0.5, scene="Sea Surface", **SMALL)
    assert [frame.info["height"] for frame in run.frames] == [30.0, 12.0]


@pytest.mark.parametrize(
    ("values", "name"),
    [
        ({"field_of_view": 0.0}, "Field of View"),
        ({"field_of_view": 361.0}, "Field of View"),
        ({"lens": "orthographic", "field_of_view": 171.0}, "Field of View"),
        ({"lens": "stereographic_220", "field_of_view": 230.0}, "Field of View"),
        ({"lens_coefficients": [1.0, 0.0, -0.5, 0.0]}, "Lens Coefficients"),
        ({"lens_coefficients": [0.0] * 4}, "Lens Coefficients"),
        ({"lens_coefficients": [1.0, 0.0]}, "Lens Coefficients"),
        ({"size": 0}, "Size"),
        ({"face_size": 0}, "Face Size"),
        ({"faces": 4}, "Faces"),
        ({"visibility": 0.01}, "Visibility"),
        ({"lens": "pinhole"}, "Lens"),
        ({"mugs": ["1.0"]}, "World"),
        ({"mugs": ["here there"]}, "World"),
        ({"mugs": ["nan 1"]}, "World"),
    ],
)
def test_parameters_that_make_no_sense_are_refused(values, name):
    with pytest.raises(ParameterError) as refusal:
        simulate(FisheyeCamera, **values)
    assert refusal.value.name == name


def test_gaps_and_a_cut_image_are_warned_of():
    run = simulate(FisheyeCamera, field_of_view=270.0, focal_length=100.0, size=400)
    assert any("250.53°" in text for text in run.log)
    assert any("471 px is cut off at 400 px" in text for text in run.log)
    assert not simulate(FisheyeCamera, field_of_view=270.0, faces=6).log


def test_coefficients_in_pixels():
    run = simulate(FisheyeCamera, lens_coefficients=[339.749, -31.988, 48.275, -7.201], focal_length=1.0, size=1280)
    assert run.task.camera.optics.project([[1.0, 0.0, 1.0]])[0][0, 0] == pytest.approx(640 + 267.75, abs=0.1)


def test_on_a_wall_clock_a_busy_renderer_drops_frames_and_keeps_none_waiting():
    run = simulate(
        FisheyeCamera, feed=[state(0.0)], seconds=0.7, clock=WallClock(start=START), frame_rate=1000.0, face_size=256
    )
    assert [frame.index for frame in run.frames] == list(range(len(run.frames)))
    assert run.task.dropped > 0
    assert run.task.taken - len(run.frames) in (0, 1)
