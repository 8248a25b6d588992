"""Map tiles of MBTiles and PMTiles files, and files that are none."""

import json
import os
import socket
import sqlite3

import pytest
from pmtiles.tile import Compression, TileType, zxy_to_tileid
from pmtiles.writer import Writer

from shoal.console.charts.tiles import TileSets
from tests.shoal.console.page_of_nobody import served_page

PNG = b"\x89PNG\r\n\x1a\n" + b"picture"


def write_mbtiles(path, tile=PNG):
    with sqlite3.connect(path) as database:
        database.execute("CREATE TABLE tiles (zoom_level INT, tile_column INT, tile_row INT, tile_data BLOB)")
        database.execute("INSERT INTO tiles VALUES (3, 2, 6, ?)", (tile,))  # row 1 from the north
    database.close()


def write_pmtiles(path):
    with path.open("wb") as file:
        writer = Writer(file)
        writer.write_tile(zxy_to_tileid(3, 2, 1), PNG)
        header = {
            "tile_type": TileType.PNG,
            "tile_compression": Compression.NONE,
            "min_zoom": 3,
            "max_zoom": 3,
            "min_lon_e7": -10,
            "min_lat_e7": -10,
            "max_lon_e7": 10,
            "max_lat_e7": 10,
            "center_zoom": 3,
            "center_lon_e7": 0,
            "center_lat_e7": 0,
        }
        writer.finalize(header, {})


def test_tiles_are_those_of_the_files(tmp_path):
    write_mbtiles(tmp_path / "chart.mbtiles")
    write_pmtiles(tmp_path / "photo.pmtiles")
    (tmp_path / "notes.txt").write_text("no tiles")
    sets = TileSets(tmp_path)
    assert (sets.zooms, sets.troubles) == ({"chart": (3, 3), "photo": (3, 3)}, [])
    for name in sets.zooms:
        assert sets.tile(name, 3, 2, 1) == (PNG, "image/png")
        assert sets.tile(name, 3, 2, 2) is None


@pytest.mark.parametrize("place", [(-1, 0, 0), (3, 8, 0), (3, 0, -1), (25, 0, 0), (3, 1 << 70, 0)])
def test_a_place_that_no_map_has_is_no_tile(tmp_path, place):
    write_mbtiles(tmp_path / "chart.mbtiles")
    assert TileSets(tmp_path).tile("chart", *place) is None


def test_files_that_cannot_be_read_are_named_and_the_others_served(tmp_path):
    (tmp_path / "bad.mbtiles").write_bytes(b"no database" * 100)
    (tmp_path / "bad.pmtiles").write_bytes(b"x")
    (tmp_path / "empty.pmtiles").touch()
    write_mbtiles(tmp_path / "chart.mbtiles")
    sets = TileSets(tmp_path)
    assert sets.zooms == {"chart": (3, 3)}
    assert [text.partition(": ")[0].rpartition("/")[2] for text in sets.troubles] == [
        "bad.mbtiles",
        "bad.pmtiles",
        "empty.pmtiles",
    ]
    assert sets.troubles[1].endswith("bad.pmtiles: is no .pmtiles file with tiles, or is damaged")


def test_a_damaged_file_is_named_when_it_is_read(tmp_path):
    write_pmtiles(tmp_path / "photo.pmtiles")
    data = bytearray((tmp_path / "photo.pmtiles").read_bytes())
    data[127:140] = b"\xff" * 13  # the directory
    (tmp_path / "photo.pmtiles").write_bytes(data)
    sets = TileSets(tmp_path)
    assert sets.tile("photo", 3, 2, 1) is None
    assert sets.tile("photo", 3, 2, 1) is None
    assert sets.troubles == ["photo: 2 times no tile could be read: the file is damaged"]


@pytest.mark.parametrize("damage", ["truncated", "overwritten", "strange"])
def test_a_damaged_database_serves_no_tile_and_the_others_are_served(tmp_path, damage):
    write_mbtiles(tmp_path / "bad.mbtiles")
    write_mbtiles(tmp_path / "chart.mbtiles")
    data = bytearray((tmp_path / "bad.mbtiles").read_bytes())
    if damage == "truncated":
        del data[len(data) // 2 :]
    elif damage == "overwritten":
        data[len(data) // 2 :] = b"\xa5" * (len(data) - len(data) // 2)
    else:
        with sqlite3.connect(tmp_path / "other.mbtiles") as database:
            database.execute("CREATE TABLE tiles (zoom_level TEXT, tile_column TEXT, tile_row TEXT, tile_data TEXT)")
            database.execute("INSERT INTO tiles VALUES ('x', '<b>', 'y', 'z')")
        database.close()
        data = (tmp_path / "other.mbtiles").read_bytes()
        (tmp_path / "other.mbtiles").unlink()
    (tmp_path / "bad.mbtiles").write_bytes(data)
    sets = TileSets(tmp_path)
    assert sets.tile("bad", 3, 2, 1) is None
    assert sets.tile("chart", 3, 2, 1) == (PNG, "image/png")
    assert any("bad" in text for text in sets.troubles)


def test_without_its_folder_the_page_has_no_tiles_and_a_notice(tmp_path):
    sets = TileSets(tmp_path / "card")
    assert sets.troubles == [f"no map tiles: {tmp_path / 'card'}: No such file or directory"]
    assert sets.tile("chart", 3, 2, 1) is None


def test_a_tile_that_is_no_picture_is_not_served(tmp_path):
    write_mbtiles(tmp_path / "chart.mbtiles", tile=b"<script>alert(1)</script>")
    assert TileSets(tmp_path).tile("chart", 3, 2, 1) is None


def test_pipes_and_sockets_with_names_of_charts_are_not_opened_but_named_on_the_page(tmp_path):
    write_mbtiles(tmp_path / "chart.mbtiles")
    names = [f"{number}.{suffix}" for number in range(4) for suffix in ("geojson", "mbtiles", "pmtiles")]
    for name in names[:-1]:
        os.mkfifo(tmp_path / name)
    with socket.socket(socket.AF_UNIX) as listener:
        listener.bind(str(tmp_path / names[-1]))
        with served_page(tiles=TileSets(tmp_path)) as page:
            page.log_in()
            found = json.loads(page.request("GET", "/api/overlays")[1])
            sets = json.loads(page.request("GET", "/api/tiles")[1])["sets"]
    assert (found["sizes"], list(sets)) == ({}, ["chart"])
    *named, more = found["troubles"]
    assert more == f"{len(names) - len(named)} more files cannot be drawn"
    assert named[0] == f"{tmp_path}/0.mbtiles: not a regular file"
    assert all(each.endswith(": not a regular file") for each in named)
