"""A page whose vehicle stands still or begins anew, whose computer sleeps, or whose clock is an hour off."""

import os
import signal
import time

import pytest

from tests.outside import until
from tests.shoal.console.browser import browser
from tests.shoal.console.operator_page import operator_page
from tests.shoal.network.running import running

NAME = "lauv-noptilus-1"
CLOCK = "{ const now = Date.now; Date.now = () => now() - 3600e3; }"
pytestmark = pytest.mark.browser


@pytest.fixture(scope="module")
def vehicle(tmp_path_factory):
    with running(tmp_path_factory.mktemp("vehicle")) as found:
        yield found


@pytest.fixture(scope="module")
def tab(vehicle, tmp_path_factory):
    with operator_page() as console, browser(tmp_path_factory.mktemp("browser")) as found:
        found.call("Page.addScriptToEvaluateOnNewDocument", source=CLOCK)
        found.set_size(1280, 800)
        found.open(console.link)
        until(lambda: "service" in found.text("#summary"), 60.0, told=lambda: found.text("#summary"))
        yield found


def summary(tab) -> str:
    return tab.text("#summary")


def is_current(tab) -> bool:
    """Whether the page shows a position that has just come."""
    shown = summary(tab)
    return shown.startswith("service") and " old" not in shown and "no data" not in shown and "LOST" not in shown


def hold(tab) -> str:
    for _ in range(2):
        tab.press("#hold")
    return until(lambda: answer if "sent to" not in (answer := tab.text("#result")) else "", 40.0)


def test_a_browser_whose_clock_is_an_hour_off_shows_no_wrong_age(tab):
    assert abs(tab.run("Date.now()") / 1000 - time.time() + 3600.0) < 60.0
    until(lambda: is_current(tab), told=lambda: summary(tab))
    assert tab.run("document.body.classList.contains('stale')") is False


def test_a_vehicle_that_stands_still_is_shown_as_old_and_its_orders_as_not_obeyed(tab, vehicle):
    os.kill(vehicle.popen.pid, signal.SIGSTOP)
    try:
        until(lambda: " s old" in summary(tab) or "LOST" in summary(tab), told=lambda: summary(tab))
        assert "NOT OBEYED" in hold(tab)
    finally:
        os.kill(vehicle.popen.pid, signal.SIGCONT)
    until(lambda: is_current(tab), told=lambda: summary(tab))


def test_a_computer_that_sleeps_shows_the_present_when_it_wakes(tab):
    with tab.asleep():
        time.sleep(8.0)  # longer than the console waits for a page to read
    until(lambda: is_current(tab), told=lambda: summary(tab))
    assert tab.run("document.body.classList.contains('stale')") is False
    before = tab.run("import('/files/main.js').then(({ store }) => store.now)")
    assert abs(time.time() - before) < 30.0


def test_a_vehicle_that_begins_anew_under_the_page_is_there_again(tab, vehicle, tmp_path):
    vehicle.kill()
    until(lambda: "LOST" in summary(tab) or " s old" in summary(tab), told=lambda: summary(tab))
    with running(tmp_path, port=vehicle.port):
        until(lambda: is_current(tab), 90.0, told=lambda: summary(tab))
        # A vehicle that boots refuses orders, with that reason.
        until(lambda: "obeyed" in hold(tab), 60.0, told=lambda: tab.text("#result"))
        assert tab.run("document.querySelectorAll('.arrow').length") == 1
    assert tab.errors == []
