"""Pictures of a log on the page: files of any size and format, damaged ones, and messages."""

import io
import json
import os
from urllib.parse import quote

import numpy as np
import pytest
from PIL import Image

import imc
from shoal.console import LogLink
from shoal.console.cameras.logged_pictures import _read_photo
from shoal.logs.export import Photo, read_photo_cameras
from shoal.logs.log_states import LogStates
from support.picture_headers import read_picture_header
from tests.shoal.console.cameras.sent_pictures import (
    DETECTOR,
    NAME,
    START,
    cameras,
    first_messages,
    from_vehicle,
    jpeg,
    picture,
    state,
)
from tests.shoal.console.page_of_nobody import served_page

NOISE = np.random.default_rng(1).integers(0, 256, (2700, 2700, 3), np.uint8)


def write_photos(folder):
    """A camera each second: small, of 22 MB, QOI, truncated, a link to elsewhere, and a bomb of zeros."""
    folder.mkdir()
    small = Image.fromarray(NOISE[:20, :30])
    small.save(folder / f"Front_000000_{START + 1:.6f}.png")
    Image.fromarray(NOISE).save(folder / f"Front_000001_{START + 2:.6f}.png", compress_level=0)
    small.save(folder / f"Front_000002_{START + 3:.6f}.qoi")
    data = io.BytesIO()
    small.save(data, format="JPEG")
    (folder / f"Front_000003_{START + 4:.6f}.jpg").write_bytes(data.getvalue()[:-9])
    small.save(folder.parent / "elsewhere.png")
    (folder / f"Front_000004_{START + 5:.6f}.png").symlink_to(folder.parent / "elsewhere.png")
    (folder / "cameras.yaml").write_text("Front: [nonsense\n")


def test_a_large_picture_of_another_format_is_not_read(tmp_path):
    """Pillow reads PostScript by another program."""
    path = tmp_path / "Front_1.jpg"
    Image.fromarray(NOISE).save(path, format="BMP")
    with pytest.raises(ValueError, match=r"Front_1\.jpg: damaged: cannot identify image file"):
        _read_photo(Photo(1.0, "Front", "jpeg", path), None)


@pytest.fixture
def page(tmp_path):
    messages = [*first_messages(), *(state(float(number)) for number in range(20)), picture(8.0)]
    messages.append(from_vehicle(imc.EstimatedMugState, 8.1, DETECTOR, id=3, x=1.0, y=0.5))
    messages.sort(key=lambda message: message.timestamp)
    (tmp_path / "Data.lsf").write_bytes(b"".join(map(imc.encode, messages)))
    write_photos(tmp_path / "Photos")
    player = LogLink(LogStates(tmp_path / "Data.lsf"))
    with served_page(player, player=player, log_root=tmp_path) as found:
        found.log_in()
        yield found


def at(page, position):
    assert json.loads(page.request("POST", "/api/replay", {"position": position})[1])["ok"]
    found = cameras(page)
    assert found["ok"], found
    return {camera["camera"]: camera for camera in found["cameras"]}


def data_of(page, camera):
    address = f"/api/picture?vehicle={NAME}&camera={quote(camera['camera'])}&number={camera['number']}"
    status, data, _ = page.request("GET", address)
    assert status == 200
    return data


def test_photos_are_those_of_the_present_time_in_forms_that_browsers_show(page):
    none = at(page, 0.5)["photos:Front"]
    assert (none["number"], none["age"], none["trouble"]) == (None, None, "")
    small = at(page, 1.7)["photos:Front"]
    assert (small["width"], small["height"], small["format"]) == (30, 20, "png")
    assert (small["time"], small["age"]) == (START + 1.0, pytest.approx(0.7, abs=0.01))
    large = at(page, 2.0)["photos:Front"]
    data = data_of(page, large)
    assert read_picture_header(data)[:3] == ("jpeg", 1600, 1600)
    assert len(data) < 4 << 20
    assert at(page, 3.0)["photos:Front"]["format"] == "jpg"
    truncated = at(page, 4.5)["photos:Front"]
    assert truncated["number"] is None
    assert truncated["trouble"] == f"Front_000003_{START + 4:.6f}.jpg: a JPEG without its end"
    assert at(page, 6.0)["photos:Front"] == truncated  # a link that leads out of the log is no picture of it
    assert at(page, 1.2)["photos:Front"]["number"] == small["number"]


def test_pictures_in_messages_are_shown_with_what_was_detected(page):
    assert set(at(page, 7.0)) == {"photos:Front"}
    found = at(page, 8.5)["7"]
    assert data_of(page, found) == jpeg(8.0)
    assert (found["label"], found["age"]) == ("Front", pytest.approx(0.5, abs=0.01))
    (mark,) = found["marks"]
    assert mark["label"] == "Detector 3"
    assert (mark["u"], mark["v"]) == pytest.approx((37.0, 14.0), abs=0.2)
    assert "7" not in at(page, 7.5)
    assert at(page, 9.0)["7"]["number"] > found["number"]  # a number never names two pictures


def test_pipes_among_the_photos_of_a_log_are_not_waited_for(tmp_path):
    for name in ("Camera_1.jpg", "cameras.yaml"):
        os.mkfifo(tmp_path / name)
    reports = []
    assert read_photo_cameras(tmp_path, reports.append) == {}
    assert "not a regular file" in reports[0]
    with pytest.raises(ValueError, match=r"Camera_1\.jpg: not a regular file"):
        _read_photo(Photo(1.0, "Camera", "jpeg", tmp_path / "Camera_1.jpg"), None)
