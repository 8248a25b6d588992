"""Detections in MCAP files, where the pictures and the world have what was detected."""

import math

import numpy as np
import pytest

import imc
from autonomy.plans import sequential_plan
from runtime.logs import summarize
from shoal.logs.export import LogSource
from shoal.logs.export.mcap import export_mcap
from shoal.logs.selection import PacketSelection
from shoal.missions import Mission, prepare
from shoal.rendering import find_exposures
from support.wgs84 import displace
from tests.outside import ALONE
from tests.shoal.logs.export.mcap_reader import Reader

CAMERA = ("Size=400", "Face Size=200", "Frame Rate=2", "Save Images=true")
GLIDERS = "World:Gliders=1 0.3, 8 -4"
SECONDS = 25.0
NAME = "/lauv_noptilus_1"
PLACE = math.radians(41.185), math.radians(-8.7062)  # where its world has its origin


def run(folder, *settings, overrides=(), plan=None):
    """The longest log of a LAUV that finds gliders in its pictures, at rest or on a plan."""
    options = [*(f"Vision.FisheyeCamera:{option}" for option in (*CAMERA, *settings)), GLIDERS, *overrides, *ALONE]
    modes = ["Simulation", "Camera", "Detector"]
    made = prepare("lauv-noptilus-1", modes=modes, overrides=options, log_root=folder, state_folder=folder / "db")
    if plan is None:
        made.vehicle.start()
        made.vehicle.run(SECONDS)
        made.vehicle.close()
    else:
        Mission(made.vehicle, plan).fly(SECONDS + 10.0)
    log = imc.Log(max(folder.rglob("Data.lsf.gz"), key=lambda path: path.stat().st_size).parent)
    return LogSource(log, summarize(log))


@pytest.fixture(scope="module")
def source(tmp_path_factory):
    return run(tmp_path_factory.mktemp("run"))


@pytest.fixture(scope="module")
def reader(source, tmp_path_factory):
    path = tmp_path_factory.mktemp("mcap") / "a.mcap"
    export_mcap(source, path, raw=False)
    return Reader(path)


def distances_of_circles(source, reader):
    """px from each circle in the pictures to the nearest glider that its labels show, by the entity that found it."""
    pictures = [message.log_time for message, _ in reader.on(f"{NAME}/Fisheye_Camera/image")]
    found = reader.on(f"{NAME}/Fisheye_Camera/annotations")
    assert [message.log_time for message, _ in found] == pictures
    assert len(pictures) > 20
    seen = find_exposures(source.log)
    shots = {round(shot.time * 1e6) * 1000: shot for shot in seen.pictures}
    misses: dict[str, list[float]] = {}
    for message, said in found:
        shot = shots[message.log_time]
        labels = seen.camera_of(shot).shutter.labels(shot.standpoints, shot.gliders)
        boxes = np.array([box.box for box in labels.boxes if box.area > 5], float).reshape(-1, 4)
        middles = (boxes[:, :2] + boxes[:, 2:]) / 2
        assert len(said.texts) == len(said.circles)
        for circle, words in zip(said.circles, said.texts, strict=True):
            assert (said.timestamp.sec, circle.timestamp.nanosec) == divmod(message.log_time, 10**9)
            place = circle.position.x, circle.position.y
            if len(middles):
                misses.setdefault(words.text.rpartition(" ")[0], []).append(np.min(np.hypot(*(middles - place).T)))
    return misses


@pytest.mark.heavy
@pytest.mark.computing
def test_pictures_have_circles_around_the_gliders_that_they_show(source, reader):
    misses = distances_of_circles(source, reader)
    assert len(misses["MUG Detector"]) > 20
    assert np.median(misses["MUG Detector"]) < 3.0  # px


@pytest.mark.heavy
@pytest.mark.computing
def test_circles_lie_in_the_rows_of_a_rolling_shutter(tmp_path):
    """On the way: a vehicle at rest shows each glider where the middle row does."""
    exact = ("Simulators.MUGDetectionCamera:Error Model=None", "World:Gliders=8 3, 14 -3, 20 2, 26 -2, 32 3")
    lat, lon, _ = displace(*PLACE, 0.0, 60.0, 0.0)
    plan = sequential_plan("north", {"away": imc.Goto(lat=lat, lon=lon, z=1.0, z_units=imc.ZUnits.DEPTH, speed=1.6)})
    source = run(tmp_path, "Readout Time=0.8", "Frame Rate=1", "Face Size=400", overrides=exact, plan=plan)
    export_mcap(source, tmp_path / "a.mcap", raw=False)
    misses = distances_of_circles(source, Reader(tmp_path / "a.mcap"))
    assert min(len(misses["MUG Camera"]), len(misses["MUG Detector"])) > 8
    assert np.median(misses["MUG Camera"]) < 1.5  # px
    assert np.median(misses["MUG Detector"]) < 1.5


@pytest.mark.heavy
def test_the_scene_has_the_gliders_where_the_vehicle_believes_them(source, reader):
    found = reader.on(f"{NAME}/EstimatedMugState/MUG_Detector/scene")
    entity = next(number for (_, number), label in source.names.labels.items() if label == "MUG Detector")
    rows = source.log.array("EstimatedMugState")
    rows = rows[rows["src_ent"] == entity]
    states = source.log.array("EstimatedState")
    (topic,) = [topic for topic in reader.topics if topic.startswith(f"{NAME}/EstimatedState") and "pose" in topic]
    poses = [said.pose.position for _, said in reader.on(topic)]
    assert len(found) == len(rows) > 20
    assert len(poses) == len(states)
    for (message, said), row in zip(found, rows, strict=True):
        (thing,) = said.entities
        assert (thing.id, thing.frame_id, len(said.deletions)) == (str(row["id"]), "map", 0)
        assert message.log_time == pytest.approx(row["timestamp"] * 1e9, abs=500)
        near = int(np.argmin(np.abs(states["timestamp"] - row["timestamp"])))
        place, here = thing.spheres[0].pose.position, poses[near]
        offset = place.y - here.y, place.x - here.x, here.z - place.z
        np.testing.assert_allclose(offset, (row["x"], row["y"], states["alt"][near]), atol=0.1)
        assert (thing.texts[0].text, thing.texts[0].billboard) == (f"MUG Detector {row['id']}", True)


def test_without_states_only_the_messages_are_there(source, tmp_path):
    chosen = PacketSelection(types=frozenset({imc.EstimatedMugState.ID}))
    export_mcap(LogSource(source.log, source.summary, chosen), tmp_path / "a.mcap", raw=False)
    found = Reader(tmp_path / "a.mcap")
    assert {topic.rpartition("/")[2] for topic in found.topics} == {
        *("MUG_Camera", "MUG_Detector", "image", "camera_info", "tf")
    }
