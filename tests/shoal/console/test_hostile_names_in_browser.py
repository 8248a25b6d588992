"""Names in plans, log books, entities and alarms are text on the page, whatever is in them."""

import time

import pytest

from tests.outside import until
from tests.shoal.console.browser import opened_vehicle_page
from tests.shoal.console.logs.test_log_in_browser import set_value
from tests.shoal.console.test_in_browser import fake_vehicle, give_frame, open_plans, view

HOSTILE = "<img src=x onerror=window.hacked=1>"
PLAN = f"plan: '{HOSTILE}'\nmaneuvers:\n- goto: {{lat: 41.1850°, lon: -8.7059°, depth: 1.5, speed: 1.0 m/s}}\n"
PATIENCE = 60.0  # s, on a busy computer
pytestmark = pytest.mark.browser


@pytest.fixture(scope="module")
def page(tmp_path_factory):
    with opened_vehicle_page(tmp_path_factory.mktemp("vehicle"), 1280, 800) as found:
        yield found


def assert_text(page) -> None:
    """No name has become an element, and no script of one has run."""
    assert page.run("document.querySelectorAll('img[src=x]').length") == 0
    assert page.run("window.hacked") is None
    assert page.errors == []


def test_the_name_of_a_plan_is_text_wherever_it_is_shown(page):
    open_plans(page)
    set_value(page, "plan-text", PLAN)
    page.press("#plan-put")
    until(lambda: HOSTILE in page.text("#plans"), PATIENCE, told=lambda: page.text("#result"))
    assert HOSTILE in page.text("#result")
    page.press("#plans li button:nth-of-type(2)")
    until(lambda: "carried out" in page.text("#result"), PATIENCE, told=lambda: page.text("#result"))
    until(lambda: HOSTILE in page.text("#progress") and HOSTILE in page.text("#summary"), PATIENCE)
    view(page, "checks")
    until(lambda: HOSTILE in page.text("#check-plan"), PATIENCE)
    assert_text(page)


def test_entities_alarms_and_the_log_book_are_text(page):
    name = "another"
    normal = {"entity": HOSTILE, "state": "normal", "text": HOSTILE, "advice": HOSTILE, "since": time.time()}
    for state in ("normal", "failure"):
        vehicle = fake_vehicle(name) | {"health": {"entities": [normal | {"state": state}]}}
        give_frame(page, vehicles={name: vehicle})
    assert f"another: {HOSTILE}: failure: {HOSTILE}" in page.text("#alarm-list")
    set_value(page, "vehicle", name, "change")
    view(page, "health")
    assert page.text("#entities").startswith(f"{HOSTILE}failure{HOSTILE}{HOSTILE}")
    give_frame(page, vehicles={name: vehicle}, log=[[time.time(), HOSTILE, "error", HOSTILE, HOSTILE, HOSTILE]])
    view(page, "log")
    assert page.text("#entries").count(HOSTILE) >= 3
    assert_text(page)
