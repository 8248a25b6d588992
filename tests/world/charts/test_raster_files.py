"""Charts in GeoTIFF, written by tifffile with the tags of the standard, and in ESRI's ASCII grid."""

import numpy as np
import pytest
import rasterio
import tifffile
from affine import Affine

from tests.world.charts.sea_floor import (
    AREA,
    COUNT,
    LATITUDE,
    LONGITUDE,
    NO_DATA,
    POINT,
    STEP,
    TRANSFORMATION,
    WINDOW,
    assert_is_floor,
    assert_soundings_are_floor,
    floor,
    floor_of_grid,
    grid,
    universal_transverse_mercator,
    write_geotiff,
)
from world.charts import ChartWindow, read_chart
from world.sea import BathymetryError


def gdal_form(count=COUNT, dtype="float32"):
    """What GDAL needs to write the grid around the origin."""
    place = Affine(STEP, 0.0, LONGITUDE - STEP * count / 2, 0.0, -STEP, LATITUDE + STEP * count / 2)
    return {"dtype": dtype, "count": 1, "width": count, "height": count, "crs": "EPSG:4326", "transform": place}


@pytest.mark.parametrize(
    "options",
    [
        {},
        {"tile": (16, 16), "compression": "zlib"},
        {"rowsperstrip": 7, "compression": "zlib"},
        {"byteorder": ">"},
        {"bigtiff": True, "code": 4258},
    ],
    ids=["plain", "tiles", "strips", "big-endian", "BigTIFF"],
)
def test_the_soundings_of_a_geotiff_are_where_their_depths_say(tmp_path, options):
    write_geotiff(tmp_path / "chart.tif", -floor_of_grid().astype("f4"), **options)
    chart = read_chart(tmp_path / "chart.tif", WINDOW)
    assert_soundings_are_floor(chart)
    assert_is_floor(chart)
    assert chart.radius == pytest.approx(2 * STEP * 111e3, rel=0.02)


@pytest.mark.parametrize(
    "layout",
    [
        {"driver": "GTiff", "compress": "lzw", "predictor": 3},
        {"driver": "GTiff", "compress": "zstd", "tiled": True, "blockxsize": 64, "blockysize": 64},
        {"driver": "COG", "compress": "deflate", "overviews": "auto"},
    ],
    ids=["LZW", "Zstandard", "COG"],
)
def test_the_layouts_of_gdal_are_read(tmp_path, layout):
    with rasterio.open(tmp_path / "chart.tif", "w", **gdal_form(), **layout) as file:
        file.write(-floor_of_grid().astype("f4"), 1)
    assert_soundings_are_floor(read_chart(tmp_path / "chart.tif", WINDOW))


@pytest.mark.parametrize(
    ("sign", "name", "band", "tags"),
    [
        (-1, "Elevation", {}, {}),
        (1, "depth", {}, {}),
        (-1, "", {"NETCDF_VARNAME": "elevation"}, {}),
        (-1, "", {}, {"elevation#units": "m", "lat#units": "degrees_north"}),
    ],
)
def test_the_name_of_a_band_says_which_way_is_up(tmp_path, sign, name, band, tags):
    shore = floor_of_grid() - 30.0
    with rasterio.open(tmp_path / "chart.tif", "w", driver="GTiff", **gdal_form()) as file:
        file.write((sign * shore).astype("f4"), 1)
        file.descriptions = (name,)
        file.update_tags(1, **band)
        file.update_tags(**tags)
    depths = read_chart(tmp_path / "chart.tif", WINDOW).soundings[2]
    assert -7.0 < depths.min() < -3.0
    assert 23.0 < depths.max() < 27.0


def test_packed_values_are_unpacked(tmp_path):
    with rasterio.open(tmp_path / "chart.tif", "w", driver="GTiff", **gdal_form(dtype="int16")) as file:
        file.write(np.round(-(floor_of_grid() - 40.0) / 0.002).astype("i2"), 1)
        file.scales, file.offsets = (0.002,), (-40.0,)
    assert_soundings_are_floor(read_chart(tmp_path / "chart.tif", WINDOW))


def test_cells_that_are_points_are_half_a_cell_from_those_that_are_areas(tmp_path):
    found = []
    for raster in (AREA, POINT):
        write_geotiff(tmp_path / "chart.tif", -floor_of_grid().astype("f4"), raster=raster)
        found.append(read_chart(tmp_path / "chart.tif", WINDOW))
    area, point = (dict(zip(chart.soundings[2], chart.soundings.T, strict=True)) for chart in found)
    shared = sorted(set(area) & set(point))
    steps = np.array([area[depth] - point[depth] for depth in shared])
    assert len(shared) > 500
    np.testing.assert_allclose(steps[:, 0], -0.5 * STEP * 111.06e3, rtol=0.01)
    np.testing.assert_allclose(steps[:, 1], 0.5 * STEP * 83.9e3, rtol=0.01)


