"""Pictures of folders and videos come at their times, as they are."""

import math
import os
import shutil
import threading

import numpy as np
import pytest
from PIL import Image

import imc
from runtime import ParameterError, State, Task, periodic
from runtime.kernel import WallClock
from runtime.testing import START, simulate
from support.pose import DOWN, Pose
from tasks.vision.cameras.camera_metadata import write_cameras
from tasks.vision.cameras.image_sequence import ImageSequence, read_picture
from tasks.vision.cameras.picture_files import photo_name, write_picture
from tasks.vision.recording import Recording
from tests.outside import NO_FILE
from world.optics import FisheyeModel, PinholeModel, preset_lens

NS = 1_403_636_579_763_555_584
SENSOR = """
sensor_type: camera
resolution: [24, 16]
camera_model: pinhole
intrinsics: [20.0, 20.0, 11.5, 7.5]
distortion_model: radial-tangential
distortion_coefficients: [-0.1, 0.01, 0.0, 0.0]
"""


def colored(number):
    image = np.full((16, 24, 4), 255, np.uint8)
    image[..., 0], image[..., 1] = 10 * number, np.arange(24)
    return image


def euroc(folder, count=5, rate=10):
    place = folder / "mav0" / "cam0"
    (place / "data").mkdir(parents=True)
    lines = ["#timestamp [ns],filename"]
    for number in range(count):
        name = f"{NS + number * 10**9 // rate}.png"
        Image.fromarray(colored(number)).save(place / "data" / name)
        lines.append(f"{name[:-4]},{name}")
    (place / "data.csv").write_text("\r\n".join(lines) + "\r\n")
    (place / "sensor.yaml").write_text(SENSOR)
    return folder


def tum(folder):
    (folder / "rgb").mkdir(parents=True)
    for number in range(3):
        Image.fromarray(colored(number)).save(folder / "rgb" / f"{number}.png")
    rows = [f"{1305031102.175304 + number / 4:.6f} rgb/{number}.png" for number in range(3)]
    (folder / "rgb.txt").write_text("# color images\n# file: 'x.bag'\n" + "\n".join(rows))
    return folder


def played(source, seconds=2.0, **options):
    return simulate(Recording, [], seconds=seconds, source=str(source), **options)


