"""The page in a real browser, beside a shipped vehicle; `.ci/browser` installs Chromium."""

import json
import re
import time
from typing import Any

import pytest

from tests.outside import until
from tests.shoal.console.browser import browser
from tests.shoal.console.operator_page import operator_page
from tests.shoal.network.running import running

NAME = "lauv-noptilus-1"
HOSTILE = ("__proto__", "constructor", "<img src=x>")
pytestmark = pytest.mark.browser


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


def open_plans(page) -> None:
    """Open the view of plans; their list moves what is below it when it comes."""
    view(page, "plans")
    until(lambda: page.text("#plans"), 60.0, told=lambda: page.text("#result"))


def draw_plan(page, name: str) -> None:
    open_plans(page)
    page.run(f"document.getElementById('draw-name').value = {json.dumps(name)}")
    page.press("#draw-toggle")
    for x, y in ((300, 400), (380, 430), (420, 360)):
        page.press_at(x, y)
    page.press("#draw-toggle")
    assert page.run("document.getElementById('draw-points').value") == "3"


def give_frame(page, **words: object) -> None:
    """A frame that the console has not sent; what is not named is empty."""
    frame = {"now": time.time(), "values": {}, "vehicles": {}, "gone": [], "log": [], **words}
    give_text(page, json.dumps(frame))


def give_text(page, text: str) -> None:
    page.run(f"import('/files/main.js').then((page) => page.receive({json.dumps(text)}))")


def known(page, words: str) -> Any:
    """A value of the page's store."""
    return page.run(f"import('/files/main.js').then(({{ store }}) => {words})")


def fake_vehicle(label: str, **state: object) -> dict[str, object]:
    place = {"time": time.time(), "lat": 41.0, "lon": -8.0, "depth": 0.0, "heading": 0.0, "uncertainty": 3.0}
    return {
        "system": {"name": label, "there": True, "battery": None, "conflict": None},
        "state": {**place, **state},
        "plan": {"mode": "service", "name": None, "progress": None, "motors": None},
        "health": {"entities": []},
    }


def choose(page, name: str) -> None:
    # In one step: a frame in between would set the list back.
    page.run(
        f"(() => {{ const list = document.getElementById('vehicle'); list.value = {json.dumps(name)};"
        " list.dispatchEvent(new Event('change')); })()"
    )


def test_the_page_shows_the_vehicle_on_the_map(page):
    assert "battery" in page.text("#summary")
    assert page.run("document.querySelectorAll('.arrow').length") == 1
    assert "Navigation" in page.text("#entities")
    assert page.run("location.hash") == ""


def test_a_plan_is_drawn_stored_started_and_aborted(page):
    draw_plan(page, "drawn by mouse")
    page.press("#draw-put")
    until(lambda: "drawn by mouse is stored; " in page.text("#result"), told=lambda: page.text("#result"))
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
    give_frame(page, log=[[time.time(), NAME, "error", "", "abort"], [time.time(), NAME, "info", "", "another"]])
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


def tab_to(page, selector: str) -> None:
    """Move the focus by the Tab key until an element has it, and is seen to have it."""
    page.run("document.activeElement.blur()")
    for _ in range(200):
        page.key("Tab")
        if page.run(f"document.activeElement.matches({json.dumps(selector)})"):
            assert page.run("getComputedStyle(document.activeElement).outlineStyle") != "none"
            return
    raise AssertionError(f"{selector} is not reached by Tab")


def test_it_works_by_keyboard_alone(page):
    tab_to(page, "#hold")
    page.key("Enter")
    assert "press again" in page.text("#hold")
    until(lambda: page.text("#hold") == "Hold")
    tab_to(page, "[data-view=plans]")
    page.key("Enter")
    assert page.run("document.getElementById('plans-view').hidden") is False
    tab_to(page, "#plan-text")
    page.call("Input.dispatchKeyEvent", type="keyDown", key="a", code="KeyA", modifiers=2, commands=["selectAll"])
    page.call(
        "Input.insertText", text='plan: "typed"\nmaneuvers:\n- goto: {lat: 41.1850°, lon: -8.7059°, speed: 1 m/s}\n'
    )
    tab_to(page, "#plan-put")
    page.key("Enter")
    until(lambda: "typed is stored" in page.text("#result"), told=lambda: page.text("#result"))
    tab_to(page, "#abort")
    for _ in range(2):
        page.key("Enter")
    until(lambda: re.search("(obeyed|aborted): mode", page.text("#result")), told=lambda: page.text("#result"))


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


def test_abort_all_is_one_request_whose_answers_are_all_shown(page):
    asked = len(page.requests)
    assert re.fullmatch(f"{NAME}: (obeyed|aborted): mode (error|service).*", order(page, "abort-all"))
    assert sum(address.endswith("/api/order") for address in page.requests[asked:]) == 1


def test_no_name_of_a_vehicle_stops_the_page(page):
    view(page, "map")
    give_frame(page, vehicles={name: fake_vehicle(name) for name in HOSTILE})
    give_frame(page, vehicles={name: {"state": fake_vehicle(name)["state"]} for name in HOSTILE})
    assert page.run("[...document.getElementById('vehicle').options].map((each) => each.value)") == sorted(
        [*HOSTILE, NAME]
    )
    assert page.run("document.querySelectorAll('.arrow').length") == 1 + len(HOSTILE)
    assert page.run("document.querySelectorAll('img[src=x]').length") == 0
    for name in HOSTILE:
        choose(page, name)
        assert page.text("#summary").startswith("service")
    assert "failed" not in page.text("#result")
    choose(page, NAME)
    give_frame(page, gone=list(HOSTILE))


