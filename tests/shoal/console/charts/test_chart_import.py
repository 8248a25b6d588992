"""Charts of other programs become overlays of the map; `small.000` is written by GDAL 3.12."""

import asyncio
import errno
import json
import os
from pathlib import Path

import pytest
from click.testing import CliRunner

from shoal.cli import main
from shoal.console import TileSets
from shoal.console.charts.chart_overlays import MOST_FILES
from shoal.console.charts.overlay_files import OverlayFiles
from tests.shoal.console.operator_page import vehicle_page

SMALL = Path(__file__).parent / "small.000"
KML = """<?xml version="1.0"?><kml xmlns="http://www.opengis.net/kml/2.2"><Document>
<Placemark><name>&lt;b&gt;Buoy</name><Point><coordinates>-8.70,41.18,0</coordinates></Point></Placemark>
<Placemark><name>Zone</name><Polygon><outerBoundaryIs><LinearRing><coordinates>
-8.7,41.1 -8.6,41.1 -8.6,41.2 -8.7,41.1</coordinates></LinearRing></outerBoundaryIs></Polygon></Placemark>
</Document></kml>"""
GPX = """<?xml version="1.0"?><gpx version="1.1" creator="x" xmlns="http://www.topografix.com/GPX/1/1">
<wpt lat="41.18" lon="-8.7"><name>Mooring</name></wpt></gpx>"""
CONTOUR = {"type": "LineString", "coordinates": [[-8.7, 41.18], [-8.71, 41.19]]}


def overlays_of(folder: Path) -> OverlayFiles:
    found = TileSets(folder).overlays
    assert not found.sizes  # a vehicle does not wait for them as it starts
    asyncio.run(found.read())
    return found


def content(overlays: OverlayFiles, name: str) -> dict:
    return json.loads(overlays.path(name).read_bytes())


def run(*words: object) -> tuple[int, str]:
    result = CliRunner().invoke(main, ["map", "import", *map(str, words)])
    return result.exit_code, result.output


def imported(folder: Path, path: Path) -> list[dict]:
    code, output = run(path, "--into", folder)
    assert code == 0, output
    overlays = overlays_of(folder)
    assert overlays.troubles == []
    return content(overlays, path.stem)["features"]


def collection(*features: tuple[dict, dict]) -> str:
    items = [{"type": "Feature", "geometry": shape, "properties": words} for shape, words in features]
    return json.dumps({"type": "FeatureCollection", "features": items})


def test_an_electronic_chart_has_contours_soundings_and_obstructions(tmp_path):
    found = imported(tmp_path, SMALL)
    kinds = sorted((each["properties"]["kind"], each["properties"].get("depth")) for each in found)
    assert kinds == [("contour", 5.0), ("obstruction", 2.5), ("sounding", 3.5), ("sounding", 4.5)]
    (rock,) = [each for each in found if each["properties"]["kind"] == "obstruction"]
    assert rock["properties"]["name"] == "<img src=x>"  # the page shows it as text
    assert rock["geometry"] == {"type": "Point", "coordinates": [-8.7, 41.18]}


@pytest.mark.parametrize(
    ("name", "text", "kinds"), [("a.kml", KML, ["mark", "area"]), ("b.gpx", GPX, ["mark"])], ids=["kml", "gpx"]
)
def test_routes_and_marks_of_other_programs(tmp_path, name, text, kinds):
    (path := tmp_path / name).write_text(text)
    found = imported(tmp_path / "charts", path)
    assert [each["properties"]["kind"] for each in found] == kinds
    assert found[0]["properties"]["name"] in ("<b>Buoy", "Mooring")


def test_geojson_keeps_its_kinds(tmp_path):
    point = {"type": "Point", "coordinates": [-8.7, 41.18, 5.0]}
    (path := tmp_path / "c.geojson").write_text(
        collection((CONTOUR, {"depth": 5}), (point, {"kind": "obstruction", "name": "rock"}), (point, {"kind": "x"}))
    )
    found = imported(tmp_path / "charts", path)
    assert [each["properties"] for each in found] == [
        {"depth": 5, "kind": "contour"},
        {"name": "rock", "kind": "obstruction"},
        {"kind": "mark"},
    ]


def test_depths_become_contours_around_a_place(tmp_path):
    lines = [
        f"{-8.7 + 0.0002 * east},{41.18 + 0.0002 * north},{2 + 0.3 * north}"
        for north in range(20)
        for east in range(20)
    ]
    (path := tmp_path / "survey.csv").write_text("longitude,latitude,depth\n" + "\n".join(lines) + "\n")
    code, output = run(path, "--into", tmp_path / "charts")
    assert (code, "--around" in output) == (2, True)
    code, output = run(path, "--into", tmp_path / "charts", "--around", "41.182,-8.698", "--radius", 400)
    assert code == 0, output
    found = content(overlays_of(tmp_path / "charts"), "survey")["features"]
    assert {each["properties"]["kind"] for each in found} == {"contour"}
    assert len({each["properties"]["depth"] for each in found}) >= 4


