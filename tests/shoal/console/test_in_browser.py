"""The page in a real browser, beside a shipped vehicle; `.ci/browser` installs Chromium."""

import json
import re

import pytest

from tests.outside import until
from tests.shoal.console.browser import CHROMIUM, browser
from tests.shoal.console.operator_page import operator_page
from tests.shoal.network.running import running

NAME = "lauv-noptilus-1"
pytestmark = [
    pytest.mark.heavy,
    pytest.mark.browser,
    pytest.mark.skipif(CHROMIUM is None, reason="needs Chromium"),
]


@pytest.fixture(scope="module")
def page(tmp_path_factory):
    with (
        running(tmp_path_factory.mktemp("vehicle")),
        operator_page() as console,
        browser(tmp_path_factory.mktemp("browser")) as found,
    ):
        found.set_size(1280, 800)
        found.open(console.link)
        until(lambda: "service" in found.text("#summary"), 60.0, told=lambda: found.text("#summary"))
        yield found


def order(page, name: str) -> str:
    """Press an order and confirm it; returns the answer that the page shows."""
    page.press(f"#{name}")
    assert "press again" in page.text(f"#{name}")
    page.press(f"#{name}")
    return until(lambda: answer if "sent to" not in (answer := page.text("#result")) else "", 30.0)


def view(page, name: str) -> None:
    page.press(f"[data-view={name}]")


def draw_plan(page, name: str) -> None:
    view(page, "plans")
    page.run(f"document.getElementById('draw-name').value = {json.dumps(name)}")
    page.press("#draw-toggle")
    for x, y in ((300, 400), (380, 430), (420, 360)):
        page.press_at(x, y)
    page.press("#draw-toggle")
    assert page.run("document.getElementById('draw-points').value") == "3"


def test_the_page_shows_the_vehicle_on_the_map(page):
    assert "battery" in page.text("#summary")
    assert page.run("document.querySelectorAll('.arrow').length") == 1
    assert "Navigation" in page.text("#entities")
    assert page.run("location.hash") == ""


def test_a_plan_is_drawn_stored_started_and_aborted(page):
    draw_plan(page, "drawn by mouse")
    page.press("#draw-put")
    until(lambda: "drawn by mouse is stored; estimated time" in page.text("#result"), told=lambda: page.text("#result"))
    until(lambda: "drawn by mouse" in page.text("#plans"))
    page.press("#plans li button:nth-of-type(2)")
    until(lambda: "obeyed: drawn by mouse is carried out" in page.text("#result"), told=lambda: page.text("#result"))
    until(lambda: "drawn by mouse: " in page.text("#progress"))
    until(lambda: "motors turning" in page.text("#summary"), 40.0)
    assert "obeyed: console-hold" in order(page, "hold")
    assert re.search("(obeyed|aborted): mode (error|service)", order(page, "abort"))
    until(lambda: page.text("#summary").startswith("service"), 60.0)


def test_fields_are_drawn_and_the_log_book_is_filtered(page):
    view(page, "plots")
    until(lambda: page.run("document.querySelectorAll('#fields option').length") > 1000)
    page.run("document.getElementById('field').value = 'EstimatedState.depth'")
    page.press("#field-add")
    until(lambda: page.run("document.querySelectorAll('#plots canvas').length") == 1)
    view(page, "log")
    until(lambda: page.run("document.querySelectorAll('#entries tr').length") > 3)
    page.run("document.getElementById('log-filter').value = 'abort'")
    page.run("document.getElementById('log-filter').dispatchEvent(new Event('input'))")
    until(lambda: "abort" in page.text("#entries tr").lower())


def test_parameters_are_read_and_set(page):
    view(page, "parameters")
    until(lambda: "Depth Sensor" in page.text("#entity"))
    page.run("document.getElementById('entity').value = 'Depth Sensor'")
    page.press("#entities-read")
    until(lambda: "Standard Deviation" in page.text("#values"))


def test_it_works_by_keyboard_alone(page):
    page.run("document.getElementById('hold').focus()")
    page.key("Enter")
    assert "press again" in page.text("#hold")
    until(lambda: page.text("#hold") == "Hold")


@pytest.mark.parametrize(("width", "height"), [(360, 640), (1280, 800)])
@pytest.mark.parametrize("scheme", ["light", "dark"])
def test_orders_and_map_fit_every_screen(page, width, height, scheme):
    page.set_size(width, height)
    page.set_dark(scheme)
    view(page, "map")
    assert page.run("document.documentElement.scrollWidth") <= width
    for name in ("abort", "hold", "surface", "abort-all"):
        right = page.run(f"document.getElementById('{name}').getBoundingClientRect().right")
        assert 0 < right <= width
    assert page.run("document.getElementById('map').clientHeight") > 150
    page.set_size(1280, 800)
    page.set_dark("light")


def test_it_asks_no_other_host_and_has_no_errors(page):
    hosts = {address.split("/")[2].split(":")[0] for address in page.requests if address.startswith("http")}
    assert hosts == {"127.0.0.1"}
    assert page.errors == []
