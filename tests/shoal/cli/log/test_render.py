"""`shoal log render`: pictures after the fact are those of the run, on any number of processors, with their labels."""

import filecmp
import json
import shutil
from pathlib import Path

import numpy as np
import pytest
from PIL import Image

import imc
from runtime.kernel import VirtualClock
from runtime.profile import load_profile, read_config
from runtime.vehicle import build
from tests import command
from tests.outside import TOO_LARGE, largest_file
from tests.repeats import all_but

BELOW = """
[Vision.FisheyeCamera/Below{rate}]
Enabled = Always
Frame Rate = {rate}
Size = 40
Face Size = 20
Scene = {scene}
Save Images = true
"""
AHEAD = """
[Vision.Camera/Ahead]
Enabled = Simulation
Frame Rate = 4
Width = 60
Height = 45
Mount Position = 0.4, 0.1, -0.2
Mount Orientation = 0, -60, 10
Exposure Time = 0.02
Motion Blur Samples = 2
Readout Time = 0.03
Full Well = 4000
Read Noise = 10
Scene = {scene}
Save Images = true
"""
BRIEF = {"lauv-noptilus-1": 2.5, "hexa-00": 4.5, "otter": 2.5, "caravel": 2.5}  # s, of which some are without pictures
SLOW = 7  # Hz; SimulatedState comes at 20 Hz or so
SCENES = {"lauv-noptilus-1": "Seabed", "hexa-00": "Sea Surface", "otter": "Seabed", "caravel": "Seabed"}


def sailed(name, folder, cameras=None, seconds=7.0):
    """The folders of the logs of a virtual run of a shipped profile, if asked for with cameras of an ini file."""
    profile = load_profile(name)
    if cameras is not None:
        read_config(cameras, profile.config)
    made = build(profile, profile.parse_modes("Simulation"), clock=VirtualClock(profile.start_time_ns), log_root=folder)
    made.vehicle.start()
    made.vehicle.run(seconds)
    made.vehicle.close()
    return sorted((folder / name).glob("*/*"))


@pytest.fixture
def shoal(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)

    def render(*arguments, processes=1):
        return command.shoal("log", "render", "-j", str(processes), *arguments)

    return render


@pytest.fixture(scope="module")
def run(tmp_path_factory):
    """An ini file of cameras, the logs of a LAUV that has them, and those of the same LAUV without."""
    folder = tmp_path_factory.mktemp("runs")
    ini = folder / "cameras.ini"
    ini.write_text(BELOW.format(rate=SLOW, scene="Seabed") + AHEAD.format(scene="Seabed"))
    return ini, sailed("lauv-noptilus-1", folder / "with", ini), sailed("lauv-noptilus-1", folder / "without")


def same(one, other):
    """Whether two folders have the same files, byte for byte; they must have some."""
    names = sorted(path.name for path in one.iterdir())
    assert names == sorted(path.name for path in other.iterdir())
    assert names
    return filecmp.cmpfiles(one, other, names, shallow=False)[1:] == ([], [])


@pytest.mark.heavy
@pytest.mark.parametrize("which", [1, 2], ids=["of its own cameras", "of a vehicle without cameras"])
def test_pictures_after_the_fact_are_those_of_the_run(shoal, run, which):
    """Of each log of the run: the second one, that of a plan, begins in the middle of it."""
    ini, live, _ = run
    assert len(live) == 2
    for number, (log, with_cameras) in enumerate(zip(run[which], live, strict=True)):
        options = ["--camera", ini] if which == 2 else []
        done = shoal(log, f"out{number}", "--no-labels", *options)
        assert done.exit_code == 0, done.output
        assert same(Path(f"out{number}") / "Photos", with_cameras / "Photos")


@pytest.mark.heavy
@pytest.mark.computing
@pytest.mark.parametrize("name", all_but(["lauv-noptilus-1", "hexa-00"], SCENES))
def test_pictures_of_all_shipped_vehicles_are_those_of_the_run(shoal, tmp_path, name):
    cameras = [BELOW.format(rate=rate, scene=SCENES[name]) for rate in (SLOW, 20, 50, 100)]
    ini = tmp_path / "cameras.ini"
    ini.write_text("".join(cameras) + AHEAD.format(scene=SCENES[name]))
    live, without = (
        sailed(name, tmp_path / folder, of, BRIEF[name]) for folder, of in (("with", ini), ("without", None))
    )
    compared = 0
    for number, (log, with_cameras) in enumerate(zip(without, live, strict=True)):
        if not (with_cameras / "Photos").exists():
            continue
        assert shoal(log, f"out{number}", "--no-labels", "--camera", ini).exit_code == 0
        assert same(Path(f"out{number}") / "Photos", with_cameras / "Photos")
        compared += len(list((with_cameras / "Photos").iterdir()))
    assert compared > 300


