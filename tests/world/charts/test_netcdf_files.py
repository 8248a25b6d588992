"""Charts in NetCDF, in the layouts of GEBCO and EMODnet and in others that CF allows."""

import netCDF4
import numpy as np
import pytest
from rasterio.crs import CRS

from tests.world.charts.sea_floor import (
    COUNT,
    LATITUDE,
    LONGITUDE,
    WINDOW,
    assert_is_floor,
    assert_soundings_are_floor,
    floor,
    floor_of_grid,
    grid,
    universal_transverse_mercator,
    write_netcdf,
)
from world.charts import parse_coordinates, read_chart
from world.sea import BathymetryError

LAYOUTS = ("NETCDF4", "NETCDF4_CLASSIC", "NETCDF3_CLASSIC", "NETCDF3_64BIT_OFFSET", "NETCDF3_64BIT_DATA")


@pytest.mark.parametrize("layout", LAYOUTS)
def test_the_soundings_of_a_netcdf_file_are_where_their_depths_say(tmp_path, layout):
    write_netcdf(tmp_path / "chart.nc", -floor_of_grid(), layout=layout, units="m")
    chart = read_chart(tmp_path / "chart.nc", WINDOW)
    assert_soundings_are_floor(chart)
    assert_is_floor(chart)


def test_packed_numbers_are_unpacked_and_fill_values_are_no_soundings(tmp_path):
    depths = np.ma.masked_greater(floor_of_grid(), 40.0)
    packed = {"kind": "i2", "_FillValue": -32767, "scale_factor": 0.001, "add_offset": -40.0}
    write_netcdf(tmp_path / "chart.nc", -depths, **packed, units="meters")
    chart = read_chart(tmp_path / "chart.nc", WINDOW)
    assert_soundings_are_floor(chart, tolerance=4e-3)
    assert 39.0 < chart.soundings[2].max() <= 40.001


@pytest.mark.parametrize(
    ("name", "sign", "attributes"),
    [
        ("elevation", -1, {}),
        ("depth", 1, {}),
        ("z", 1, {"positive": "down"}),
        ("z", -1, {"positive": "up"}),
        ("Band1", 1, {"standard_name": "sea_floor_depth_below_mean_sea_level"}),
        ("Band1", -1, {"standard_name": "height_above_mean_sea_level"}),
    ],
)
def test_names_and_attributes_say_which_way_is_up(tmp_path, name, sign, attributes):
    shore = floor_of_grid() - 40.0
    write_netcdf(tmp_path / "chart.nc", sign * shore, name=name, **attributes)
    depths = read_chart(tmp_path / "chart.nc", WINDOW).soundings[2]
    assert -17.0 < depths.min() < -10.0 < 10.0 < depths.max() < 17.0


def test_a_grid_by_longitude_first_with_a_time_and_0_to_360_degrees(tmp_path):
    longitudes, latitudes = grid()
    with netCDF4.Dataset(tmp_path / "chart.nc", "w") as file:
        for name, numbers in (("time", [0.0]), ("longitude", longitudes + 360.0), ("latitude", latitudes[::-1])):
            file.createDimension(name, len(numbers))
            file.createVariable(name, "f8", (name,))[:] = numbers
        file.createVariable("depth", "f4", ("time", "longitude", "latitude"))[:] = floor_of_grid()[::-1].T[np.newaxis]
        file.createVariable("tid", "i1", ("latitude", "longitude"))[:] = 0
    assert_soundings_are_floor(read_chart(tmp_path / "chart.nc", WINDOW))