def test_a_matrix_of_the_georeference_may_turn_the_chart(tmp_path):
    """Rows run to the east, and columns to the north."""
    longitudes, latitudes = grid()
    west, south = longitudes[0] - STEP / 2, latitudes[-1] - STEP / 2
    matrix = (0.0, STEP, 0.0, west, STEP, 0.0, 0.0, south, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 1.0)
    turned = -floor(*np.meshgrid(longitudes, latitudes[::-1], indexing="ij")).astype("f4")
    write_geotiff(tmp_path / "chart.tif", turned, tags=[(TRANSFORMATION, "d", 16, matrix, True)])
    assert_soundings_are_floor(read_chart(tmp_path / "chart.tif", WINDOW))


@pytest.mark.parametrize(("code", "shift"), [(32629, 0.0), (25829, 0.0), (32729, 10e6)])
def test_a_geotiff_in_utm_is_where_snyder_says(tmp_path, code, shift):
    middle = universal_transverse_mercator(LONGITUDE, LATITUDE, -9.0)
    offsets = (np.arange(COUNT) + 0.5 - COUNT / 2) * 10.0
    east, north = np.meshgrid(middle[0] + offsets, middle[1] - offsets)
    longitude, latitude = np.full(east.shape, LONGITUDE), np.full(east.shape, LATITUDE)
    for _ in range(8):  # invert the projection
        x, y = universal_transverse_mercator(longitude, latitude, -9.0)
        longitude, latitude = longitude + (east - x) / 84e3, latitude + (north - y) / 111e3
    corner = middle[0] - 5.0 * COUNT, middle[1] + 5.0 * COUNT + shift
    values = floor(longitude, latitude).astype("f4")
    write_geotiff(tmp_path / "chart.tif", values, code=code, corner=corner, step=(10.0, 10.0))
    chart = read_chart(tmp_path / "chart.tif", WINDOW, None, "down")
    assert_soundings_are_floor(chart)
    assert chart.radius == pytest.approx(20.0, rel=0.01)


def test_cells_without_data_are_no_soundings(tmp_path):
    depths = floor_of_grid()
    for values, tags in (
        (np.where(depths > 40.0, -9999.0, -depths).astype("f4"), [(NO_DATA, "s", 0, "-9999", True)]),
        (np.where(depths > 40.0, -32768, -np.round(depths)).astype("i2"), [(NO_DATA, "s", 0, "-32768", True)]),
        (np.where(depths > 40.0, np.nan, -depths), []),
    ):
        write_geotiff(tmp_path / "chart.tif", values, tags=tags)
        chart = read_chart(tmp_path / "chart.tif", WINDOW)
        assert 30.0 < chart.soundings[2].max() <= 40.0
        assert chart.soundings.shape[1] < 0.6 * values.size


def test_a_value_for_no_data_that_is_not_declared_is_no_depth(tmp_path):
    depths = floor_of_grid()
    for fill in (-9999.0, -32768.0, 1e20):
        write_geotiff(tmp_path / "chart.tif", np.where(depths > 40.0, fill, -depths).astype("f4"))
        with pytest.raises(BathymetryError, match=r"has \d+ values such as .*, which are no depths: declare it"):
            read_chart(tmp_path / "chart.tif", WINDOW)


def test_only_the_window_of_a_large_chart_is_read(tmp_path):
    """The 1.6 billion cells of this file would need 6.4 GB; only the tiles around the origin are on the disk."""
    count, size, path = 40000, 256, tmp_path / "large.tif"
    layout = {"tiled": True, "blockxsize": size, "blockysize": size, "SPARSE_OK": True, "nodata": -99999.0}
    with rasterio.open(path, "w", driver="GTiff", **gdal_form(count), **layout) as file:
        start = (count - COUNT) // 2
        file.write(-floor_of_grid().astype("f4"), 1, window=((start, start + COUNT), (start, start + COUNT)))
    assert path.stat().st_size < 2e6
    assert_soundings_are_floor(read_chart(path, WINDOW))
    with pytest.raises(
        BathymetryError, match=r"has 1.6e\+09 depths within 1e\+06 m of .*: set Chart Radius to 30000 or"
    ):
        read_chart(path, WINDOW._replace(radius=1e6))


def _cut(path, share):
    path.write_bytes(path.read_bytes()[: int(path.stat().st_size * share)])