def test_the_choice_of_the_operator_stays_while_its_vehicle_is_lost(page):
    chosen = "constructor"
    give_frame(page, vehicles={chosen: fake_vehicle("another")})
    choose(page, chosen)
    page.press("#hold")
    assert "press again" in page.text("#hold")
    choose(page, NAME)
    assert page.text("#hold") == "Hold"
    choose(page, chosen)
    give_frame(page, gone=list(HOSTILE))
    assert page.run("document.getElementById('vehicle').value") == chosen
    assert page.text("#summary") == "another: LOST"
    choose(page, NAME)
    assert "battery" in page.text("#summary")


def test_the_open_view_is_of_the_vehicle_that_is_chosen(page):
    view(page, "plans")
    page.press("#plans-refresh")
    until(lambda: "Show" in page.text("#plans"), told=lambda: page.text("#result"))
    give_frame(page, vehicles={"another": fake_vehicle("another")})
    choose(page, "another")
    assert page.text("#plans") == ""
    choose(page, NAME)
    until(lambda: "Show" in page.text("#plans"), told=lambda: page.text("#result"))
    give_frame(page, gone=["another"])


def test_the_health_of_a_vehicle_that_is_lost_is_shown_as_old(page):
    lost = fake_vehicle("another")
    lost["system"]["there"] = False
    give_frame(page, vehicles={"another": lost})
    choose(page, "another")
    assert page.text("#health-note").startswith("LOST: ")
    choose(page, NAME)
    assert page.text("#health-note") == ""
    give_frame(page, gone=["another"])


def test_a_page_whose_connection_is_dead_connects_anew(page):
    page.run("import('/files/main.js').then(({ store }) => { window.dead = store.socket; dead.onmessage = null; })")
    until(lambda: known(page, "Boolean(store.socket) && store.socket !== window.dead"), 90.0)
    until(lambda: "battery" in page.text("#summary"), told=lambda: page.text("#summary"))


def test_a_wider_window_shows_the_view_beside_the_map(page):
    page.set_size(360, 640)
    view(page, "map")
    assert page.run("document.getElementById('health-view').clientHeight") == 0
    page.set_size(1280, 800)
    until(lambda: page.run("document.getElementById('health-view').clientHeight") > 100)


def test_a_frame_that_fails_is_reported_and_the_next_one_is_shown(page):
    give_text(page, "no JSON")
    assert page.text("#result").startswith("this page has failed: ")
    give_frame(page, log=[[1e300, NAME, "info", "", "at no time"], [0, NAME, "info", "", "at midnight"]])
    view(page, "log")
    page.run("document.getElementById('log-filter').value = 'at '")
    page.run("document.getElementById('log-filter').dispatchEvent(new Event('input'))")
    rows = page.run("[...document.querySelectorAll('#entries tr')].map((each) => each.textContent)")
    assert {f"?at no time{NAME}", f"00:00:00at midnight{NAME}"} <= set(rows)


def test_a_track_goes_on_after_its_longest(page):
    points = [[41 + at / 1e5, -8, 0] for at in range(17_999)]
    name, now = "far", time.time()
    give_frame(page, now=now, vehicles={name: fake_vehicle(name)}, tracks={name: points})
    for second, depth in enumerate((0, 0, 15, 15)):
        for later in (0.0, 0.5):  # too early for a point of its own
            state = fake_vehicle(name, lat=42 + second / 1e3 + later / 1e4, depth=depth)["state"]
            give_frame(page, now=now + second + later, vehicles={name: {"state": state}})
    assert known(page, f"[store.tracks['{name}'].points.length, store.tracks['{name}'].dropped]") == [16_203, 1_800]
    assert known(page, f"store.tracks['{name}'].points.at(-1)") == [42.003, -8, 15]
    give_frame(page, all=True, vehicles={NAME: known(page, f"store.vehicles['{NAME}']")})
    assert known(page, f"store.tracks['{name}'].points.length") == 16_203


def test_a_field_that_is_not_drawn_is_reported(page):
    view(page, "plots")
    page.run("document.getElementById('field').value = 'EstimatedState.depth'")
    page.press("#field-add")
    until(lambda: page.run("document.querySelectorAll('#plots canvas').length"))
    for field, told in (("constructor", "there is no field"), ("EstimatedState.depth", "is drawn already")):
        page.run(f"document.getElementById('field').value = '{field}'")
        page.press("#field-add")
        until(lambda told=told: told in page.text("#result"), told=lambda: page.text("#result"))
    for name in ("phi", "theta", "psi", "lat", "lon", "height", "x", "y"):
        page.run(f"document.getElementById('field').value = 'EstimatedState.{name}'")
        page.press("#field-add")
    until(lambda: "at most 8 fields" in page.text("#result"), told=lambda: page.text("#result"))
    assert page.run("document.querySelectorAll('#plots canvas').length") == 8


def test_without_a_login_it_says_how_to_log_in(page, tmp_path):
    with browser(tmp_path) as stranger:
        stranger.open(page.run("location.origin"))
        until(
            lambda: stranger.text("#result").startswith("Log in: open the link"), told=lambda: stranger.text("#result")
        )


def test_it_asks_no_other_host_and_has_no_errors(page):
    hosts = {address.split("/")[2].split(":")[0] for address in page.requests if address.startswith("http")}
    assert hosts == {"127.0.0.1"}
    assert page.errors == []