def test_a_projected_grid_has_the_coordinates_of_its_grid_mapping_or_of_the_option(tmp_path):
    middle = universal_transverse_mercator(LONGITUDE, LATITUDE, -9.0)
    offsets = (np.arange(COUNT) + 0.5 - COUNT / 2) * 10.0
    east, north = middle[0] + offsets, middle[1] + offsets
    longitude, latitude = (np.full((COUNT, COUNT), value) for value in (LONGITUDE, LATITUDE))
    for _ in range(8):
        x, y = universal_transverse_mercator(longitude, latitude, -9.0)
        longitude, latitude = longitude + (east - x) / 84e3, latitude + (north[:, np.newaxis] - y) / 111e3
    path, form = tmp_path / "chart.nc", {"axes": ("x", "y"), "places": (east, north)}
    write_netcdf(path, floor(longitude, latitude), name="depth", **form)
    with pytest.raises(BathymetryError, match="does not name its coordinates: set Chart Coordinates"):
        read_chart(path, WINDOW)
    assert_soundings_are_floor(read_chart(path, WINDOW, parse_coordinates("EPSG:32629")))
    for attribute, text in (
        ("crs_wkt", CRS.from_epsg(32629).to_wkt()),
        ("epsg_code", "32629"),
        ("epsg_code", "EPSG:25829"),
    ):
        write_netcdf(path, floor(longitude, latitude), name="depth", grid_mapping="crs", **form)
        with netCDF4.Dataset(path, "a") as file:
            file.createVariable("crs", "i4", ()).setncattr(attribute, text)
        assert_soundings_are_floor(read_chart(path, WINDOW))


def test_a_file_without_one_grid_of_depths_lists_its_variables(tmp_path):
    path = tmp_path / "chart.nc"
    with netCDF4.Dataset(path, "w") as file:
        file.createDimension("time", 4)
        file.createVariable("salinity", "f4", ("time",))
    with pytest.raises(
        BathymetryError, match=r"has no grid of depths by latitude and longitude; .*variables: salinity"
    ):
        read_chart(path, WINDOW)
    write_netcdf(path, -floor_of_grid(), name="mean")
    assert_soundings_are_floor(read_chart(path, WINDOW))
    with netCDF4.Dataset(path, "a") as file:
        file.createVariable("maximum", "f4", ("lat", "lon"))[:] = 0.0
    with pytest.raises(BathymetryError, match=r"has several grids; one must be named .*variables: maximum, mean\)"):
        read_chart(path, WINDOW)
    with netCDF4.Dataset(path, "a") as file:
        file.createVariable("depth_maximum", "f4", ("lat", "lon"))[:] = 0.0
        file.createVariable("depth_average", "f4", ("lat", "lon"))[:] = floor_of_grid()
    assert_soundings_are_floor(read_chart(path, WINDOW))


@pytest.mark.parametrize("layout", LAYOUTS)
def test_a_truncated_file_is_an_error_and_no_shoal(tmp_path, layout):
    path = tmp_path / "chart.nc"
    for share in (0.0, 0.05, 0.5, 0.9):
        write_netcdf(path, -floor_of_grid(), layout=layout)
        path.write_bytes(path.read_bytes()[: int(path.stat().st_size * share)])
        with pytest.raises(
            BathymetryError, match=r"cannot be read: |is truncated: |that neither increase nor decrease"
        ):
            read_chart(path, WINDOW)


def test_numbers_that_are_no_depths_in_meters_are_refused(tmp_path):
    path = tmp_path / "chart.nc"
    write_netcdf(path, -floor_of_grid(), units="fathoms")
    with pytest.raises(BathymetryError, match="has elevation in 'fathoms'; it must be in m"):
        read_chart(path, WINDOW)
    columns, rows = grid()
    write_netcdf(path, -floor_of_grid(), places=(columns, np.roll(rows, 3)))
    with pytest.raises(BathymetryError, match="has coordinates lat that neither increase nor decrease"):
        read_chart(path, WINDOW)
    with netCDF4.Dataset(path, "w") as file:
        for name, count in (("lon", 2**33), ("lat", COUNT)):
            file.createDimension(name, count)
            file.createVariable(name, "f8", (name,), chunksizes=(COUNT,))
        file.createVariable("elevation", "f4", ("lat", "lon"), chunksizes=(COUNT, COUNT))
    with pytest.raises(BathymetryError, match="has 8589934592 coordinates lon, more than"):
        read_chart(path, WINDOW)
