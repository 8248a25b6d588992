"""Charts, limits, distances, drawn shapes and forecasts in a real browser, on the page of a vehicle."""

import json
import re

import pytest

from autonomy.plans.yaml import parse_plan
from tests.outside import until
from tests.shoal.console.browser import browser
from tests.shoal.console.operator_page import vehicle_page
from tests.shoal.console.test_in_browser import open_plans

NAME = "lauv-noptilus-1"
HOSTILE = "<img src=x onerror=window.hacked=1>"
AREA = ("Initial Setting - Area Center=41.185, -8.7062", "Initial Setting - Area Size=400, 200")
pytestmark = pytest.mark.browser


def overlay() -> str:
    ring = [[-8.7065, 41.1848], [-8.7059, 41.1848], [-8.7059, 41.1852], [-8.7065, 41.1852], [-8.7065, 41.1848]]
    shape = {"type": "Polygon", "coordinates": [ring]}
    item = {"type": "Feature", "geometry": shape, "properties": {"kind": "land", "name": HOSTILE}}
    return json.dumps({"type": "FeatureCollection", "features": [item]})


@pytest.fixture(scope="module")
def page(tmp_path_factory):
    folder = tmp_path_factory.mktemp("vehicle")
    (folder / "charts").mkdir()
    (folder / "charts/<b>harbor.geojson").write_text(overlay())
    words = [word for option in AREA for word in ("--set", f"Monitors.OperationalLimits:{option}")]
    with (
        vehicle_page(folder, "--set", "Transports.Console:Map Tiles=charts", *words) as vehicle,
        browser(tmp_path_factory.mktemp("browser")) as found,
    ):
        found.set_size(1280, 800)
        found.open(vehicle.link)
        until(lambda: "service" in found.text("#summary"), 60.0, told=lambda: found.text("#summary"))
        yield found


def choose_kind(page, kind: str) -> None:
    page.run(f"document.getElementById('draw-kind').value = '{kind}'")
    page.run("document.getElementById('draw-kind').dispatchEvent(new Event('change'))")


def written(page):
    """The drawn plan, once the page shows its text."""
    text = "document.getElementById('plan-text').value"
    page.run(f"{text} = ''")
    page.press("#draw-text")
    return parse_plan(until(lambda: page.run(text), told=lambda: page.text("#draw-hint")))


def test_charts_are_drawn_and_their_names_are_text(page):
    until(lambda: "harbor" in page.text("#map .leaflet-control-layers"))
    assert page.run("document.querySelector('#map .leaflet-control-layers b')") is None
    until(lambda: page.run("import('/files/map_layer.js').then(({ map }) => Object.keys(map._layers).length)") > 5)
    script = (
        "import('/files/map_layer.js').then(({ map }) => { let found = ''; map.eachLayer((layer) => {"
        " const tip = layer.getTooltip?.()?.getContent();"
        " if (tip?.textContent?.includes('land')) found = tip.textContent; }); return found; })"
    )
    found = until(lambda: page.run(script))
    assert found == f"land · {HOSTILE}"
    assert page.run("window.hacked") is None


def test_limits_of_the_vehicle_are_shown_and_distances_measured(page):
    until(lambda: "operating area dashed, depth to 50 m" in page.text("#limits"), told=lambda: page.text("#limits"))
    page.press("#measure")
    for x, y in ((300, 400), (400, 400)):
        page.press_at(x, y)
    assert re.fullmatch(r"\d+ m, last leg \d+ m toward 90°", page.text("#measured"))
    page.press("#measure")
    assert page.text("#measured") == ""


def test_shapes_have_their_own_depth_altitude_and_speed(page):
    open_plans(page)
    page.press("#draw-toggle")
    page.press_at(300, 300)
    text = "document.getElementById('plan-text').value"
    until(lambda: "goto" in page.run(text))  # as long as nobody has written another one
    page.press("#draw-undo")
    until(lambda: page.run(text) == "")
    page.run(f"{text} = 'written'")
    page.press("#draw-text")
    page.run("import('/files/plan_shapes.js').then(({ readText }) => readText())")
    assert page.run(text) == "written", "nothing is drawn"
    page.run(f"{text} = ''")
    page.press_at(300, 300)
    until(lambda: "goto" in page.run(text))
    page.run(f"{text} = 'written'")
    choose_kind(page, "rows")
    for x, y in ((300, 500), (500, 500), (500, 400)):
        page.press_at(x, y)
    assert page.run(text) == "written"
    page.run("document.getElementById('draw-reference').value = 'altitude'")
    choose_kind(page, "loiter")
    page.press_at(400, 300)
    page.press("#draw-toggle")
    page.run("document.querySelector('#drawn-list li:nth-of-type(2) label:nth-of-type(2) input').value = '0.7'")
    page.run(
        "document.querySelector('#drawn-list li:nth-of-type(2) label:nth-of-type(2) input')"
        ".dispatchEvent(new Event('change'))"
    )
    goto, rows, loiter = (item.data for item in written(page).maneuvers)
    assert [type(each).__name__ for each in (goto, rows, loiter)] == ["Goto", "Rows", "Loiter"]
    assert (rows.speed, goto.speed) == (pytest.approx(0.7), pytest.approx(1.0))
    assert rows.bearing == pytest.approx(1.5708, abs=0.02)  # to the east
    assert rows.width == pytest.approx(rows.length / 2.0, rel=0.05)
    assert rows.alternation == 100
    assert not rows.flags & 2  # the far side is north, to the left
    assert (loiter.z_units, loiter.radius, loiter.duration) == (2, 15.0, 60)
    page.press("#draw-put")
    until(lambda: "drawn" in page.text("#plans"), told=lambda: page.text("#result"))
    page.run("document.getElementById('plan-text').value = ''")
    page.press("#plans li button:nth-of-type(3)")
    until(
        lambda: "loiter" in page.run("document.getElementById('plan-text').value").lower(),
        told=lambda: page.text("#result") + page.text("#plans"),
    )


def test_a_file_is_saved_and_a_forecast_is_off_with_its_reason(page):
    page.run("document.getElementById('plan-suffix').value = '.geojson'")
    page.press("#plan-save")
    until(lambda: "drawn.geojson is saved" in page.text("#result"), told=lambda: page.text("#result"))
    page.press("#forecast-toggle")
    until(lambda: "[Transports.Console] Forecast" in page.text("#forecast-summary"))
    assert page.run("document.getElementById('forecast-toggle').getAttribute('aria-pressed')") == "false"


def test_it_fits_into_a_phone_and_has_no_errors(page):
    page.set_size(360, 740)
    assert page.run("document.documentElement.scrollWidth") <= 360
    assert not page.errors