@pytest.mark.parametrize(
    ("name", "data", "reason"),
    [
        ("a.000", b"no chart", "is no .000 file"),
        ("b.000", SMALL.read_bytes()[:900], "b.000: "),
        ("c.kml", b"<OGRVRTDataSource><!-- <kml> --></OGRVRTDataSource>", "is no .kml file"),
        ("d.kml", b"<kml><Document></Document></kml>", "d.kml: "),
        ("e.gpx", b"<gpx><wpt lat='x'", "e.gpx: "),
        ("f.geojson", b"{", "line 1"),
        ("g.geojson", b"[]", "no collection of features"),
        (
            "h.geojson",
            collection(({"type": "Point", "coordinates": [500000, 4.5e6]}, {})).encode(),
            "no place in degrees",
        ),
        ("i.geojson", collection(({"type": "Sphere", "coordinates": []}, {})).encode(), "'Sphere' are not drawn"),
        ("j.geojson", b'{"a": "\xff"}', "UTF-8"),
        ("k.shp", b"", "is in no known format"),
    ],
)
def test_a_bad_file_is_named_with_the_reason(tmp_path, name, data, reason):
    (path := tmp_path / name).write_bytes(data)
    code, output = run(path, "--into", tmp_path / "charts")
    assert code == 2, output
    assert reason in output
    assert "Traceback" not in output
    assert not list(tmp_path.glob("charts/*"))


def test_of_two_charts_with_one_name_none_replaces_the_other(tmp_path):
    text = collection(({"type": "Point", "coordinates": [-8.7, 41.2]}, {}))
    for folder in ("north", "south"):
        (tmp_path / folder).mkdir()
        (tmp_path / folder / "marks.geojson").write_text(text)
    paths = [tmp_path / folder / "marks.geojson" for folder in ("north", "south")]
    code, output = run(*paths, "--into", tmp_path / "charts")
    assert (code, "more than one chart becomes" in output) == (2, True)
    assert not list(tmp_path.glob("charts/*"))
    assert "marks.geojson: 1 feature\n" in run(paths[0], "--into", tmp_path / "charts")[1]


def test_a_large_chart_is_thinned_to_what_a_page_draws(tmp_path):
    many = {"type": "LineString", "coordinates": [[-8.7 + 1e-6 * number, 41.18] for number in range(60_000)]}
    (path := tmp_path / "c.geojson").write_text(collection((many, {}), (many, {})))
    found = imported(tmp_path / "charts", path)
    assert [each["geometry"]["coordinates"][-1] for each in found] == [many["coordinates"][-1]] * 2
    assert "thinned from 120000 to 1" in run(path, "--into", tmp_path / "charts")[1]
    (tmp_path / "charts/c.geojson").write_text(path.read_text())
    assert "more than 100000 places" in overlays_of(tmp_path / "charts").troubles[0]


def test_overlays_that_cannot_be_read_are_named_and_the_others_served(tmp_path):
    (tmp_path / "bad.geojson").write_text("{")
    (tmp_path / "deep.geojson").write_text("[" * 100_000)
    for number in range(MOST_FILES + 2):
        (tmp_path / f"o{number:02}.geojson").write_text(collection((CONTOUR, {"depth": 1.0})))
    found = overlays_of(tmp_path)
    assert len(found.sizes) == MOST_FILES
    assert [trouble.split("/")[-1].split(":")[0] for trouble in found.troubles] == [
        "bad.geojson",
        "deep.geojson",
        f"o{MOST_FILES:02}.geojson",
    ]
    assert found.path("../etc/passwd") is None


def test_another_process_reads_overlays_and_their_files_end_with_the_page(tmp_path, monkeypatch):
    def read(*_: object) -> None:
        raise AssertionError("a vehicle that serves the page waits meanwhile")

    monkeypatch.setattr("shoal.console.charts.chart_overlays.read_features", read)
    (tmp_path / "a.geojson").write_text(collection((CONTOUR, {"depth": 1.0})))
    found = overlays_of(tmp_path)
    path = found.path("a")
    assert path.stat().st_size == found.sizes["a"]
    found.close()
    assert not path.exists()
    assert found.path("a") is None


def test_a_full_disk_is_named_once_however_often_a_page_asks(tmp_path, monkeypatch):
    def make(**_: object) -> None:
        raise OSError(errno.ENOSPC, os.strerror(errno.ENOSPC))

    monkeypatch.setattr("tempfile.TemporaryDirectory", make)
    found = overlays_of(tmp_path)
    asyncio.run(found.read())
    assert found.troubles == [f"{tmp_path}: no overlays: [Errno 28] No space left on device"]


def test_a_depth_beyond_all_numbers_is_none(tmp_path):
    (tmp_path / "a.geojson").write_text(collection((CONTOUR, {"depth": 10**400})))
    found = overlays_of(tmp_path)
    assert (found.troubles, content(found, "a")["features"][0]["properties"]) == ([], {"kind": "line"})


def test_a_vehicle_serves_its_overlays_and_its_limits(tmp_path):
    (tmp_path / "charts").mkdir()
    (tmp_path / "charts/harbor.geojson").write_text(collection((CONTOUR, {"depth": 5})))
    area = ["Initial Setting - Area Center=41.185, -8.7062", "Initial Setting - Area Size=400, 200"]
    words = [word for option in area for word in ("--set", f"Monitors.OperationalLimits:{option}")]
    with vehicle_page(tmp_path, "--set", "Transports.Console:Map Tiles=charts", *words) as page:
        assert page.request("GET", "/api/overlays")[0] == 401
        page.log_in()
        assert list(page.get("/api/overlays")["sizes"]) == ["harbor"]
        assert page.get("/api/overlay?name=harbor")["features"][0]["properties"] == {"depth": 5, "kind": "contour"}
        assert page.request("GET", "/api/overlay?name=../harbor")[0] == 404
        found = page.get("/api/limits?vehicle=lauv-noptilus-1")
        assert found["max_depth"] == 50.0
        north, south = max(lat for lat, _ in found["area"]), min(lat for lat, _ in found["area"])
        assert (north - south) * 111_060 == pytest.approx(400.0, abs=2.0)
        assert not page.get("/api/limits?vehicle=nobody")["ok"]
