"""Exported pictures are of formats that other tools read; those that cannot be read are named and counted."""

import io

import cv2
import numpy as np
import pytest
from PIL import Image

import imc
from runtime.logs import summarize
from shoal.logs.export import LogSource
from shoal.logs.export.mcap import export_mcap
from tasks.vision.cameras.picture_files import photo_name, write_picture
from tests.command import shoal
from tests.shoal.logs.export.mcap_reader import Reader

SHOT = np.full((4, 6, 4), 255, np.uint8)
SHOT[..., 0] = np.arange(6) * 40


@pytest.fixture
def log(make_log):
    """A log with a QOI, a PNG, and a QOI that ends early."""
    folder = make_log([imc.Heartbeat(src=0x1A, timestamp=1.7e9)])
    for number, kind in enumerate(("QOI", "PNG", "QOI")):
        assert not write_picture(folder / "Photos" / photo_name("Front", number, 1.7e9 + number, kind), SHOT, kind)
    (folder / "Photos" / photo_name("Front", 2, 1.7e9 + 2, "QOI")).write_bytes(b"qoif")
    return folder


@pytest.mark.parametrize(
    ("form", "table", "place"), [("euroc", "mav0/cam0/data.csv", "mav0/cam0/data"), ("tum", "rgb.txt", "")]
)
def test_data_sets_have_png_of_qoi(log, tmp_path, form, table, place):
    run = shoal("log", "export", str(log), str(tmp_path / "out"), "-f", form)
    assert run.exit_code == 0, run.output
    assert "skipped: 1 picture: Front_000002_1700000002.000000.qoi: no picture" in run.output
    rows = [line for line in (tmp_path / "out" / table).read_text().splitlines() if not line.startswith("#")]
    names = [row.replace(",", " ").split()[1] for row in rows]
    assert len(names) == 2
    for name in names:
        picture = cv2.imread(str(tmp_path / "out" / place / name))
        assert np.array_equal(picture[..., ::-1], SHOT[..., :3])


def test_mcap_has_png_of_qoi(log, tmp_path):
    opened = imc.Log(log)
    source = LogSource(opened, summarize(opened))
    export_mcap(source, tmp_path / "a.mcap")
    reader = Reader(tmp_path / "a.mcap")
    (topic,) = (topic for topic in reader.topics if topic.endswith("/Front/image"))
    shown = [said for _, said in reader.on(topic)]
    assert [said.format for said in shown] == ["png", "png"]
    for said in shown:
        assert np.array_equal(np.asarray(Image.open(io.BytesIO(said.data)).convert("RGBA")), SHOT)
    assert source.unreadable_photos == ["Front_000002_1700000002.000000.qoi: no picture"]


@pytest.mark.parametrize("form", ["euroc", "tum", "mcap"])
def test_broken_png_and_jpeg_are_named_and_left_out(log, tmp_path, form):
    photos = log / "Photos"
    png = (photos / photo_name("Front", 1, 1.7e9 + 1, "PNG")).read_bytes()
    packed = io.BytesIO()
    Image.fromarray(SHOT[..., :3]).save(packed, format="JPEG")
    jpeg = packed.getvalue()
    broken = {"7.png": b"junk", "8.png": png[:-20], "9.png": b"", "10.jpg": jpeg[:-20], "11.jpg": b"\xff\xd8"}
    for name, data in (broken | {"12.jpg": jpeg}).items():
        number, _, ending = name.partition(".")
        (photos / f"Front_{int(number):06}_17000000{int(number):02}.000000.{ending}").write_bytes(data)
    run = shoal("log", "export", str(log), str(tmp_path / "out"), "-f", form)
    assert run.exit_code == 1, run.output  # most of the pictures
    assert f"skipped: {len(broken) + 1} pictures: " in run.output
    assert "Front_000007_1700000007.000000.png: no picture" in run.output
    if form != "mcap":
        written = [path for path in (tmp_path / "out").rglob("*") if path.suffix in (".png", ".jpg")]
        assert len(written) == 3
