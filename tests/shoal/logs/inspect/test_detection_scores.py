"""A report judges detections by the truth of the run."""

import math
import re

import pytest

import imc
from runtime.kernel import VirtualClock
from runtime.logs import summarize
from runtime.profile import load_profile
from runtime.vehicle import build
from shoal.logs.edit import cut
from shoal.logs.inspect import render_report
from shoal.logs.inspect.report_data import read_report_data
from shoal.logs.selection import PacketSelection

HEAD = "MUG detections and the truth"
MUG_CAMERA = "Simulators.MUGDetectionCamera"


def sail(folder, seconds):
    """The log of a shipped AUV with a camera that misses one in five gliders, and makes up one in ten seconds."""
    overrides = ["World:Gliders=1 0.3, 8 -4, 15 10", "Vision.FisheyeCamera:Save Images=false"]
    overrides += [f"{MUG_CAMERA}:Detection Probability=0.8", f"{MUG_CAMERA}:False Alarm Rate=0.1"]
    return run("lauv-noptilus-1", overrides, folder, seconds)


def run(name, overrides, folder, seconds):
    """The last log of a shipped vehicle with camera and detector."""
    profile = load_profile(name, overrides=overrides)
    selected = profile.parse_modes("Simulation,Camera,Detector")
    vehicle = build(profile, selected, clock=VirtualClock(profile.start_time_ns), log_root=folder).vehicle
    vehicle.start()
    vehicle.run(seconds)
    vehicle.close()
    return sorted(folder.rglob("Data.lsf*"))[-1].parent


@pytest.fixture(scope="module")
def sailed(tmp_path_factory):
    return sail(tmp_path_factory.mktemp("sailed"), 30.0)


def judged(folder):
    log = imc.Log(folder)
    return {found.label: found for found in read_report_data(log, summarize(log)).detection_scores}


@pytest.mark.heavy
@pytest.mark.computing
def test_misses_false_alarms_switches_and_nees_of_a_shipped_vehicle(tmp_path):
    found = judged(sail(tmp_path, 85.0))
    assert set(found) == {"MUG Camera", "MUG Detector"}
    camera, detector = found["MUG Camera"], found["MUG Detector"]
    assert camera.gliders == detector.gliders == (1, 2, 3)
    looks = [thing.pictures for thing in camera.score.objects]
    hits = [thing.detections for thing in camera.score.objects]
    assert max(looks) > 50
    for seen, hit in zip(looks, hits, strict=True):
        assert abs(hit - 0.8 * seen) <= 4.0 * math.sqrt(0.16 * seen) + 2.0
    assert 2 <= camera.score.false_alarms <= 20
    assert camera.score.objects[0].nees == pytest.approx(2.0, abs=1.0)
    assert detector.score.false_alarms == 0
    for thing in detector.score.objects:
        assert thing.pictures >= 10
        assert thing.missed_picture_count <= 0.1 * thing.pictures
        assert (len(thing.ids), thing.switches) == (1, 0)
        assert thing.rms < 0.5
        assert thing.nees < 2.4


@pytest.mark.heavy
@pytest.mark.parametrize("scene", ["Sea Surface", "Seabed"])
def test_gliders_below_a_flying_vehicle_are_in_view_where_no_bottom_is_known(tmp_path, scene):
    overrides = ["World:Gliders=1 0.3, 8 -4", "Vision.FisheyeCamera:Save Images=false"]
    found = judged(run("hexa-00", [*overrides, f"Vision.FisheyeCamera:Scene={scene}"], tmp_path, 20.0))
    for thing in found["MUG Detector"].score.objects:
        assert thing.pictures >= 5
        assert thing.missed_picture_count == 0
        assert 0.0 < thing.nees < 10.0


@pytest.mark.heavy
def test_detections_of_pictures_before_the_log_do_not_count(sailed, tmp_path):
    """The log begins between a picture and what is detected in it."""
    log = imc.Log(sailed)
    summary = summarize(log)
    entity = next(n for n in range(256) if summary.names.entity_label(summary.owner, n) == "MUG Detector")
    first = next(log.messages("EstimatedMugState", src=summary.owner, src_ent=entity)).timestamp
    cut(log, tmp_path / "part", PacketSelection(first - 0.01, first + 30.0), summary.owner)
    (tmp_path / "part" / "Config.ini").write_bytes((sailed / "Config.ini").read_bytes())
    of = [entry for entry in imc.Log(tmp_path / "part").messages("EstimatedMugState") if entry.src_ent == entity]
    early = [entry for entry in of if entry.timestamp < first + 0.05]
    found = judged(tmp_path / "part")["MUG Detector"].score
    assert early
    assert found.false_alarms + sum(thing.detections for thing in found.objects) == len(of) - len(early)


def test_the_page_has_a_table_of_them(sailed):
    text = render_report(imc.Log(sailed))
    assert HEAD in re.findall(r"<h2>(.*?)</h2>", text)
    table = text[text.index(HEAD) :]
    for words in ("MUG Camera", "MUG Detector", "false alarms", "id switches", "NEES"):
        assert words in table