@pytest.mark.heavy
def test_pictures_and_labels_are_the_same_on_one_processor_and_on_two(shoal, run):
    ini, _, (_, log) = run
    for count in (1, 2):
        done = shoal(log, f"out{count}", "--camera", ini, "--flow", processes=count)
        assert done.exit_code == 0, done.output
        assert "pictures in out" in done.output
    assert same(Path("out1/Photos"), Path("out2/Photos"))
    assert same(Path("out1/Labels"), Path("out2/Labels"))
    assert Path("out1/labels.json").read_bytes() == Path("out2/labels.json").read_bytes()


@pytest.mark.heavy
def test_labels_fit_each_other_and_the_pictures(shoal, run):
    ini, _, (_, log) = run
    assert shoal(log, "out", "--camera", ini, "--flow").exit_code == 0
    told = json.loads(Path("out/labels.json").read_text())
    glider, void = told["classes"]["glider"], told["classes"]["void"]
    pictures = {picture["file"]: picture for picture in told["pictures"]}
    assert sorted(pictures) == sorted(path.name for path in Path("out/Photos").glob("*.png"))
    seen = 0
    for file, picture in pictures.items():
        labels = Path("out/Labels") / file.removesuffix(".png")
        kinds, instances = (np.asarray(Image.open(f"{labels}.{name}.png")) for name in ("class", "instance"))
        arrays = np.load(f"{labels}.npz", allow_pickle=False)
        image = np.asarray(Image.open(Path("out/Photos") / file))
        assert kinds.shape == image.shape[:2] == (picture["height"], picture["width"]) == arrays["depth"].shape
        np.testing.assert_array_equal(image[..., 3] == 0, kinds == void)
        np.testing.assert_array_equal(np.isnan(arrays["distance"]), kinds == void)
        np.testing.assert_array_equal(instances > 0, kinds == glider)
        assert (np.abs(arrays["depth"]) <= arrays["distance"]).sum() == (kinds != void).sum()
        for thing in picture["objects"]:
            rows, columns = np.nonzero(instances == thing["instance"])
            assert thing["area"] == rows.size
            if rows.size:
                assert thing["box"] == [columns.min(), rows.min(), columns.max() + 1, rows.max() + 1]
                seen += 1
    assert seen > 5
    last = {picture["camera"]: picture["file"] for picture in told["pictures"]}.values()
    flow = {file: "flow" in np.load(f"out/Labels/{file.removesuffix('.png')}.npz") for file in pictures}
    assert [file for file, has_flow in flow.items() if not has_flow] == sorted(last)


@pytest.mark.heavy
def test_another_lens_and_other_gliders(shoal, run, tmp_path):
    _, _, (_, log) = run
    (tmp_path / "other.ini").write_text("[Vision.FisheyeCamera]\nSize = 200\nFrame Rate = 2\nLens = equisolid\n")
    (tmp_path / "world.ini").write_text("[World]\nGliders = 1 0.3, 2 -1, 3 1\nWater Visibility = 5\n")
    found = []
    for number, world in enumerate(([], ["--world", "world.ini"])):
        assert shoal(log, f"out{number}", "--camera", "other.ini", *world).exit_code == 0
        told = json.loads(Path(f"out{number}/labels.json").read_text())
        found.append({thing["instance"] for picture in told["pictures"] for thing in picture["objects"]})
    assert (found[0], found[1]) == ({1}, {1, 2, 3})
    assert not same(Path("out0/Photos"), Path("out1/Photos"))


