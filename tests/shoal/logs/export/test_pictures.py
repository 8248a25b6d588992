"""Exported pictures are of formats that other tools read; those that cannot be read are named and counted."""

import io

import cv2
import numpy as np
import pytest
from click.testing import CliRunner
from PIL import Image

import imc
from runtime.logs import summarize
from shoal.cli import main
from shoal.logs.export import Source
from shoal.logs.export.mcap import export_mcap
from tasks.vision.photos import photo_name, write_picture
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
    run = CliRunner().invoke(main, ["log", "export", str(log), str(tmp_path / "out"), "-f", form])
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
    source = Source(opened, summarize(opened))
    export_mcap(source, tmp_path / "a.mcap")
    reader = Reader(tmp_path / "a.mcap")
    (topic,) = (topic for topic in reader.topics if topic.endswith("/Front/image"))
    shown = [said for _, said in reader.on(topic)]
    assert [said.format for said in shown] == ["png", "png"]
    for said in shown:
        assert np.array_equal(np.asarray(Image.open(io.BytesIO(said.data)).convert("RGBA")), SHOT)
    assert source.unread == ["Front_000002_1700000002.000000.qoi: no picture"]
