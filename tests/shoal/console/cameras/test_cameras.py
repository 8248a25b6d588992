"""Pictures of cameras on the page: what is shown of good and bad ones, and what the vehicle is asked for."""

import json

import pytest

import imc
from imc.reserved_ids import UNKNOWN_ENTITY
from tests.outside import until
from tests.shoal.console.cameras.sent_pictures import (
    CAMERA,
    DETECTOR,
    NAME,
    START,
    CameraRadio,
    cameras,
    from_vehicle,
    jpeg,
    only_camera,
    picture,
    state,
)
from tests.shoal.console.page_of_nobody import served_page


@pytest.fixture
def radio():
    return CameraRadio()


@pytest.fixture
def page(radio):
    with served_page(radio) as found:
        found.log_in()
        until(lambda: cameras(found)["ok"])
        yield found


def shown(page, condition=lambda camera: True):
    until(lambda: (camera := only_camera(page)) is not None and condition(camera))
    return only_camera(page)


def test_the_newest_picture_is_shown_with_its_time_and_served_once(page, radio):
    assert cameras(page)["note"].startswith(f"no camera of {NAME} has sent a picture; ")
    radio.bring_soon(picture(1.0), state(1.5))
    camera = shown(page, lambda camera: camera["age"] > 0.4)
    assert (camera["label"], camera["width"], camera["height"], camera["format"]) == ("Front", 64, 48, "jpg")
    assert camera["time"] == START + 1.0
    assert 0.5 <= camera["age"] < 60.0
    address = f"/api/picture?vehicle={NAME}&camera={CAMERA}&number="
    status, data, headers = page.request("GET", f"{address}{camera['number']}")
    assert (status, data, headers["content-type"]) == (200, jpeg(1.0), "image/jpeg")
    radio.bring_soon(picture(2.0, color=(200, 0, 0)))
    shown(page, lambda camera: camera["time"] == START + 2.0)
    assert page.request("GET", f"{address}{camera['number']}")[0] == 204


def test_a_camera_is_asked_for_pictures_only_while_somebody_looks(page, radio):
    radio.bring_soon(picture(1.0))
    shown(page)
    radio.sent.clear()
    assert page.request("GET", "/api/fields")[0] == 200
    assert radio.sent == []
    until(lambda: cameras(page, live=str(CAMERA)) and len(radio.sent) >= 2)
    asked = {(message.dst_ent, message.fps) for message in radio.sent}
    assert asked == {(UNKNOWN_ENTITY, 1), (CAMERA, 5)}
    assert all(isinstance(message, imc.ImageTxSettings) for message in radio.sent)
    for live in ("200", "-1", "x", "9" * 30, "9" * 5000, "%C2%B2"):
        radio.sent.clear()
        assert cameras(page, live=live)["ok"]
        assert all(message.dst_ent == UNKNOWN_ENTITY for message in radio.sent)


def test_detections_are_where_the_lens_shows_them(page, radio):
    """A glider 1 m ahead and 0.5 m to the right; up is ahead."""
    radio.bring_soon(state(0.9), state(1.0), picture(1.0), state(1.1))
    radio.bring_soon(from_vehicle(imc.EstimatedMugState, 1.05, DETECTOR, id=3, x=1.0, y=0.5))
    (mark,) = shown(page, lambda camera: camera["marks"])["marks"]
    assert (mark["u"], mark["v"]) == pytest.approx((32.0 + 40.0 * 0.5 / 4.0, 24.0 - 40.0 * 1.0 / 4.0), abs=0.2)
    assert mark["label"] == "Detector 3"
    radio.bring_soon(state(30.0), picture(30.0))
    assert shown(page, lambda camera: camera["time"] == START + 30.0)["marks"] == []


def test_a_picture_whose_camera_is_silent_gets_old(page, radio):
    radio.bring_soon(picture(1.0), state(1.0))
    assert shown(page)["age"] < 30.0
    radio.bring_soon(state(100.0))
    until(lambda: only_camera(page)["age"] > 98.0)


