"""What all formats share: which way is up, gaps, formats that are not known, and libraries that are missing."""

import re
import sys

import numpy as np
import pytest

from tests.world.charts.sea_floor import ORIGIN, WINDOW, floor_of_grid, write_geotiff, write_netcdf
from world.charts import FORMATS, find_chart_suffix, read_chart
from world.charts.coordinates import require_library
from world.sea import Bathymetry, BathymetryError


def test_which_way_is_up_is_said_by_the_option_or_the_file_or_by_negative_values(tmp_path):
    path, depths = tmp_path / "chart.tif", floor_of_grid()
    write_geotiff(path, -depths.astype("f4"))
    assert read_chart(path, WINDOW).soundings[2].min() > 20.0
    for values in (depths, 40.0 - depths):
        write_geotiff(path, values.astype("f4"))
        with pytest.raises(
            BathymetryError, match=r"has values from .* m and does not define which are below the water: set"
        ):
            read_chart(path, WINDOW)
    up, down = (read_chart(path, WINDOW, None, positive).soundings[2] for positive in ("up", "down"))
    np.testing.assert_array_equal(up, -down)
    write_geotiff(path, depths.astype("f4"))
    assert read_chart(path, WINDOW, None, "down").soundings[2].min() > 20.0
    with pytest.raises(BathymetryError, match=r"has no water within 500 m .*: should Chart Positive be the other way"):
        read_chart(path, WINDOW, None, "up")


def test_the_option_wins_over_a_name(tmp_path):
    write_netcdf(tmp_path / "chart.nc", -floor_of_grid(), name="depth")
    with pytest.raises(BathymetryError, match=r"has no water within 500 m .*: should Chart Positive be the other way"):
        read_chart(tmp_path / "chart.nc", WINDOW)
    assert read_chart(tmp_path / "chart.nc", WINDOW, None, "up").soundings[2].min() > 20.0


def test_gaps_take_the_nearest_depths_and_are_reported_beyond_their_radius(tmp_path):
    path, depths = tmp_path / "chart.tif", floor_of_grid()
    write_geotiff(path, -depths.astype("f4"))
    whole = read_chart(path, WINDOW)
    assert whole.describe_gaps(Bathymetry(whole.soundings.T, whole.radius, 120.0)) == ""
    depths[:60] = np.nan
    write_geotiff(path, -depths.astype("f4"))
    half = read_chart(path, WINDOW)
    sea = Bathymetry(half.soundings.T, half.radius, 120.0, ORIGIN)
    assert sea.is_known(30.0, 0.0)
    assert 35.0 < sea.depth(30.0, 0.0) < 45.0
    assert not sea.is_known(80.0, 0.0)
    assert sea.depth(80.0, 0.0) == 120.0
    words = (
        r"chart.tif has no depths for 4\d % of the 1000 m x 1000 m around the origin: there the bottom is at .*, 120 m"
    )
    assert re.fullmatch(words, half.describe_gaps(sea))
    assert half.describe().startswith("the bottom is that of chart.tif: ")
    depths[:] = np.nan
    write_geotiff(path, depths.astype("f4"))
    with pytest.raises(
        BathymetryError, match=r"has no depth within 500 m of the origin 41.185, -8.7062: all cells are empty"
    ):
        read_chart(path, WINDOW)


def test_a_format_that_is_not_known_lists_those_that_are(tmp_path):
    (tmp_path / "chart.bag").write_bytes(b"\x89HDF")
    with pytest.raises(BathymetryError, match="is in no known format; the known ones: ") as error:
        read_chart(tmp_path / "chart.bag", WINDOW)
    assert all(suffix in str(error.value) for suffix in FORMATS)


def test_what_is_no_file_is_not_opened(tmp_path):
    with pytest.raises(BathymetryError, match="is not there: neither beside the profile, nor in the working folder"):
        read_chart(tmp_path / "chart.tif", WINDOW)
    (tmp_path / "chart.tif").mkdir()
    with pytest.raises(BathymetryError, match="is not a file"):
        read_chart(tmp_path / "chart.tif", WINDOW)


@pytest.mark.parametrize(("name", "library"), [("chart.tif", "rasterio"), ("chart.nc", "netCDF4")])
def test_a_missing_library_is_named_with_its_extra(tmp_path, monkeypatch, name, library):
    (tmp_path / name).write_bytes(b"")
    monkeypatch.setitem(sys.modules, library, None)
    with pytest.raises(BathymetryError, match=rf"needs {library}: pip install 'shoal\[charts\]'"):
        read_chart(tmp_path / name, WINDOW)


def test_a_library_that_cannot_be_loaded_is_reported_with_the_reason(tmp_path, monkeypatch):
    (tmp_path / "broken_charts.py").write_text("raise ImportError('libexpat.so.1: cannot open shared object file')")
    monkeypatch.syspath_prepend(str(tmp_path))
    with pytest.raises(BathymetryError, match=r"^a test needs broken_charts, which cannot be loaded: libexpat"):
        require_library("broken_charts", "a test")


@pytest.mark.parametrize(
    ("text", "suffix"),
    [
        ("emodnet.tif", ".tif"),
        ("charts/E4 2022.TIFF", ".tiff"),
        ("2026-05-01.nc", ".nc"),
        ("survey.bag", ".bag"),
        ("", ""),
        ("1 0 4.5, 4 1 4.4", ""),
        ("1 0 4.e5", ""),
        ("0 0 inf", ""),
        ("1 2 three", ""),
    ],
)
def test_the_name_of_a_file_is_not_a_row_of_soundings(text, suffix):
    assert find_chart_suffix(text) == suffix
