"""Soundings in text: orders, names and separators of columns, coordinates, and lines that are wrong."""

import math

import numpy as np
import pytest

from tests.world.charts.sea_floor import (
    LATITUDE,
    LONGITUDE,
    WINDOW,
    assert_is_floor,
    assert_soundings_are_floor,
    floor,
    universal_transverse_mercator,
)
from world.charts import parse_coordinates, read_chart
from world.sea import BathymetryError

RANDOM = np.random.default_rng(5)
PLACES = [(LONGITUDE + x, LATITUDE + y) for x, y in RANDOM.uniform(-0.008, 0.008, (4000, 2)).tolist()]
ROWS = [(f"{x:.7f}", f"{y:.7f}", f"{floor(x, y):.3f}") for x, y in PLACES]


def write(path, rows, separator=" ", head=""):
    path.write_text(head + "".join(separator.join(row) + "\n" for row in rows))
    return path


def orders(rows):
    return [(y, "7", z, x) for x, y, z in rows]


@pytest.mark.parametrize(
    ("name", "rows", "separator", "head"),
    [
        ("chart.xyz", ROWS, " ", ""),
        ("chart.txt", ROWS, "\t", "# surveyed in May\n\n"),
        ("chart.csv", ROWS, ",", "lon,lat,depth\n"),
        ("chart.csv", orders(ROWS), "; ", "\ufeffLatitude (deg); id; Depth [m]; Longitude (deg)\n"),
        ("chart.asc", [(x, y, "-" + z) for x, y, z in ROWS], "  ", "longitude  latitude  elevation\n"),
    ],
)
def test_soundings_are_where_their_depths_say(tmp_path, name, rows, separator, head):
    chart = read_chart(write(tmp_path / name, rows, separator, head), WINDOW)
    assert_soundings_are_floor(chart)
    assert_is_floor(chart, tolerance=1.0)


def test_eastings_and_northings_need_the_coordinates_of_the_option(tmp_path):
    rows = [
        (*(f"{value:.4f}" for value in universal_transverse_mercator(x, y, -9.0)), f"{floor(x, y):.3f}")
        for x, y in PLACES
    ]
    for head in ("easting northing depth\n", "x y z\n", ""):
        path = write(tmp_path / "chart.xyz", rows, head=head)
        assert_soundings_are_floor(read_chart(path, WINDOW, parse_coordinates("EPSG:32629")))
        with pytest.raises(BathymetryError, match=r"set Chart Coordinates.*, such as EPSG:32629"):
            read_chart(path, WINDOW)
    with pytest.raises(BathymetryError, match="banana is no known system of coordinates, such as EPSG:32629"):
        parse_coordinates("banana")
    path = write(tmp_path / "chart.csv", ROWS, ",", "lon,lat,depth\n")
    with pytest.raises(BathymetryError, match="has longitude and latitude, not the Chart Coordinates EPSG:32629"):
        read_chart(path, WINDOW, parse_coordinates("EPSG:32629"))


@pytest.mark.parametrize(
    ("line", "words"),
    [
        ("-8.7 41.18", "has 2 columns instead of 3"),
        ("-8.7 41.18 4 5", r"has 4 columns instead of 3 \(a first line may name the columns\)"),
        ("-8.7 41.18 deep", "'-8.7 41.18 deep' is not two coordinates and a depth"),
        ("-8.7 nan 4", "'-8.7 nan 4' is not two coordinates and a depth"),
        ("-8.7 91 4", "-8.7, 91 is not a longitude and a latitude in degrees"),
        ("524644 4559000 4", "524644, 4559000 is not a longitude and a latitude in degrees; set Chart Coordinates"),
        ("9" * 5000, "has 1 columns instead of 3"),
    ],
)
def test_a_bad_line_is_named(tmp_path, line, words):
    path = write(tmp_path / "chart.xyz", [*ROWS[:40], [line], *ROWS])
    with pytest.raises(BathymetryError, match=rf"^chart\.xyz:41: {words}"):
        read_chart(path, WINDOW)


def test_a_sounding_without_depth_is_none(tmp_path):
    path = write(tmp_path / "chart.xyz", [*ROWS, (*ROWS[0][:2], "nan")])
    assert np.isfinite(read_chart(path, WINDOW).soundings).all()


def test_latitude_before_longitude_is_reported(tmp_path):
    path = write(tmp_path / "chart.xyz", [(y, x, z) for x, y, z in ROWS])
    with pytest.raises(BathymetryError, match="has latitude before longitude: name its columns in a first line"):
        read_chart(path, WINDOW)


@pytest.mark.parametrize(
    ("text", "words"),
    [
        ("", "has no sounding"),
        ("# nothing\n", "has no sounding"),
        ("lon lat depth\n", "has no sounding after the names of its columns"),
        (
            "time,temperature,salinity\n1,2,3\n",
            "chart.xyz:1: the names of the columns are 'time, temperature, salinity'",
        ),
        ("lon,lat,lon,depth\n1,2,3,4\n", "chart.xyz:1: the names of the columns"),
        ("1 2 3\n", r"has no depth within 500 m of the origin 41.185, -8.7062: it covers 1 to 1 \(x\), 2 to 2 \(y\)"),
    ],
)
def test_a_file_without_soundings_says_what_it_has(tmp_path, text, words):
    (tmp_path / "chart.xyz").write_text(text)
    with pytest.raises(BathymetryError, match=words):
        read_chart(tmp_path / "chart.xyz", WINDOW)


def test_names_and_comments_of_a_windows_program_do_no_harm(tmp_path):
    path = write(tmp_path / "chart.csv", ROWS, ";", "# Levantamento: Ângulo\nLongitude (°);Latitude (°);Depth (m)\n")
    path.write_bytes(path.read_text().replace("\n", "\r\n").encode("cp1252"))
    assert_soundings_are_floor(read_chart(path, WINDOW))
    path.write_text("lon;lat;depth\n-8,7062;41,185;5,1\n")
    with pytest.raises(BathymetryError, match=r"chart.csv:2: '.*' is not two coordinates and a depth \(decimals need"):
        read_chart(path, WINDOW)


def test_a_file_that_is_not_text_is_refused(tmp_path):
    (tmp_path / "chart.xyz").write_bytes(bytes(range(256)) * 20)
    with pytest.raises(BathymetryError, match=r"^chart\.xyz:\d: "):
        read_chart(tmp_path / "chart.xyz", WINDOW)


def test_the_radius_of_scattered_soundings_is_twice_their_distance_and_the_option_counts_within_limits(tmp_path):
    chart = read_chart(write(tmp_path / "chart.xyz", ROWS), WINDOW)
    distance = math.sqrt(1000.0**2 / chart.soundings.shape[1])
    assert chart.radius == pytest.approx(2.0 * distance, rel=0.05)
    assert chart.sounding_radius(None) == chart.radius == chart.sounding_radius(0.1)
    assert chart.sounding_radius(3.0 * chart.radius) == 3.0 * chart.radius
    assert chart.sounding_radius(100.0 * chart.radius) == 4.0 * chart.radius