def test_a_truncated_geotiff_is_an_error(tmp_path):
    path = tmp_path / "chart.tif"
    for share in (0.0, 0.0001, 0.02, 0.3, 0.5):
        write_geotiff(path, -floor_of_grid().astype("f4"), rowsperstrip=COUNT)
        _cut(path, share)
        with pytest.raises(BathymetryError, match=r"cannot be read: |has no georeference|has no depth within"):
            read_chart(path, WINDOW)


@pytest.mark.parametrize("options", [{}, {"tile": (16, 16)}, {"rowsperstrip": 1}], ids=["strip", "tiles", "rows"])
def test_a_geotiff_that_claims_to_be_huge_needs_no_memory(tmp_path, options):
    path = tmp_path / "bomb.tif"
    write_geotiff(path, -floor_of_grid().astype("f4"), compression="zlib", **options)
    with tifffile.TiffFile(path, mode="r+b") as file:
        for name in ("ImageWidth", "ImageLength"):
            file.pages[0].tags[name].overwrite(2**30, dtype="I")
    with pytest.raises(BathymetryError, match=r"cannot be read: |is stored in blocks of 1(20)? x 1073741824 cells"):
        read_chart(path, WINDOW)


def test_a_picture_is_no_chart(tmp_path):
    path = tmp_path / "picture.tif"
    for values, words in (
        (np.zeros((50, 50, 3), "u1"), "has 3 bands; a chart has one"),
        (np.zeros((50, 50), "c8"), "has values of the type complex64, which are no depths"),
    ):
        write_geotiff(path, values, photometric="rgb" if values.ndim == 3 else "minisblack")
        with pytest.raises(BathymetryError, match=words):
            read_chart(path, WINDOW)
    tifffile.imwrite(path, np.zeros((50, 50), "f4"))
    with pytest.raises(BathymetryError, match="has no georeference: the place of its cells is unknown"):
        read_chart(path, WINDOW)
    path.write_text("no chart")
    with pytest.raises(BathymetryError, match=r"cannot be read: 'picture\.tif' not recognized"):
        read_chart(path, WINDOW)


def test_a_chart_of_another_place_is_an_error_that_says_where_it_is(tmp_path):
    write_geotiff(tmp_path / "azores.tif", np.full((60, 60), -30.0, "f4"), corner=(-28.7, 38.6))
    with pytest.raises(
        BathymetryError, match=r"of the origin 41.185, -8.7062: it covers -28.7 to .*; set \[World\] Origin"
    ):
        read_chart(tmp_path / "azores.tif", WINDOW)


def test_a_chart_from_0_to_360_degrees_and_one_across_180_degrees(tmp_path):
    write_geotiff(tmp_path / "chart.tif", -floor_of_grid(), corner=(360 + LONGITUDE - STEP * 60, LATITUDE + STEP * 60))
    assert_soundings_are_floor(read_chart(tmp_path / "chart.tif", WINDOW))
    write_geotiff(tmp_path / "fiji.tif", np.full((40, 3600), -7.0, "f4"), corner=(-180.0, -17.0), step=(0.1, 0.1))
    chart = read_chart(tmp_path / "fiji.tif", ChartWindow(np.radians(-17.5), np.radians(179.99), 20e3))
    assert chart.soundings[1].min() < -15e3
    assert chart.soundings[1].max() > 15e3


def test_an_esri_grid_has_degrees_or_the_coordinates_of_the_option(tmp_path):
    path = tmp_path / "chart.asc"
    rows = "\n".join(" ".join(f"{-value:.3f}" for value in row) for row in floor_of_grid())
    corner = f"xllcorner {LONGITUDE - STEP * 60:.9f}\nyllcorner {LATITUDE - STEP * 60:.9f}"
    head = f"nrows {COUNT}\n{corner}\ncellsize {STEP:.12f}"
    path.write_text(f"ncols {COUNT}\n{head}\nNODATA_value -9999\n{rows}\n")
    assert_soundings_are_floor(read_chart(path, WINDOW), tolerance=5e-3)
    path.write_text(f"ncols {COUNT}\n{head}\n{rows[: len(rows) // 2]}")
    with pytest.raises(BathymetryError, match=r"cannot be read: chart\.asc, band 1: File short"):
        read_chart(path, WINDOW)
    path.write_text("ncols 2\nnrows 2\nxllcorner 500000\nyllcorner 4500000\ncellsize 10\n1 2\n3 4\n")
    with pytest.raises(BathymetryError, match="does not name its coordinates: set Chart Coordinates, such as EPSG"):
        read_chart(path, WINDOW)
