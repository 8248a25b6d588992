"""Steering by keys and pointer in a real browser, and what takes the keys away: another element, a frozen page."""

import pytest

from tests.outside import until
from tests.shoal.console.browser import Browser, browser
from tests.shoal.console.operator_page import vehicle_page

NAME = "otter"
pytestmark = pytest.mark.browser


@pytest.fixture(scope="module")
def served(tmp_path_factory):
    with vehicle_page(tmp_path_factory.mktemp("vehicle"), profile=NAME) as found:
        yield found


@pytest.fixture(scope="module")
def tab(served, tmp_path_factory):
    with browser(tmp_path_factory.mktemp("browser")) as found:
        found.call("Emulation.setFocusEmulationEnabled", enabled=True)
        found.set_size(1280, 800)
        found.open(served.link)
        until(lambda: "service" in found.text("#summary"), 60.0, told=lambda: found.text("#summary"))
        found.press("[data-view=steer]")
        yield found


def key(tab: Browser, kind: str, code: str) -> None:
    tab.call("Input.dispatchKeyEvent", type=kind, key=" " if code == "Space" else code, code=code)


def begin(tab: Browser) -> None:
    tab.press("#steer-begin")
    until(lambda: "ready" in tab.text("#steer-state"), told=lambda: tab.text("#steer-state"))
    assert tab.run("document.activeElement.id") == "steer-pad"


def end(tab: Browser) -> None:
    tab.press("#steer-end")
    until(lambda: "the operator has ended it" in tab.text("#steer-state"), told=lambda: tab.text("#steer-state"))
    until(lambda: tab.text("#summary").startswith("service"))


def hold_ahead(tab: Browser) -> None:
    for code in ("Space", "ArrowUp"):
        key(tab, "rawKeyDown", code)
    until(lambda: "you steer" in tab.text("#steer-state"), told=lambda: tab.text("#steer-state"))
    until(lambda: "motors turning" in tab.text("#summary"), told=lambda: tab.text("#summary"))


def release(tab: Browser) -> None:
    for code in ("ArrowUp", "Space"):
        key(tab, "keyUp", code)


def at_rest(tab: Browser) -> None:
    until(lambda: "motors at rest" in tab.text("#summary"), told=lambda: tab.text("#summary"))


def test_keys_steer_while_the_space_bar_is_held(tab):
    begin(tab)
    key(tab, "rawKeyDown", "ArrowUp")
    until(lambda: "ready" in tab.text("#steer-state"))
    assert tab.run("document.getElementById('steer-pad').classList.contains('held')") is False
    key(tab, "keyUp", "ArrowUp")
    hold_ahead(tab)
    key(tab, "keyUp", "Space")
    at_rest(tab)
    key(tab, "keyUp", "ArrowUp")
    hold_ahead(tab)
    tab.run("document.getElementById('vehicle').focus()")  # the keys are for another element now
    at_rest(tab)
    assert "ready" in tab.text("#steer-state")
    release(tab)
    end(tab)


def test_a_pointer_that_pulls_steers(tab):
    begin(tab)
    pad = "document.getElementById('steer-pad').getBoundingClientRect()"
    left, top, width = (tab.run(f"{pad}.{name}") for name in ("x", "y", "width"))
    place = {"x": left + width / 2, "y": top + 20, "button": "left", "clickCount": 1}
    tab.call("Input.dispatchMouseEvent", type="mousePressed", **place)
    until(lambda: "motors turning" in tab.text("#summary"), told=lambda: tab.text("#summary"))
    tab.call("Input.dispatchMouseEvent", type="mouseReleased", **place)
    at_rest(tab)
    end(tab)


def test_a_game_pad_steers_while_a_shoulder_button_is_held(tab):
    """The browser has none here: the page asks this one."""

    def give(pads: str) -> None:
        tab.run(f"navigator.getGamepads = () => {pads}; 0")

    pad = "{{connected: {}, axes: [0, -1, 0.02, 0], buttons: Array(8).fill({{pressed: {}}})}}"
    begin(tab)
    try:
        give(f"[null, {pad.format('true', 'true')}]")
        until(lambda: "motors turning" in tab.text("#summary"), told=lambda: tab.text("#summary"))
        give(f"[null, {pad.format('true', 'false')}]")
        at_rest(tab)
        give(f"[null, {pad.format('true', 'true')}]")
        until(lambda: "motors turning" in tab.text("#summary"), told=lambda: tab.text("#summary"))
        give("[null, null]")  # its cable is pulled out
        at_rest(tab)
    finally:
        give("[]")
    end(tab)


def test_a_page_that_sleeps_with_a_key_down_stops_the_boat_and_steers_no_more_when_it_wakes(tab, served):
    """As a laptop whose lid is closed: the page does nothing at all, and the key is down all the time."""
    before = len(served.lines)
    begin(tab)
    hold_ahead(tab)
    with tab.asleep():
        reason = "steering ends: its page has been silent for 3 s"
        until(lambda: any(reason in line for line in served.lines[before:]), told=lambda: served.lines[before:])
    at_rest(tab)
    until(lambda: tab.run("!document.getElementById('steer-begin').hidden"), told=lambda: tab.text("#steer-state"))
    release(tab)
    until(lambda: tab.text("#summary").startswith("service"))


@pytest.mark.parametrize(("width", "scheme"), [(360, "light"), (360, "dark"), (1280, "dark")])
def test_the_view_fits_every_screen(tab, width, scheme):
    tab.set_size(width, 640)
    tab.set_dark(scheme)
    assert tab.run("document.documentElement.scrollWidth") <= width
    assert tab.run("document.getElementById('steer-pad').getBoundingClientRect().right") <= width
    tab.set_size(1280, 800)
    tab.set_dark("light")


def test_it_has_no_errors(tab):
    assert tab.errors == []
