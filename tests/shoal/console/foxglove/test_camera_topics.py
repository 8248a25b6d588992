"""Pictures of cameras for viewers of Foxglove's protocol: calibration, place, detections."""

import numpy as np
import pytest

import imc
from runtime import Frame
from shoal.console.cameras.camera_picture import parse_picture
from shoal.console.foxglove.camera_topics import camera_topics
from shoal.logs.export import CdrError
from support.pose import DOWN
from tasks.vision.cameras.picture_transmission import encode_picture
from tests.shoal.console.cameras.sent_pictures import (
    CAMERA,
    DETECTOR,
    OPTICS,
    START,
    CameraRadio,
    first_messages,
    from_vehicle,
    jpeg,
    picture,
    state,
)
from tests.shoal.console.foxglove.viewer import Viewer
from tests.shoal.console.page_of_nobody import served_page
from world.optics import PinholeModel
from world.rendering import optical_to_body_transform

FRAME = "lauv_noptilus_1/Front"
TOPICS = {"/tf": 9, **{f"/{FRAME}/{name}": n for n, name in enumerate(("image", "camera_info", "annotations"))}}
WIDE = PinholeModel(1280, 960, 800.0, 800.0, 630.0, 470.0, k1=-0.1, k3=0.01)


def requests(radio):
    return [message for message in radio.sent if isinstance(message, imc.ImageTxSettings)]


def received(viewer, topic):
    return [viewer.decode(topic, data) for number, _, data in viewer.messages if number == TOPICS[topic]]


def test_a_viewer_gets_pictures_with_calibration_place_and_detections():
    radio = CameraRadio()
    with served_page(radio) as page, Viewer(page.server.foxglove_link()) as viewer:
        radio.bring_soon(*first_messages(), from_vehicle(imc.CameraFrame, 1.0))
        for topic, number in TOPICS.items():
            viewer.subscribe(topic, number)
        viewer.until(lambda: requests(radio))  # nobody has looked before
        assert {(request.dst_ent, request.fps) for request in requests(radio)} == {(CAMERA, 5)}
        radio.bring_soon(state(0.9), state(1.0), state(1.1))
        radio.bring_soon(from_vehicle(imc.EstimatedMugState, 1.05, DETECTOR, id=3, x=1.0, y=0.5), picture(1.0))
        shown = viewer.until(lambda: received(viewer, f"/{FRAME}/image"))[-1]
        assert (shown.format, shown.data.tobytes(), shown.header.frame_id) == ("jpeg", jpeg(1.0), FRAME)
        info = viewer.until(lambda: received(viewer, f"/{FRAME}/camera_info"))[-1]
        assert (info.width, info.height, info.header.frame_id) == (64, 48, FRAME)
        assert info.k[0] == pytest.approx(OPTICS.fx)
        (circle,) = viewer.until(lambda: received(viewer, f"/{FRAME}/annotations"))[-1].circles
        assert (circle.position.x, circle.position.y) == pytest.approx((37.0, 14.0), abs=0.2)
        moved = received(viewer, "/tf")
        assert FRAME in {each.child_frame_id for message in moved for each in message.transforms}


def test_calibration_is_that_of_the_picture_as_it_was_sent():
    """1280 x 960 px are sent as 640 x 480 px."""
    frame = Frame(START, "a", 0, np.zeros((960, 1280, 4), np.uint8), {}, WIDE, optical_to_body_transform(DOWN))
    message = from_vehicle(imc.CompressedImage, 0.0, data=encode_picture(frame, 75)[0])
    info = camera_topics("v", "a", lambda picture: [])[0].encode(message, 5)
    lens = parse_picture(message).lens
    assert lens.model.project([[0.1, 0.2, 1.0]])[0] == pytest.approx(WIDE.project([[0.1, 0.2, 1.0]])[0], abs=1e-6)
    assert np.array([400.0, 0.0, 314.5]).tobytes() in info  # the first row of K


@pytest.mark.parametrize(
    ("lens", "has_info"),
    [
        ({b'"time": 1': b'"time": 1' + b"0" * 400}, True),
        ({b"[[40.0, 0.0, 31.5]": b"[40.0", b"[64, 48]": b"[32, 24]"}, False),
    ],
)
def test_numbers_that_are_none_end_no_viewers(lens, has_info):
    good = jpeg(1.0)
    at = good.index(b"\xff\xfe")
    before = comment = good[at + 4 : at + 2 + int.from_bytes(good[at + 2 : at + 4], "big")]
    for old, new in lens.items():
        assert old in comment
        comment = comment.replace(old, new)
    packed = good[: at + 2] + (len(comment) + 2).to_bytes(2, "big") + comment + good[at + 4 + len(before) :]
    message = from_vehicle(imc.CompressedImage, 1.0, data=packed)
    info = camera_topics("v", "Front", lambda picture: [])[0]
    if has_info:
        assert info.encode(message, 5)
    else:
        with pytest.raises(CdrError):
            info.encode(message, 5)


@pytest.mark.parametrize("data", [b"", b"\xff\xd8\xff\xd9", jpeg(1.0, optics=None)])
def test_a_picture_without_a_lens_has_no_calibration(data):
    info, place, marks = camera_topics("v", "Front", lambda picture: [])
    message = from_vehicle(imc.CompressedImage, 1.0, data=data)
    for topic in (info, place):
        with pytest.raises(CdrError):
            topic.encode(message, 5)
    if len(data) > 9:
        assert marks.encode(message, 5)
