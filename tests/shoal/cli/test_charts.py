"""Charts in the commands of a user: check, run and test, with a shipped vehicle."""

import json
import shutil
import sys

import numpy as np
import pytest

from runtime.profile import load_profile
from shoal.scenarios import load_document
from shoal.scenarios.file_dependencies import profile_dependencies
from tests import command
from tests.world.charts.sea_floor import floor_of_grid, write_geotiff

SCENARIO = """
vehicle: {profile: lauv-noptilus-1}
world:
  bathymetry: {chart: chart.tif, radius: 0.3 km, positive: up}
limit: 2 s
metrics: {above: {first: altitude(SimulatedState)}, deep: {first: SimulatedState.z}}
expect: [{always: altitude(SimulatedState) > 30 m}]
"""


@pytest.fixture
def shoal():
    return command.shoal


@pytest.fixture
def mine(tmp_path, monkeypatch):
    """A profile of the shipped AUV with a chart beside it, in the working folder."""
    write_geotiff(tmp_path / "chart.tif", -floor_of_grid().astype("f4"))
    (tmp_path / "mine.ini").write_text("[Require lauv-noptilus-1.ini]\n[Bathymetry]\nData = chart.tif\n")
    monkeypatch.chdir(tmp_path)
    return tmp_path


@pytest.mark.heavy
def test_check_finds_nothing_wrong_or_the_part_without_depths(shoal, mine):
    result = shoal("check", "mine", "--set", "Bathymetry:Chart Radius=500")
    assert (result.exit_code, result.output) == (0, "mine: nothing wrong\n")
    depths = floor_of_grid()
    depths[60:] = np.nan
    write_geotiff(mine / "chart.tif", -depths.astype("f4"))
    result = shoal("check", "mine", "--set", "Bathymetry:Chart Radius=500")
    assert result.exit_code == 0
    assert "mine.ini:3: warning: [Bathymetry] chart.tif has no depths for 4" in result.output
    assert "there the bottom is at Out Of Bounds Depth, 120 m" in result.output


@pytest.mark.parametrize(
    ("name", "words"),
    [
        (
            "chart.bag",
            "is in no known format; the known ones: .tif (GeoTIFF), .tiff (GeoTIFF), .nc (NetCDF), .nc4 (NetCDF)",
        ),
        ("lost.tif", "is not there: neither beside the profile, nor in the working folder"),
    ],
)
def test_check_names_the_line_of_a_chart_that_cannot_be_used(shoal, mine, name, words):
    (mine / "mine.ini").write_text(f"[Require lauv-noptilus-1.ini]\n[Bathymetry]\nData = {name}\n")
    result = shoal("check", "mine")
    assert result.exit_code == 1
    assert f"mine.ini:3: error: [Bathymetry] Data = {name} {words}" in result.output
    assert result.output.endswith("\n1 error\n")


def test_a_missing_extra_is_named_and_nothing_runs_over_a_flat_bottom(shoal, mine, monkeypatch):
    monkeypatch.setitem(sys.modules, "rasterio", None)
    words = (
        "mine.ini:3: error: [Bathymetry] Data = chart.tif reading GeoTIFF needs rasterio: pip install 'shoal[charts]'"
    )
    result = shoal("check", "mine")
    assert (result.exit_code, words in result.output) == (1, True)
    result = shoal("run", "mine", "-p", "Simulation", "--clock", "virtual", "--for", "1")
    assert (result.exit_code, words in result.output) == (2, True)


def test_a_chart_travels_with_a_campaign_and_is_beside_the_scenario_that_is_included(mine):
    name = "Bathymetry: Data = chart.tif"
    assert profile_dependencies(load_profile("mine"), ()).data[name] == mine / "chart.tif"
    (mine / "lib").mkdir()
    (mine / "chart.tif").rename(mine / "lib" / "chart.tif")
    (mine / "lib" / "base.yaml").write_text(SCENARIO)
    (mine / "deep.scenario.yaml").write_text("include: lib/base.yaml\n")
    document = load_document(mine / "deep.scenario.yaml")
    assert document.dependencies().data == {"Bathymetry: Data = lib/chart.tif": mine / "lib" / "chart.tif"}
    assert document.scenario().vehicles


@pytest.mark.heavy
def test_a_scenario_names_a_chart_beside_it(shoal, mine):
    folder = mine / "scenarios"
    folder.mkdir()
    (mine / "chart.tif").rename(folder / "chart.tif")
    (folder / "deep.scenario.yaml").write_text(SCENARIO)
    result = shoal("test", str(folder))
    assert result.exit_code == 0, result.output
    (folder / "deep.scenario.yaml").write_text(SCENARIO.replace("chart.tif", "lost.tif"))
    result = shoal("test", str(folder))
    assert result.exit_code == 2
    assert "deep.scenario.yaml:4: [Bathymetry] Data = lost.tif is not there" in result.output
    both = SCENARIO.replace("radius:", "soundings: [[0, 0, 9]], radius:")
    (folder / "deep.scenario.yaml").write_text(both)
    assert "the bottom has either soundings or a chart" in shoal("test", str(folder)).output


@pytest.mark.heavy
def test_a_log_whose_chart_is_missing_is_reported_with_the_remedy(shoal, mine):
    """The report without its comparison of detections looked like that of a run without truth."""
    words = ("run", "mine", "-p", "Simulation", "--clock", "virtual", "--for", "12", "--set", "Bathymetry:Positive=up")
    assert shoal(*words, "--set", "Bathymetry:Chart Radius=300", "--set", "World:Gliders=0 0").exit_code == 0
    log = str(next(mine.glob("log/*/*/*_dive")))

    def report():
        result = shoal("log", "report", log, "-o", "page.html")
        assert result.exit_code == 0, result.output
        return result.stderr, (mine / "page.html").read_text()

    stderr, page = report()
    assert (stderr, "false alarms" in page) == ("", True)
    assert "chart     chart.tif\n" in shoal("log", "info", log).output
    (mine / "chart.tif").rename(mine / "taken-away.tif")
    remedy = "chart.tif is neither beside the log nor in the working folder: copy it there"
    stderr, page = report()
    assert stderr == f"detections are not compared with the truth: the chart {remedy}\n"
    assert f"Not compared: the chart {remedy}." in page
    assert f"chart     {remedy}, for the report" in shoal("log", "info", log).output
    found = json.loads(shoal("log", "info", log, "--json").output)
    assert found["chart"] == {"name": "chart.tif", "is_found": False}
    for again in (("resim", log, "-t", "Simulators.Environment"), ("rewind", log, "--at", "3")):
        result = shoal(*again)
        assert result.exit_code == 2
        assert "[Bathymetry] Data = chart.tif is not there" in result.output
    shutil.copy(mine / "taken-away.tif", f"{log}/chart.tif")
    assert report()[0] == ""
