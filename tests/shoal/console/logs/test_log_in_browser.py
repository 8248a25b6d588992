"""A log, and a plan that is flown before it is stored, on the page in a real browser."""

import json
import re

import pytest

from tests.outside import until
from tests.shoal.console.browser import browser
from tests.shoal.console.logs.logged_run import record_run
from tests.shoal.console.operator_page import operator_page
from tests.shoal.network.running import running

NAME = "lauv-noptilus-1"
PLAN = 'plan: "near"\nmaneuvers:\n- goto: {lat: 41.1850°, lon: -8.7059°, depth: 1.5, speed: 1.0 m/s}\n'
FLOWN = 120.0  # s, on a busy computer
pytestmark = pytest.mark.browser


def set_value(page, name: str, value: object, *events: str) -> None:
    page.run(f"document.getElementById({json.dumps(name)}).value = {json.dumps(value)}")
    for event in events:
        page.run(f"document.getElementById({json.dumps(name)}).dispatchEvent(new Event({json.dumps(event)}))")


def test_a_log_is_scrubbed_played_and_offers_no_orders(tmp_path):
    _, dive = record_run(tmp_path / "run")
    with operator_page(str(dive)) as console, browser(tmp_path / "browser") as page:
        page.set_size(1280, 800)
        page.open(console.link)
        until(lambda: "00:00:00 of 00:00:34" in page.text("#replay-clock"), 30.0)
        center = "import('/files/map_layer.js').then(({ map }) => map.getCenter().distanceTo([41.185, -8.706]))"
        until(lambda: page.run(center) < 200.0, told=lambda: page.run(center))
        for name in (".orders", "[data-view=plans]", "[data-view=parameters]"):
            assert page.run(f"getComputedStyle(document.querySelector('{name}')).display") == "none"
        for seconds in range(0, 30, 2):  # the slider goes on while answers are on their way
            set_value(page, "replay-time", seconds, "input")
        set_value(page, "replay-time", 20, "input", "change")
        until(lambda: "depth 1.9 m" in page.text("#summary"), told=lambda: page.text("#summary"))
        until(lambda: page.text("#replay-clock").startswith("00:00:20"))
        set_value(page, "replay-speed", "10", "change")
        page.press("#replay-play")
        until(lambda: page.text("#replay-clock").startswith("00:00:34"))
        until(lambda: page.text("#replay-play") == "Play")
        page.press("[data-view=log]")
        until(lambda: page.run("document.querySelectorAll('#entries tr').length") > 1)
        until(lambda: page.run("fetch('/api/contours?vehicle=x').then((answer) => answer.status)") == 200)
        assert page.errors == []


def test_a_plan_is_flown_before_it_is_stored(tmp_path):
    (tmp_path / "vehicle").mkdir()
    with running(tmp_path / "vehicle"), operator_page() as console, browser(tmp_path / "browser") as page:
        page.set_size(1280, 800)
        page.open(console.link)
        until(lambda: "service" in page.text("#summary"), 60.0, told=lambda: page.text("#summary"))
        page.press("[data-view=plans]")
        set_value(page, "plan-text", PLAN.replace("depth: 1.5", "depth: 500"))
        page.press("#plan-fly")
        until(lambda: "near would be rejected: " in page.text("#fly-result"), FLOWN)
        set_value(page, "plan-text", PLAN)
        page.press("#plan-fly")
        until(lambda: "near: plan completed" in page.text("#fly-result"), FLOWN, told=lambda: page.text("#fly-result"))
        assert page.run("document.getElementById('fly-running').hidden")
        assert page.run("document.querySelectorAll('#fly-plots canvas').length") == 2
        page.press("#plan-put")
        until(lambda: "near is stored" in page.text("#result"), told=lambda: page.text("#result"))
        set_value(page, "plan-text", PLAN.replace("8.7059", "8.8000"))
        page.press("#plan-fly")
        until(lambda: re.fullmatch(r"[1-9]\d* %, \d\d:\d\d:\d\d of the vehicle's time", page.text("#fly-time")), FLOWN)
        assert page.run("document.getElementById('fly-progress').value") > 0
        page.press("#fly-cancel")
        until(lambda: page.text("#fly-result") == "cancelled", told=lambda: page.text("#fly-result"))
        assert page.run("document.getElementById('fly-running').hidden")
        delete = "#plans li:has(span) .twice"
        page.press(delete)
        assert page.text(delete) == "Delete: press again"
        assert "near" in page.text("#plans")
        page.press(delete)
        until(lambda: "near" not in page.text("#plans"), told=lambda: page.text("#result"))
        assert page.errors == []