def shown(run):
    """The numbers of the pictures, and their times from the start."""
    return [(frame.image[0, 0, 0] // 10, round(frame.time - START, 6)) for frame in run.frames]


def test_euroc_with_its_camera(tmp_path):
    run = played(euroc(tmp_path))
    assert shown(run) == [(0, 0.0), (1, 0.1), (2, 0.2), (3, 0.3), (4, 0.4)]
    frame = run.frames[1]
    assert np.array_equal(frame.image, colored(1))
    assert frame.info["stamp"] == pytest.approx(NS / 1e9 + 0.1, abs=1e-6)
    assert (frame.optics.cx, frame.optics.cy, frame.optics.k1) == (12.0, 8.0, -0.1)
    assert frame.pose is None
    assert frame.mount[:3, 2] == pytest.approx([0.0, 0.0, 1.0])
    assert run.task.entity.description == f"{tmp_path} has ended: 5 frames, 0 dropped, 0 failed"


def test_one_of_several_cameras_of_a_data_set(tmp_path):
    first, table = euroc(tmp_path / "euroc") / "mav0" / "cam0", tum(tmp_path / "tum") / "rgb.txt"
    shutil.copytree(first, first.with_name("cam1"))
    (first.with_name("cam1") / "sensor.yaml").write_text(SENSOR.replace("[20", "[30") + "comment: Left_Camera\n")
    rows = (first / "data.csv").read_text().splitlines()
    (first.with_name("cam1") / "data.csv").write_text("\n".join([rows[0], *rows[3:]]))
    last = table.read_text().splitlines()[-1]
    table.with_name("rgb1.txt").write_text(f"# color images of Left_Camera\n{last}")
    lens = FisheyeModel.from_lens(preset_lens("equidistant", math.pi), 16), DOWN
    write_cameras(table.parent, {"Front": lens, "Left Camera": (PinholeModel(24, 16, 30.0, 20.0, 12.0, 8.0), DOWN)})
    for made, names in (("euroc", ("cam0", "cam1")), ("tum", ("rgb", "rgb1"))):
        for camera, number in (("", 0), (names[0], 0), (names[1], 2), ("Left Camera", 2), ("Left_Camera", 2)):
            run = played(tmp_path / made, camera=camera)
            assert shown(run)[0][0] == number
            assert number == 0 or run.frames[0].optics.fx == 30.0
        with pytest.raises(ParameterError, match=rf"no camera R; there are {names[0]}, {names[1]} \(Left_Camera\)"):
            played(tmp_path / made, camera="R")


def test_tum(tmp_path):
    run = played(tum(tmp_path))
    assert shown(run) == [(0, 0.0), (1, 0.25), (2, 0.5)]
    assert run.frames[0].optics is None
    assert math.isnan(run.of(imc.CameraFrame)[0].fx)


def test_photos_of_a_log_with_their_cameras(tmp_path):
    lens = FisheyeModel.from_lens(preset_lens("equisolid", math.pi), 16)
    pinhole = PinholeModel(24, 16, 20.0, 20.0, 12.0, 8.0)
    write_cameras(tmp_path / "Photos", {"Fisheye Camera": (lens, DOWN), "Front": (pinhole, Pose())})
    for number in range(4):
        for camera in ("Fisheye Camera", "Front"):
            kind = ("PNG", "QOI")[number % 2]
            name = photo_name(camera, number, START + 0.5 + number, kind)
            assert not write_picture(tmp_path / "Photos" / name, colored(number), kind)
    with_both = played(tmp_path)
    assert "pictures of several cameras: Fisheye_Camera, Front; choose one" in with_both.task.entity.description
    run = played(tmp_path, seconds=5.0, camera="Front", times="As Recorded")
    assert shown(run) == [(0, 0.5), (1, 1.5), (2, 2.5), (3, 3.5)]
    assert run.frames[0].optics == pinhole
    assert played(tmp_path, camera="Fisheye Camera").task.model_and_mount == (lens, DOWN)
    assert len(played(tmp_path, camera="Front", times="As Recorded", start=START + 2.0, seconds=4.0).frames) == 2


def test_what_is_played_can_be_kept_and_played_again(tmp_path):
    estimates = [imc.EstimatedState(timestamp=t / 10, lat=0.7, depth=2.5) for t in range(6)]
    options = {"source": str(euroc(tmp_path / "set")), "save_images": True, "entity_label": "Old Camera"}
    run = simulate(Recording, estimates, seconds=1.0, log_root=tmp_path / "log", **options)
    folder = tmp_path / "log" / "lauv-noptilus-1"
    assert [message.file for message in run.of(imc.CameraFrame)] == [
        f"Photos/{photo_name('Old Camera', number, START + number / 10)}" for number in range(5)
    ]
    assert len([event for event in run.of(imc.Event) if "depth=2.500" in event.data]) == 5
    again = played(folder, times="As Recorded", camera="Old Camera")
    assert shown(again) == shown(run)
    first, second = run.frames[0], again.frames[0]
    assert np.array_equal(first.image, second.image)
    assert (second.optics.fx, second.optics.k1) == pytest.approx((first.optics.fx, first.optics.k1))


def test_names_that_are_times(tmp_path):
    for number, time in enumerate(("1403636579763555584", "1403636579963555584", "1403636580763555584")):
        Image.fromarray(colored(number)[..., :3]).save(tmp_path / f"{time}.jpg", quality=95)
    (tmp_path / "notes.txt").write_text("not a picture")
    Image.fromarray(colored(0)).save(tmp_path / "cover.png")
    run = played(tmp_path)
    assert [round(frame.time - START, 3) for frame in run.frames] == [0.0, 0.2, 1.0]
    assert "cover.png: the name is no time" in run.log


def test_gray_and_deep_pictures(tmp_path):
    Image.fromarray(np.full((4, 6), 77, np.uint8)).save(tmp_path / "1.5.png")
    Image.fromarray(np.full((4, 6), 0x4D12, np.uint16)).save(tmp_path / "2.5.png")
    for frame in played(tmp_path).frames:
        assert frame.image[0, 0].tolist() == [77, 77, 77, 255]


@pytest.mark.parametrize(("value", "shown"), [(0, 0), (0xFF, 0), (0x100, 1), (0xFFFF, 255)])
def test_a_dark_deep_picture_is_as_dark_as_it_was(value, shown, tmp_path):
    Image.fromarray(np.full((4, 6), value, np.uint16)).save(tmp_path / "dark.png")
    image, error = read_picture(tmp_path / "dark.png")
    assert (image[0, 0].tolist(), error) == ([shown] * 3 + [255], "")


def test_what_is_missing_or_broken_is_named_counted_and_left_out(tmp_path):
    folder = euroc(tmp_path)
    cam = folder / "mav0" / "cam0"
    os.remove(cam / "data" / f"{NS + 10**8}.png")
    (cam / "data" / f"{NS + 2 * 10**8}.png").write_bytes(b"\x89PNG\r\n\x1a\nrubbish")
    broken = (cam / "data" / f"{NS + 3 * 10**8}.png").read_bytes()[:60]
    (cam / "data" / f"{NS + 3 * 10**8}.png").write_bytes(broken)
    rows = "yesterday,1.png\n1403636579763555584\nnan,2.png\n1403636579763555585,../../../secret.png\n"
    with (cam / "data.csv").open("a") as table:
        table.write(rows)
    run = played(folder)
    assert shown(run) == [(0, 0.0), (4, 0.4)]
    assert run.task.failed == 7
    said = "\n".join(run.log)
    assert f"left out: {NS + 10**8}.png: {NO_FILE}" in said
    assert f"left out: {NS + 2 * 10**8}.png: " in said
    assert f"left out: {NS + 3 * 10**8}.png: " in said
    assert "data.csv, line 7: 'yesterday,1.png' is not a time and a file" in said
    assert "data.csv, line 10: '../../../secret.png' is no file in the folder" in said
    assert run.task.entity.state is State.NORMAL


@pytest.mark.parametrize(
    ("row", "said"),
    [("9" * 400 + " rgb/0.png", "is not a time and a file"), ("1305031103.0 rgb/\0.png", "is no file in the folder")],
)
def test_a_row_that_cannot_be_is_left_out(row, said, tmp_path):
    table = tum(tmp_path) / "rgb.txt"
    table.write_text(f"{row}\n{table.read_text()}")
    run = played(tmp_path)
    assert [number for number, _ in shown(run)] == [0, 1, 2]
    assert run.task.failed == 1
    assert run.log[0].startswith("rgb.txt, line 1: ")
    assert run.log[0].endswith(said)


def test_pictures_that_are_all_earlier_than_the_run_are_reported(tmp_path):
    run = played(tum(tmp_path), times="As Recorded")
    assert run.log == [f"{tmp_path}: all pictures are earlier than the run: use Times = From Start"]
    assert run.task.entity.description.endswith("0 failed; all pictures are earlier than the run")
    assert not any("earlier" in text for text in played(tmp_path, times="As Recorded", start=1305031102.0).log)


def test_thousands_of_broken_pictures_are_no_livelock(tmp_path):
    lines = "\n".join(f"{1_000_000 + number / 1000},{number}.png" for number in range(3000))
    (tmp_path / "data.csv").write_text(lines)
    run = played(tmp_path, seconds=4.0)
    assert run.task.failed == 3000
    assert len(run.log) < 20


@pytest.mark.parametrize(
    ("source", "said"),
    [("nowhere", f"nowhere: {NO_FILE}"), ("empty", "empty: no pictures with times")],
)
def test_sources_that_are_none(source, said, tmp_path):
    (tmp_path / "empty").mkdir()
    run = played(tmp_path / source)
    assert run.task.entity.state is State.ERROR
    assert run.task.entity.description.endswith(said)


@pytest.mark.parametrize(
    ("options", "said"),
    [
        ({"source": ""}, "is not set"),
        ({"source": "x", "calibration": "nowhere.yaml"}, NO_FILE),
        ({"source": __file__, "times": "As Recorded"}, "has no time of recording"),
    ],
)
def test_impossible_settings(options, said):
    with pytest.raises(ParameterError, match=said):
        simulate(Recording, **options)


def test_a_calibration_of_another_size_is_named(tmp_path):
    (tmp_path / "camera.yaml").write_text(SENSOR.replace("24", "48"))
    run = played(tum(tmp_path / "set"), calibration=str(tmp_path / "camera.yaml"))
    assert run.frames[0].optics is None
    assert "the calibration is for 48 x 16 px, not 24 x 16 px" in run.log
    broken = euroc(tmp_path / "broken")
    (broken / "mav0" / "cam0" / "sensor.yaml").write_text("intrinsics: [1]")
    run = played(broken)
    assert len(run.frames) == 5
    assert "pictures without a calibration" in run.log[0]


def test_the_frame_says_where_the_vehicle_believed_to_be(tmp_path):
    states = [imc.EstimatedState(timestamp=t / 10, x=5.0 + t / 10, z=3.0, vx=1.0) for t in range(6)]
    run = simulate(Recording, states, seconds=1.0, source=str(euroc(tmp_path)), latency=0.05)
    told = run.of(imc.CameraFrame)
    assert [frame.pose for frame in told] == [imc.CameraFrame.Pose.ESTIMATE] * 5
    assert [frame.x - told[0].x for frame in told] == pytest.approx([0.0, 0.1, 0.2, 0.3, 0.4], abs=1e-4)
    assert [frame.z for frame in told] == [3.0] * 5


def video(path, rate=20.0, count=8):
    import cv2

    writer = cv2.VideoWriter(str(path), cv2.VideoWriter.fourcc(*"MJPG"), rate, (64, 48))
    assert writer.isOpened()
    for number in range(count):
        writer.write(np.full((48, 64, 3), (0, 0, 25 * number), np.uint8))
    writer.release()
    return path


def test_a_video(tmp_path):
    run = played(video(tmp_path / "dive.avi"))
    assert [frame.time - START for frame in run.frames] == pytest.approx([0.05 * n for n in range(8)], abs=1e-5)
    reds = [int(frame.image[20, 20, 0]) for frame in run.frames]
    assert reds == pytest.approx([25 * n for n in range(8)], abs=6)
    (tmp_path / "no.mp4").write_bytes(b"no video at all")
    assert played(tmp_path / "no.mp4").task.entity.description.endswith("OpenCV cannot read this video")


class Endless:
    """OpenCV's video in its outlines; its second picture is read until the vehicle has ended."""

    def __init__(self):
        self.ended, self.said = threading.Event(), []

    def read(self):
        self.said.append("reading")
        if len(self.said) > 1:
            self.ended.wait(10.0)
        self.said.append("read")
        return True, np.zeros((4, 6, 3), np.uint8)

    def get(self, _):
        return 20.0

    def release(self):
        self.said.append("released")


def test_a_video_is_not_closed_while_it_is_read(tmp_path, monkeypatch):
    endless = Endless()
    monkeypatch.setattr("tasks.vision.cameras.image_sequence.open_video", lambda _: endless)

    class Watcher(Task):
        @periodic(50.0)
        def look(self):
            if endless.said.count("reading") == 2:
                self.vehicle.kernel.stop()

        def stop(self):  # after the recording has stopped
            endless.ended.set()

    (tmp_path / "dive.avi").touch()
    simulate([Watcher, (Recording, {"source": str(tmp_path / "dive.avi")})], seconds=10.0, clock=WallClock())
    assert endless.said == ["reading", "read"] * 2


def test_any_picture_can_be_the_next(tmp_path):
    for source in (video(tmp_path / "dive.avi"), euroc(tmp_path / "set")):
        expected = ImageSequence(source).read(3) if source.is_dir() else None
        reel = ImageSequence(source)
        item = reel.read(3)
        assert item.number == 3
        assert expected is None or np.array_equal(item.image, expected.image)
        assert reel.read(99) is None


def test_two_runs_are_one(tmp_path):
    source = euroc(tmp_path)
    first, second = played(source), played(source)
    assert first.packets == second.packets
    assert [f.image.tobytes() for f in first.frames] == [f.image.tobytes() for f in second.frames]


@pytest.mark.heavy
def test_in_real_time(tmp_path):
    run = played(euroc(tmp_path, count=4), seconds=0.8, clock=WallClock())
    gaps = np.diff([frame.time for frame in run.frames])
    assert gaps == pytest.approx([0.1, 0.1, 0.1], abs=1e-6)
