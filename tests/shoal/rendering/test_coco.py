"""COCO data sets: their masks, boxes and files fit each other, the labels, and the pictures of the run."""

import json
from pathlib import Path

import numpy as np
import pytest
from PIL import Image
from pycocotools.coco import COCO

import imc
from runtime.kernel import VirtualClock
from runtime.profile import load_profile
from runtime.vehicle import build
from shoal.rendering.coco import run_lengths
from tests import command

SIZES = ("Vision.FisheyeCamera:Size=150", "Vision.FisheyeCamera:Face Size=75", "Vision.FisheyeCamera:Frame Rate=2")
FAINT = 15  # of 255, by which the pixels of an edge that a glider fills in part may differ
GLIDERS = "World:Gliders=1 0.3, 3 -1, 5 1, 7 0"


@pytest.fixture
def log(tmp_path, monkeypatch):
    """A function that makes the log of ten seconds of an otter, and returns its folder."""
    monkeypatch.chdir(tmp_path)

    def sail(*overrides, order=None):
        profile = load_profile("otter", overrides=[*SIZES, GLIDERS, *overrides])
        made = build(profile, profile.parse_modes("Simulation,Camera"), clock=VirtualClock(profile.start_time_ns))
        vehicle = made.vehicle
        vehicle.start()
        vehicle.run(5.2)
        if order is not None:
            message = imc.Event(topic="Take Pictures", data=order, src=vehicle.system, src_ent=255, timestamp=0.0)
            vehicle.bus.deliver_and_send(message, imc.encode(message), None)
        vehicle.run(5.0)
        vehicle.close()
        return max((tmp_path / "log" / "otter").glob("*/*"), key=lambda folder: len(list(folder.glob("Photos/*"))))

    return sail


def shoal(*words):
    done = command.shoal("log", *words)
    return done.exit_code, done.output


def mask(segmentation):
    height, width = segmentation["size"]
    counts = segmentation["counts"]
    inside = np.repeat(np.arange(len(counts)) % 2 == 1, counts)
    assert inside.size == height * width
    return inside.reshape(width, height).T


@pytest.mark.heavy
@pytest.mark.computing
def test_a_data_set_has_the_pictures_of_the_run_with_boxes_and_masks(log):
    folder = log()
    assert shoal("export", folder, "set", "-f", "coco")[0] == 0
    assert shoal("render", folder, "again", "-j", 1)[0] == 0
    found, again = (json.loads(Path(name, "annotations.json").read_text()) for name in ("set", "again"))
    names = {4: "glider", 5: "board"}
    assert found["categories"] == [{"id": n, "name": name, "supercategory": "object"} for n, name in names.items()]
    files = [Path(image["file_name"]) for image in found["images"]]
    assert [path.name for path in files] == sorted(path.name for path in (folder / "Photos").glob("*.png"))
    assert all((Path("set") / path).read_bytes() == (folder / "Photos" / path.name).read_bytes() for path in files)
    assert found["annotations"] == again["annotations"]
    theirs = COCO("set/annotations.json")
    assert sorted(theirs.getImgIds()) == sorted(image["id"] for image in found["images"])
    for annotation in theirs.loadAnns(theirs.getAnnIds()):
        inside = theirs.annToMask(annotation)
        assert (inside == mask(annotation["segmentation"])).all()
        assert inside.sum() == annotation["area"]
        rows, columns = np.nonzero(inside)
        box = [columns.min(), rows.min(), np.ptp(columns) + 1, np.ptp(rows) + 1]
        assert annotation["bbox"] == box
    assert [path.name for path in files] == [Path(image["file_name"]).name for image in again["images"]]
    images = {image["id"]: image for image in found["images"]}
    assert [each["id"] for each in found["annotations"]] == list(range(1, len(found["annotations"]) + 1))
    assert len({each["attributes"]["instance"] for each in found["annotations"]}) > 2
    for each in found["annotations"]:
        image = images[each["image_id"]]
        stem = Path(image["file_name"]).stem
        own = np.asarray(Image.open(f"again/Labels/{stem}.instance.png")) == each["attributes"]["instance"]
        np.testing.assert_array_equal(mask(each["segmentation"]), own)
        rows, columns = np.nonzero(own)
        left, top, width, height = each["bbox"]
        assert (left, top) == (columns.min(), rows.min())
        assert (left + width, top + height) == (columns.max() + 1, rows.max() + 1)
        assert (each["area"], each["category_id"], each["iscrowd"]) == (rows.size, 4, 0)
    first = images[1]
    assert (first["width"], first["height"], first["camera"]) == (150, 150, "Fisheye Camera")
    assert first["date_captured"].startswith("2026-01-01 00:00:0")


@pytest.mark.heavy
@pytest.mark.computing
def test_masks_of_a_rolling_shutter_are_those_of_its_pictures(log):
    """What the picture of a turning boat shows of gliders is what it has that the same one without gliders has not."""
    slow = ("Readout Time=0.6", "Size=400", "Face Size=1200", "Field of View=90", "Frame Rate=1")
    folder = log(*(f"Vision.FisheyeCamera:{option}" for option in slow), "World:Gliders=1 0.3, 3 -1, 5 1, 4 3, 2 -3")
    Path("bare.ini").write_text("[World]\nGliders = none\n")
    assert shoal("export", folder, "set", "-f", "coco")[0] == 0
    assert shoal("render", folder, "bare", "--world", "bare.ini", "--no-labels", "-j", 1)[0] == 0
    found, both, either = json.loads(Path("set/annotations.json").read_text()), 0, 0
    for image in found["images"]:
        name = Path(image["file_name"]).name
        one, other = (
            np.asarray(Image.open(path / name)).astype(int) for path in (Path("set/images"), Path("bare/Photos"))
        )
        drawn, masks = np.abs(one - other)[..., :3].max(axis=-1) > FAINT, np.zeros(one.shape[:2], bool)
        for each in found["annotations"]:
            if each["image_id"] == image["id"]:
                masks |= mask(each["segmentation"])
        both, either = both + np.count_nonzero(drawn & masks), either + np.count_nonzero(drawn | masks)
    assert either > 500
    assert both / either >= 0.95, f"{both} of {either} px"


@pytest.mark.heavy
def test_pictures_that_were_asked_for_have_numbers_of_their_own(log):
    folder = log("Vision.FisheyeCamera:Save Images=false", order="count=3;period=1")
    (folder / "Photos" / "Other_Camera_000000_1767225601.000000.png").write_bytes(b"")
    code, said = shoal("export", folder, "set", "-f", "coco", "--from", "2026-01-01T00:00:06")
    assert (code, "2 pictures in set" in said) == (0, True), said
    assert "skipped: 1 message: Photos/Other_Camera_000000_1767225601.000000.png is of no camera of the run" in said
    found = json.loads(Path("set/annotations.json").read_text())
    assert [image["file_name"][-28:-18] for image in found["images"]] == ["000001_176", "000002_176"]


@pytest.mark.heavy
def test_without_pictures_it_says_what_makes_some(log):
    folder = log("Vision.FisheyeCamera:Save Images=false")
    code, said = shoal("export", folder, "set", "-f", "coco")
    assert (code, "no pictures beside it in Photos; shoal log render makes some" in said) == (2, True), said
    assert not Path("set").exists()


def test_runs_begin_outside_of_the_mask():
    assert run_lengths(np.array([[True, False], [True, True]])) == [0, 2, 1, 1]
    assert run_lengths(np.array([[False, True, True]])) == [1, 2]
    assert run_lengths(np.zeros((2, 2), bool)) == [4]
