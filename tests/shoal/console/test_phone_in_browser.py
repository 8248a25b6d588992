"""The page on a phone, where one view is seen at a time, and that is turned on its side."""

import pytest

from tests.outside import until
from tests.shoal.console.browser import opened_vehicle_page
from tests.shoal.console.logs.test_log_in_browser import PLAN, set_value
from tests.shoal.console.test_in_browser import open_plans, view

PATIENCE = 60.0  # s, on a busy computer
ZOOM = "import('/files/map_layer.js').then(({ map }) => map.getZoom())"
CENTER = "import('/files/map_layer.js').then(({ map }) => map.getCenter().distanceTo([41.185, -8.7059]))"
PLACES = """import('/files/map_layer.js').then(({ map }) => Object.values(map._layers)
    .filter((each) => each.getTooltip?.()?.getContent().textContent.startsWith('Goto')).length)"""
pytestmark = pytest.mark.browser


@pytest.fixture(scope="module")
def page(tmp_path_factory):
    with opened_vehicle_page(tmp_path_factory.mktemp("vehicle"), 360, 740) as found:
        yield found


def test_a_plan_that_is_shown_while_the_map_is_hidden_is_on_it_afterward(page):
    until(lambda: page.run(ZOOM) == 18, told=lambda: page.run(ZOOM))  # where the vehicle is
    open_plans(page)
    set_value(page, "plan-text", PLAN + PLAN.splitlines()[-1].replace("50°, lon: -8.7059", "55°, lon: -8.7064") + "\n")
    page.press("#plan-put")
    until(lambda: "near" in page.text("#plans"), PATIENCE, told=lambda: page.text("#result"))
    page.press("#plans li button")
    until(lambda: page.run(PLACES) == 2)
    view(page, "map")
    until(lambda: page.run(ZOOM) >= 18, told=lambda: page.run(ZOOM))
    assert page.run(CENTER) < 100.0


def test_plots_fit_a_phone_that_is_turned(page):
    view(page, "plots")
    page.run("document.getElementById('field').value = 'EstimatedState.depth'")
    page.press("#field-add")
    until(lambda: page.run("document.querySelectorAll('#plots canvas').length") == 1)
    place = "document.querySelector('#plots > div').clientWidth"
    shown = "document.querySelector('#plots .u-wrap').clientWidth"
    widths = []
    for width, height in ((740, 360), (1280, 800), (360, 740)):
        page.set_size(width, height)
        until(lambda: page.run(f"{place} - {shown}") == 10, told=lambda: [page.run(place), page.run(shown)])
        widths.append(page.run(shown))
    assert widths[0] > 600
    assert widths[2] < 360


def test_it_has_no_errors(page):
    assert page.errors == []