@pytest.mark.parametrize(
    "text",
    [
        None,
        "",
        "\x00\xff not an ini",
        "[General]\nVehicle = lauv-noptilus-1\n[World]\nGliders = here there\n",
        "[General]\nVehicle = lauv-noptilus-1\n[Vision.Camera]\nEnabled = Always\nCalibration = /nowhere.yaml\n",
        "[General]\nVehicle = lauv-noptilus-1\n[Vision.MUGDetector]\nPixel Error = many\n",
    ],
)
def test_a_log_without_a_configuration_that_can_be_read_is_not_judged_and_the_reason_is_reported(text, make_log):
    start, vehicle = 1_767_225_600.0, 0x001A
    rows = [imc.SimulatedState(timestamp=start + k, src=vehicle, lat=0.7) for k in range(9)]
    rows += [imc.EstimatedState(timestamp=start + k, src=vehicle, lat=0.7) for k in range(9)]
    rows += [imc.EstimatedMugState(timestamp=start + k, src=vehicle, id=1, x=1.0, y=0.3) for k in range(9)]
    path = make_log(rows)
    if text is not None:
        (path / "Config.ini" if path.is_dir() else path.parent / "Config.ini").write_text(text, encoding="latin-1")
    page = render_report(imc.Log(path))
    assert ("Not compared: Config.ini of the log cannot be used: " in page) == (text not in ("", None))
    assert "NEES" not in page or text == ""


def test_no_code_of_a_log_runs(sailed, tmp_path, monkeypatch):
    """A stranger's configuration names a function and a module; neither is imported."""
    (tmp_path / "evil.py").write_text(f"open({str(tmp_path / 'ran')!r}, 'w')\n")
    monkeypatch.syspath_prepend(tmp_path)
    monkeypatch.chdir(tmp_path)
    path = tmp_path / "log"
    path.mkdir()
    for file in sailed.iterdir():
        if file.is_file():
            (path / file.name).write_bytes(file.read_bytes())
    more = "\n[Vision.MUGDetector/Evil]\nEnabled = Always\nDetector = Function\nFunction = evil:find\n"
    more += "[evil]\nEnabled = Always\n[Vision.Camera/evil]\nEnabled = Always\n"
    with (path / "Config.ini").open("a") as file:
        file.write(more)
    assert HEAD in render_report(imc.Log(path))
    assert not (tmp_path / "ran").exists()


ROLLING = """
[General]
Vehicle = lauv-noptilus-1
[World]
Gliders = 0 {east}
Gliders Lie On = Depth
Gliders Depth = 10
[Vision.Camera]
Enabled = Always
Entity Label = Camera
Width = 800
Height = 800
Field of View = 90
Mount Orientation = 0, -90, 90
Readout Time = {readout}
[Vision.MUGDetector]
Enabled = Always
Entity Label = Detector
Camera = Camera
Target Plane = Depth
Target Depth = 10
Pixel Error = 2
Shape Error = 0
Attitude Error = 0
Heading Error = 0
Height Error = 0
Height Error Share = 0
Position Error = 0
"""
ROLL_RATE, FOCAL, AMISS = 1.0, 400.0, 0.1  # rad/s; px; m


def down_the_picture(east, readout):
    """The angle (rad) from its axis at which a camera sees a glider in the row that is exposed then, 10 m below."""
    angle = math.atan(east / 10.0)
    for _ in range(60):
        row_time = -readout * FOCAL * math.tan(angle) / 800.0  # rows count from the right, which is east
        angle = math.atan(east / 10.0) + ROLL_RATE * row_time
    return angle


@pytest.mark.parametrize("readout", [0.0, 0.3])
@pytest.mark.parametrize("east", [4.0, -4.0])
def test_the_nees_of_a_rolling_shutter_is_that_of_the_row(make_log, east, readout):
    """A vehicle rolls at 1 rad/s, and a detection is 0.1 m too far east, which is more or fewer pixels."""
    start, step, latency = 1_767_225_600.0, 0.01, 0.1
    own = {"src": 0x001A}
    rows = [imc.EntityInfo(timestamp=start, id=n, label=label, **own) for n, label in ((1, "Camera"), (2, "Detector"))]
    for k in range(201):
        rows.append(imc.SimulatedState(timestamp=start + k * step, phi=ROLL_RATE * (k - 100) * step, **own))
    exposed = start + 1.0
    rows.append(imc.CameraFrame(timestamp=exposed + 0.05, time=exposed, src_ent=1, **own))
    said = imc.EstimatedMugState(timestamp=exposed + latency, src_ent=2, id=1, x=0.0, y=east + AMISS, **own)
    rows.append(said)
    folder = make_log(sorted(rows, key=lambda message: message.timestamp))
    (folder / "Config.ini").write_text(ROLLING.format(east=east, readout=readout))
    (thing,) = judged(folder)["Detector"].score.objects
    angle = down_the_picture(east, readout)
    per_pixel = 10.0 / math.cos(math.atan(east / 10.0)) ** 2 * math.cos(angle) ** 2 / FOCAL
    assert thing.nees == pytest.approx((AMISS / (2.0 * per_pixel)) ** 2, rel=2e-3)
