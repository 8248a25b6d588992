"""Pictures that cameras send while a console asks for them."""

import io
import json

import numpy as np
import pytest
from PIL import Image

import imc
from imc.reserved_ids import UNKNOWN_ENTITY
from runtime import Frame
from runtime.testing import simulate
from tasks.vision.camera import Camera
from tasks.vision.cameras.picture_transmission import ASKED, LARGEST, PictureRequests, encode_picture
from tasks.vision.fisheye_camera import FisheyeCamera
from world.optics import parse_calibration

VEHICLE, CONSOLE = 26, 0x4321
SMALL = {"width": 64, "height": 48}


def states(seconds):
    return [imc.EstimatedState(timestamp=n / 20, alt=3.0, depth=2.0, z=2.0) for n in range(round(seconds * 20))]


def request(at, **words):
    return imc.ImageTxSettings(timestamp=at, src=CONSOLE, **{"dst": VEHICLE, "dst_ent": UNKNOWN_ENTITY, **words})


def take(*requests, seconds=3.0, camera=Camera, **options):
    feed = sorted([*states(seconds), *requests], key=lambda message: message.timestamp)
    return simulate(camera, feed=feed, frame_rate=10.0, latency=0.0, **options)


def comment(data):
    with Image.open(io.BytesIO(data)) as picture:
        return json.loads(picture.info["comment"])


def frame(image, **options):
    return Frame(1.7e9, "Front", 3, image, **options)


def test_pictures_are_sent_while_a_console_asks_at_its_rate():
    run = take(request(1.0, fps=2), seconds=9.0, **SMALL)
    times = [message.timestamp - run.vehicle.start_time for message in run.of(imc.CompressedImage)]
    assert times[0] == pytest.approx(1.1, abs=0.11)
    assert times[-1] == pytest.approx(1.0 + ASKED, abs=0.6)
    assert np.diff(times) == pytest.approx(0.5, abs=1e-6)
    assert take(**SMALL).of(imc.CompressedImage) == []


@pytest.mark.parametrize("words", [{"fps": 0}, {"fps": 5, "dst": VEHICLE + 1}, {"fps": 5, "dst_ent": 200}])
def test_what_asks_for_none_of_this_camera_gets_none(words):
    assert take(request(0.5, **words), **SMALL).of(imc.CompressedImage) == []


@pytest.mark.parametrize("camera", [Camera, FisheyeCamera])
def test_a_picture_says_when_and_through_which_lens_it_was_taken(camera):
    run = take(request(0.2, fps=10), seconds=1.0, camera=camera)
    sent, shown = run.of(imc.CompressedImage)[-1], run.frames[-1]
    told = comment(sent.data)
    assert (told["camera"], told["index"]) == (shown.camera, sent.frameid)
    assert told["time"] == pytest.approx(shown.time, abs=0.11)
    model = parse_calibration(json.dumps(told["lens"]))
    points = [[0.0, 0.0, 2.0], [0.5, -0.3, 2.0], [-0.4, 0.6, 1.0]]
    assert model.project(points)[0] == pytest.approx(shown.optics.project(points)[0], abs=1e-3)
    assert np.array(told["lens"]["T_BS"]) == pytest.approx(shown.mount, abs=1e-9)


def test_a_picture_fits_a_packet_whatever_it_shows():
    noise = np.random.default_rng(1).integers(0, 256, (1500, 4000, 4), np.uint8)
    data, lens = encode_picture(frame(noise), 95)
    with Image.open(io.BytesIO(data)) as picture:
        picture.load()
        assert picture.width / picture.height == pytest.approx(8 / 3, rel=0.05)
    assert (len(data) <= LARGEST, lens) == (True, "null")
    small, _ = encode_picture(frame(np.zeros((1, 1, 4), np.uint8)), 10)
    assert comment(small)["camera"] == "Front"


def test_the_highest_rate_counts_until_nobody_asks_for_it():
    requests = PictureRequests()
    for second in range(1000):
        requests.add(1, 0, float(second))
        requests.add(200 if second < 10 else 0, 0, float(second))
    assert requests.rate(5.0) == 0  # time has gone back
    assert requests.rate(999.5) == 1
    assert requests.rate(999.0 + ASKED) == 0
