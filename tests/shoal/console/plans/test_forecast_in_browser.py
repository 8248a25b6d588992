"""The forecast of a running plan in a real browser: asked for, drawn, summed up and ended."""

import re

import pytest

from tests.outside import until
from tests.shoal.console.browser import browser
from tests.shoal.console.logs.test_log_in_browser import PLAN, set_value
from tests.shoal.console.operator_page import vehicle_page
from tests.shoal.console.test_in_browser import open_plans

PATIENCE = 60.0  # s, on a busy computer
SIMULATED = 240.0  # s
CIRCLES = "document.querySelectorAll('.leaflet-tooltip.mark').length"
pytestmark = pytest.mark.browser


def test_a_running_plan_is_forecast_on_the_map_with_runs_horizon_and_age(tmp_path):
    (tmp_path / "vehicle").mkdir()
    with (
        vehicle_page(tmp_path / "vehicle", "--set", "Transports.Console:Forecast=true") as vehicle,
        browser(tmp_path / "browser") as page,
    ):
        page.set_size(1280, 800)
        page.open(vehicle.link)
        until(lambda: "service" in page.text("#summary"), PATIENCE, told=lambda: page.text("#summary"))
        open_plans(page)
        set_value(page, "plan-text", PLAN.replace("8.7059", "8.7300"))
        page.press("#plan-put")
        until(lambda: "near" in page.text("#plans"), PATIENCE, told=lambda: page.text("#result"))
        page.press("#plans li button:nth-of-type(2)")
        until(lambda: "near is carried out" in page.text("#result"), PATIENCE, told=lambda: page.text("#result"))
        until(lambda: re.search(r"near: .*, \d+ s left, ends at \d\d:\d\d:\d\d UTC", page.text("#progress")), PATIENCE)
        set_value(page, "forecast-horizon", "120")
        page.press("#forecast-toggle")
        runs = r"([5-9]|\d\d) runs to 120 s; .* %"
        until(  # it is drawn from the first run on
            lambda: re.match(runs, page.text("#forecast-summary")),
            SIMULATED,
            told=lambda: page.text("#forecast-summary"),
        )
        assert re.fullmatch(r"\(\d\d:\d\d:\d\d old\)", page.text("#forecast-age"))
        assert page.run(CIRCLES) > 0
        page.press("#forecast-toggle")
        until(lambda: page.run(CIRCLES) == 0)
        assert page.text("#forecast-summary") == ""
        assert page.errors == []
