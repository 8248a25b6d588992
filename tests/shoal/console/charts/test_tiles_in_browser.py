"""Map tiles in a real browser: they are drawn, and files that are damaged are named on the page."""

import io
import math
import sqlite3

import pytest
from PIL import Image

from tests.outside import until
from tests.shoal.console.browser import opened_vehicle_page
from tests.shoal.console.charts.test_tiles import write_pmtiles

HOSTILE = "<img src=x onerror=window.hacked=1>"
PATIENCE = 60.0  # s, on a busy computer
ZOOM, LATITUDE, LONGITUDE = 16, 41.185, -8.706
pytestmark = pytest.mark.browser


def write_charts(folder) -> None:
    """Tiles around the vehicle, a file that is none, and one whose directory is damaged."""
    picture = io.BytesIO()
    Image.new("RGB", (256, 256), (120, 160, 200)).save(picture, "PNG")
    size = 1 << ZOOM
    column = int((LONGITUDE + 180.0) / 360.0 * size)
    row = int((1.0 - math.asinh(math.tan(math.radians(LATITUDE))) / math.pi) / 2.0 * size)
    with sqlite3.connect(folder / f"{HOSTILE}.mbtiles") as database:
        database.execute("CREATE TABLE tiles (zoom_level INT, tile_column INT, tile_row INT, tile_data BLOB)")
        database.execute("INSERT INTO tiles VALUES (?, ?, ?, ?)", (ZOOM, column, size - 1 - row, picture.getvalue()))
    database.close()
    (folder / "none.mbtiles").write_bytes(b"no database" * 100)
    write_pmtiles(folder / "0-damaged.pmtiles")  # the first by name, which the map shows
    data = bytearray((folder / "0-damaged.pmtiles").read_bytes())
    data[127:140] = b"\xff" * 13
    (folder / "0-damaged.pmtiles").write_bytes(data)


@pytest.fixture(scope="module")
def page(tmp_path_factory):
    folder = tmp_path_factory.mktemp("vehicle")
    (folder / "charts").mkdir()
    write_charts(folder / "charts")
    with opened_vehicle_page(folder, 1280, 800, "--set", "Transports.Console:Map Tiles=charts") as found:
        yield found


def test_damaged_files_are_named_on_the_page_with_their_count(page):
    until(lambda: "none.mbtiles: file is not a database" in page.text("#tile-troubles"), PATIENCE)
    until(
        lambda: "0-damaged: " in page.text("#tile-troubles") and "the file is damaged" in page.text("#tile-troubles"),
        PATIENCE,
        told=lambda: page.text("#tile-troubles"),
    )
    assert page.run("document.querySelectorAll('img.leaflet-tile-loaded').length") == 0


def test_tiles_of_the_other_file_are_drawn_and_its_name_is_text(page):
    until(lambda: "onerror" in page.text(".leaflet-control-layers"))
    page.press(".leaflet-control-layers-overlays label:nth-of-type(2) input")
    until(lambda: page.run("document.querySelectorAll('img.leaflet-tile-loaded').length") > 0)
    assert page.run("window.hacked") is None
    assert page.run("document.querySelectorAll('img[src=x]').length") == 0
    script = (
        "import('/files/map_layer.js').then(({ map }) => Object.values(map._layers)"
        ".filter((each) => each.getTooltip?.()?.getContent().textContent.match(/^[0-9.]+ m$/)).length)"
    )
    assert page.run(script) == 0, "contours of the bathymetry"


def test_it_has_no_errors_but_those_of_missing_tiles(page):
    assert [each for each in page.errors if "404" not in each] == []