WRONG = {
    "[Vision.FisheyeCamera]\nSize = 40\n[Require gone.ini]": "cameras.ini:3: error",
    "[Vision.FisheyeCamera]\n\nSize = many": "cameras.ini:3: error: Vision.FisheyeCamera: Size",
    "[Vision.FisheyeCamera]\nSice = 40": "cameras.ini:2: error: [Vision.FisheyeCamera] has no option 'Sice' (did you",
    "\n[Vision.FishCamera]\nSize = 40": "cameras.ini:2: error: [Vision.FishCamera] is not a camera that renders",
    "[Simulators.IMU]\nEnabled = Always": "cameras.ini:1: error: [Simulators.IMU] is not a camera that renders",
    "[Vision.FisheyeCamera]\nLens Coefficients = 1, 0, -1, 0": "cameras.ini:2: error: Vision.FisheyeCamera: Lens Coef",
    "[Vision.Camera]\nCalibration = gone.yaml": "gone.yaml",
    "[Vision.Camera]\nEnabled = Never": "there is no camera in this file",
    "[Vision.Camera]\nMount Position = 0, 0, 500": "no picture of Camera: the camera is in the ground",
}


@pytest.mark.parametrize("text", WRONG)
def test_wrong_cameras_are_reported_with_file_and_line(shoal, run, tmp_path, text):
    (tmp_path / "cameras.ini").write_text(text + "\n")
    done = shoal(run[2][0], "out", "--camera", "cameras.ini")
    assert done.exit_code == 2
    assert WRONG[text] in done.output
    assert [path.name for path in tmp_path.iterdir()] == ["cameras.ini"]


@pytest.mark.parametrize(
    ("text", "told"),
    [
        ("[World]\nWater = 3", "world.ini:2: error: [World] has no option 'Water'"),
        ("[World]\nWater Visibility = -3", "world.ini:2: error: [World] Water Visibility = -3 is not within"),
        ("[Word]\nGliders = none", "world.ini:1: error: [Word] is not of the world (did you mean"),
        ("[World]\nObjects = One\n[World/One]\nClass = Whale", "world.ini:2: error: [World] Objects has One, so"),
        ("[World]\nWater = 3\n[Foo]", "\nworld.ini:3: error: [Foo] is not of the world (known: World, Bathymetry)"),
        ("[World/One]\nClass = Glider", "world.ini:1: error: nothing reads [World/One] (write 'One' in Objects of [W"),
    ],
)
def test_a_wrong_world_is_reported_with_file_and_line(shoal, run, tmp_path, text, told):
    (tmp_path / "world.ini").write_text(text + "\n")
    done = shoal(run[2][0], "out", "--camera", run[0], "--world", "world.ini")
    assert done.exit_code == 2
    assert told in done.output


def without(log, folder, kind):
    """A copy of a log that lacks a message."""
    folder.mkdir()
    kept = [packet for _, packet in imc.Log(log).packets() if imc.header(packet).id != kind.ID]
    (folder / "Data.lsf").write_bytes(b"".join(kept))
    for name in ("Config.ini", "IMC.xml.gz"):
        shutil.copyfile(log / name, folder / name)
    return folder


def test_what_cannot_be_rendered_is_reported(shoal, run, tmp_path):
    ini, _, (log, _) = run
    for kind in (imc.SimulatedState, imc.EstimatedState):
        done = shoal(without(log, tmp_path / kind.__name__, kind), "out", "--camera", ini)
        assert (done.exit_code, f"the log has no {kind.__name__}" in done.output) == (2, True), done.output
    done = shoal(log, "out")
    assert (done.exit_code, "the vehicle had no camera" in done.output) == (2, True)
    done = shoal(log, "out", "--camera", "gone.ini")
    assert (done.exit_code, "gone.ini: error: the file cannot be read" in done.output) == (2, True)
    assert not Path("out").exists()
    Path("out").mkdir()
    done = shoal(log, "out", "--camera", ini)
    assert (done.exit_code, "already exists" in done.output) == (2, True)


@pytest.mark.heavy
@pytest.mark.parametrize("processes", [1, 2])
@pytest.mark.parametrize("size", [1000, 12000], ids=["picture", "labels"])
def test_a_full_disk_leaves_nothing_behind(shoal, run, tmp_path, processes, size):
    ini, _, (_, log) = run
    with largest_file(size):
        done = shoal(log, "out", "--camera", ini, processes=processes)
    assert (done.exit_code, "out: " in done.output, TOO_LARGE in done.output) == (2, True, True), done.output
    assert not list(tmp_path.iterdir())