def test_a_damaged_picture_is_counted_and_the_last_good_one_stays(page, radio):
    radio.bring_soon(picture(1.0))
    good = shown(page)
    whole = jpeg(2.0)
    huge = whole[:2] + b"\xff\xc0\x00\x11\x08\xff\xff\xff\xff\x03" + bytes(9) + whole[-2:]
    bad = b"", b"\xff\xd8\xff", whole[:-40], huge, b"\x89PNG\r\n\x1a\n" + bytes(40), b"GIF89a" + bytes(50)
    for number, data in enumerate(bad, start=1):
        radio.bring_soon(picture(1.0 + number, data))
        camera = shown(page, lambda camera, count=number: f"({count})" in camera["trouble"])
        assert (camera["number"], camera["time"]) == (good["number"], good["time"])
        assert camera["trouble"].startswith("damaged: ")
    radio.bring_soon(picture(20.0))
    assert shown(page, lambda camera: camera["time"] == START + 20.0)["trouble"] == ""


@pytest.mark.parametrize(
    "comment",
    [
        b"{",
        b"[" * 9000,
        b'{"time": 1%s}' % (b"0" * 400),
        b'{"time": NaN, "camera": 5, "lens": []}',
        b'{"time": "x", "lens": {"T_BS": [1]}}',
        b'{"lens": {"T_BS": [[1,0,0,0],[0,1,0,0],[0,0,1,0],[0,0,0,1]], "intrinsics": [0,0,0,0], "resolution": [0, 0]}}',
        b'{"lens": {"T_BS": [[1,0,0,0],[0,1,0,0],[0,0,1,0],[0,0,0,1]], "not_in_kalibr": "", "opencv": {"D": [1e400]}}}',
        b'{"time": 1e308, "camera": "\\u001b[31m<img src=x>", "lens": null}',
    ],
)
def test_a_comment_that_lies_spoils_no_picture(page, radio, comment):
    data = jpeg(1.0, optics=None)
    at = data.index(b"\xff\xfe")
    length = int.from_bytes(data[at + 2 : at + 4], "big")
    packed = data[:at] + b"\xff\xfe" + (len(comment) + 2).to_bytes(2, "big") + comment + data[at + 2 + length :]
    radio.bring_soon(picture(1.0, packed), from_vehicle(imc.EstimatedMugState, 1.0, DETECTOR, id=1, x=1.0))
    camera = shown(page)
    assert (camera["width"], camera["marks"], camera["label"]) == (64, [], "Front")


def test_a_camera_that_starts_again_is_the_same_one(page, radio):
    radio.bring_soon(picture(1.0, index=900))
    first = shown(page)
    radio.bring_soon(picture(5.0, index=0, color=(9, 9, 9)))
    again = shown(page, lambda camera: camera["time"] == START + 5.0)
    assert again["number"] > first["number"]


def test_the_number_of_cameras_is_limited_and_names_are_text(page, radio):
    hostile = "<img src=x onerror=alert(1)>\x1b[31m\u202e"
    report = imc.EntityList.Op.REPORT
    radio.bring_soon(from_vehicle(imc.EntityList, 1.0, 0, op=report, list=f"{hostile}=9"))
    radio.bring_soon(*(picture(1.0, entity=entity) for entity in range(9, 120)))
    until(lambda: len(cameras(page)["cameras"]) == 32)
    assert "\x1b" not in json.dumps(cameras(page), ensure_ascii=False)
    unknown = f"vehicle={NAME}&camera=%C2%B2&number=1", f"vehicle={NAME}&camera=250&number=1"
    for query, status in {
        "vehicle=nobody": 404,
        f"vehicle={NAME}&camera=9&number=x": 404,
        **dict.fromkeys(unknown, 204),
    }.items():
        assert page.request("GET", f"/api/picture?{query}")[0] == status


def test_who_has_not_logged_in_sees_no_picture(page, radio):
    radio.bring_soon(picture(1.0))
    shown(page)
    page.cookie = ""
    for path in ("/api/cameras", "/api/picture"):
        assert page.request("GET", f"{path}?vehicle={NAME}&camera={CAMERA}&number=1")[0] == 401
