"""A floor of the sea whose depth is known at each place, and files of it that Shoal did not write."""

import math

import netCDF4
import numpy as np
import tifffile

from support.wgs84 import displace, offset
from world.charts import ChartWindow
from world.sea import Bathymetry

LATITUDE, LONGITUDE = 41.185, -8.7062  # degrees
ORIGIN = math.radians(LATITUDE), math.radians(LONGITUDE)
WINDOW = ChartWindow(*ORIGIN, 500.0)
STEP = 1.0 / 3600.0  # degrees, 31 m north and 23 m east
COUNT = 120  # rows and columns
PIXEL_SCALE, TIEPOINT, TRANSFORMATION, KEYS, NO_DATA = 33550, 33922, 34264, 34735, 42113
MODEL, RASTER, GEOGRAPHIC, PROJECTED = 1024, 1025, 2048, 3072
AREA, POINT = 1, 2


def floor(longitude, latitude):
    """Depth (m) at a place (degrees): a slope of 1 % to the north and 2 % to the west."""
    north, east = (latitude - LATITUDE) * 111e3, (longitude - LONGITUDE) * 84e3
    return 40.0 + 0.01 * north - 0.02 * east


def grid(step=STEP, count=COUNT):
    """Longitudes (columns) and latitudes (rows, from north to south) of cells, the middle of which is the origin."""
    offsets = (np.arange(count) + 0.5 - count / 2) * step
    return LONGITUDE + offsets, LATITUDE - offsets


def floor_of_grid(step=STEP, count=COUNT):
    return floor(*np.meshgrid(*grid(step, count)))


def write_geotiff(path, values, *, code=4326, raster=AREA, corner=None, step=(STEP, STEP), tags=(), **options):
    """A GeoTIFF by tifffile, whose tags are those of the standard (OGC 19-008r4)."""
    if corner is None:
        corner = LONGITUDE - step[0] * values.shape[1] / 2, LATITUDE + step[1] * values.shape[0] / 2
    kind = (GEOGRAPHIC, 2) if code in (4326, 4258) else (PROJECTED, 1)
    keys = (1, 1, 0, 3, MODEL, 0, 1, kind[1], RASTER, 0, 1, raster, kind[0], 0, 1, code)
    place = [(PIXEL_SCALE, "d", 3, (*step, 0.0), True), (TIEPOINT, "d", 6, (0.0, 0.0, 0.0, *corner, 0.0), True)]
    own = [] if any(tag[0] == TRANSFORMATION for tag in tags) else place
    tifffile.imwrite(path, values, extratags=[*own, (KEYS, "H", len(keys), keys, True), *tags], **options)


def write_netcdf(
    path, values, *, name="elevation", axes=("lon", "lat"), places=None, kind="f4", layout="NETCDF4", **attributes
):
    """A NetCDF file by netCDF4; `places` are the coordinates of columns and rows."""
    columns, rows = grid(count=values.shape[0]) if places is None else places
    fill = attributes.pop("_FillValue", None)
    with netCDF4.Dataset(path, "w", format=layout) as file:
        for axis, numbers in zip(axes, (columns, rows), strict=True):
            file.createDimension(axis, len(numbers))
            file.createVariable(axis, "f8", (axis,))[:] = numbers
        grid_variable = file.createVariable(name, kind, axes[::-1], fill_value=fill)
        grid_variable.setncatts(attributes)
        grid_variable[:] = values


def assert_is_floor(chart, tolerance=0.3):
    """The bottom of a chart is the floor at places up to 450 m from the origin."""
    sea = Bathymetry(chart.soundings.T, chart.radius, 120.0, ORIGIN)
    for north in range(-450, 451, 75):
        for east in range(-450, 451, 75):
            lat, lon, _ = displace(*ORIGIN, 0.0, north, east)
            expected = floor(math.degrees(lon), math.degrees(lat))
            assert abs(sea.depth(north, east) - expected) < tolerance, (north, east)


def assert_soundings_are_floor(chart, tolerance=2e-3):
    """Each sounding of a chart is where its depth says."""
    assert chart.soundings.shape[1] > 500
    for north, east, depth in chart.soundings.T[::17].tolist():
        lat, lon, _ = displace(*ORIGIN, 0.0, north, east)
        back = offset(*ORIGIN, lat, lon)
        assert math.dist(back, (north, east)) < 0.01
        assert abs(depth - floor(math.degrees(lon), math.degrees(lat))) < tolerance


def universal_transverse_mercator(longitude, latitude, central):
    """Easting and northing (m) of places (degrees) near a central meridian, by series.

    Source: Snyder 1987, USGS Professional Paper 1395, equations 8-9, 8-10 and 3-21.
    """
    a, e2 = 6378137.0, 0.0066943799901413165
    phi, lam = np.radians(latitude), np.radians(longitude - central)
    second = e2 / (1.0 - e2)
    normal = a / np.sqrt(1.0 - e2 * np.sin(phi) ** 2)
    t, c, big = np.tan(phi) ** 2, second * np.cos(phi) ** 2, lam * np.cos(phi)
    arc = a * (
        (1 - e2 / 4 - 3 * e2**2 / 64 - 5 * e2**3 / 256) * phi
        - (3 * e2 / 8 + 3 * e2**2 / 32 + 45 * e2**3 / 1024) * np.sin(2 * phi)
        + (15 * e2**2 / 256 + 45 * e2**3 / 1024) * np.sin(4 * phi)
        - (35 * e2**3 / 3072) * np.sin(6 * phi)
    )
    east = big + (1 - t + c) * big**3 / 6 + (5 - 18 * t + t**2 + 72 * c - 58 * second) * big**5 / 120
    north = big**2 / 2 + (5 - t + 9 * c + 4 * c**2) * big**4 / 24
    return 500000.0 + 0.9996 * normal * east, 0.9996 * (arc + normal * np.tan(phi) * north)
