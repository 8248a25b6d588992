"""The layout of the page, and its first use, in a real browser: nothing is cut, covered or out of order."""

import json
import time

import pytest

from tests.outside import until
from tests.shoal.console.browser import browser
from tests.shoal.console.logs.test_log_in_browser import set_value
from tests.shoal.console.operator_page import vehicle_page
from tests.shoal.console.test_in_browser import fake_vehicle, give_frame, known, view

NAME = "lauv-noptilus-1"
PATIENCE = 60.0  # s, on a busy computer
pytestmark = pytest.mark.browser


@pytest.fixture(scope="module")
def opened(tmp_path_factory):
    folder = tmp_path_factory.mktemp("vehicle")
    with vehicle_page(folder) as vehicle, browser(tmp_path_factory.mktemp("browser")) as found:
        found.set_size(1280, 800)
        yield found, vehicle.link


@pytest.fixture(scope="module")
def page(opened):
    """A tab that was open without a login when the link was pasted into it."""
    found, link = opened
    found.open(link.partition("#")[0])
    until(lambda: "Log in" in found.text("#result"), PATIENCE, told=lambda: found.text("#result"))
    found.call("Page.navigate", url=link)
    until(lambda: "service" in found.text("#summary"), PATIENCE, told=lambda: found.text("#result"))
    return found


def lines(page, selector: str) -> int:
    """The lines that the words of an element need."""
    words = f"(() => {{ const range = document.createRange(), box = document.querySelector('{selector}');"
    return page.run(
        words + " range.selectNodeContents(box);"
        " return new Set([...range.getClientRects()].map(({ top }) => Math.round(top))).size; })()"
    )


@pytest.mark.parametrize("width", [1280, 360])
def test_states_times_and_names_of_tabs_stay_whole(page, width):
    page.set_size(width, 800)
    view(page, "health")
    until(lambda: page.run("document.querySelectorAll('#entities tr').length") > 10)
    assert [lines(page, f"#entities td:nth-child({column})") for column in (2, 3, 4)] == [1, 1, 1]
    overflow = "(({ scrollWidth, clientWidth }) => scrollWidth - clientWidth)"
    assert page.run(f"{overflow}(document.querySelector('#health-view'))") == 0
    give_frame(page, log=[[0, NAME, "info", "Supervisors.Vehicle", "text", ""]])
    view(page, "log")
    until(lambda: page.run("document.querySelectorAll('#entries tr').length") > 0)
    assert lines(page, "#entries td") == 1
    assert lines(page, "[data-view=log]") == 1
    page.set_size(1280, 800)


def test_the_form_of_a_plan_has_the_fields_of_the_chosen_shape_below_the_button_that_draws(page):
    view(page, "plans")

    def shown():
        names = ("radius", "seconds", "spacing")
        return [name for name in names if page.run(f"document.getElementById('draw-{name}').offsetParent !== null")]

    found = {}
    for kind in ("goto", "loiter", "station_keeping", "rows"):
        set_value(page, "draw-kind", kind, "change")
        found[kind] = shown()
    turning = ["radius", "seconds"]
    assert found == {"goto": [], "loiter": turning, "station_keeping": turning, "rows": ["spacing"]}
    below = "document.getElementById('draw-toggle').compareDocumentPosition(document.getElementById('draw-form')) & 4"
    assert page.run(below)


@pytest.mark.parametrize("width", [1280, 360])
def test_plans_that_arrive_move_no_button(page, width):
    page.set_size(width, 800)
    view(page, "plans")
    place = "document.getElementById('plan-stop').getBoundingClientRect().top"
    tops = list[float]()
    running = "survey: Goto12, 40 %, 830 s left, ends at 12:01:02 UTC"
    for plans, words in ((0, ""), (1, "no plan is running"), (40, running)):
        page.run(
            f"document.getElementById('plans').replaceChildren(...Array.from({{ length: {plans} }}, (_, number) =>"
            " Object.assign(document.createElement('li'), { textContent: `plan ${number}` })));"
            f" document.getElementById('progress').textContent = '{words}'"
        )
        tops.append(page.run(place))
    assert tops[1:] == tops[:-1]
    page.run("document.getElementById('plans-refresh').click()")
    page.set_size(1280, 800)


def test_parameters_are_read_when_the_view_opens(page):
    view(page, "parameters")
    until(lambda: page.run("document.querySelectorAll('#values tr').length") > 0, PATIENCE)
    assert page.text("#values td")


def test_a_plot_shows_utc_in_any_time_zone(page):
    page.call("Emulation.setTimezoneOverride", timezoneId="Asia/Tokyo")
    view(page, "plots")
    set_value(page, "field", "EstimatedState.depth", "input")
    page.run("document.getElementById('field').focus()")
    page.key("Enter")
    legend = "#plots .u-legend tr"
    point = (
        "(() => { const box = document.querySelector('#plots .u-over'), { right, top } = box.getBoundingClientRect();"
    )
    point += " box.dispatchEvent(new MouseEvent('mousemove', { clientX: right - 2, clientY: top + 5 })); })()"
    now = "new Date(Math.round(1000 * (await import('/files/main.js')).store.now)).toISOString().slice(11, 13)"

    def shown() -> str:
        page.run(point)
        return page.text(legend)

    until(lambda: page.run("document.querySelectorAll('#plots .u-over').length"), PATIENCE)
    until(lambda: ":" in shown(), PATIENCE, told=shown)
    hour = int(page.run(f"(async () => {now})()"))
    assert shown().startswith("UTC")
    assert int(shown().removeprefix("UTC").partition(":")[0]) in ((hour - 1) % 24, hour)
    page.call("Emulation.setTimezoneOverride", timezoneId="")


PLACES = (
    "['hold', 'surface', 'abort'].map((name) => JSON.stringify(document.getElementById(name).getBoundingClientRect()))"
)


def after_frame(page, script: str, **words: object):
    """The value of a script while a frame is shown that the console has not sent."""
    frame = {"now": time.time(), "values": {}, "vehicles": {}, "gone": [], "log": [], **words}
    text = json.dumps(json.dumps(frame))
    return page.run(f"import('/files/main.js').then((page) => {{ page.receive({text}); return {script}; }})")


@pytest.mark.parametrize("width", [1280, 360])
def test_orders_stay_in_their_place_whatever_is_shown(page, width):
    page.set_size(width, 800)
    view(page, "map")
    before, another = page.run(PLACES), "another with a long name " * 4
    conflict = "another system has the same name and the same id: " * 4
    long = {
        **fake_vehicle(NAME),
        "plan": {"mode": "maneuver", "name": "a survey of the harbor " * 9, "progress": 50, "motors": "turning"},
        "system": {"name": NAME, "there": True, "battery": 77.0, "conflict": conflict},
    }
    entity = {"entity": "GPS", "state": "failure", "text": "no data " * 40, "advice": "", "since": time.time()}
    failing = {**long, "health": {"entities": [entity]}}
    lease = {NAME: {"session": "x", "user": "somebody else", "asked": "a third one", "left": 20, "by": "y"}}
    for words in ({"vehicles": {NAME: long}}, {"vehicles": {NAME: failing}}, {"leases": lease}):
        assert after_frame(page, PLACES, **words) == before
    assert "no data" in page.text("#alarm-list")
    assert after_frame(page, PLACES, vehicles={another: fake_vehicle("x" * 60)}) == before
    for name in ("hold", "surface", "abort"):
        page.press(f"#{name}")
        assert page.text(f"#{name}").endswith(": press again")
        assert page.run(PLACES) == before
        assert (
            page.run(
                f"(() => {{ const {{ scrollHeight, clientHeight }} = document.getElementById('{name}');"
                " return scrollHeight - clientHeight; })()"
            )
            <= 0
        )
    page.press("#alarms-acknowledge")
    give_frame(page, gone=[another])
    page.press("#alarms-acknowledge")
    until(lambda: page.text("#abort") == "Abort")
    page.set_size(1280, 800)


def test_a_screen_reader_gets_changes_of_state_and_no_numbers(page):
    def heard(**state: object) -> str:
        return after_frame(
            page, "document.getElementById('heard').textContent", vehicles={NAME: fake_vehicle(NAME, **state)}
        )

    assert [heard(depth=depth, speed=depth) for depth in (1.0, 2.0)] == [f"{NAME}, service"] * 2
    assert heard(time=time.time() - 60.0) == f"{NAME}, service, position old"
    often = ("#summary", "#replay-clock", "#rates-note", "#lease-left", "#forecast-age", "#fly-time")
    assert [
        page.run(f"document.querySelector('{each}:is(span):not([role], [aria-live])') !== null") for each in often
    ] == [True] * len(often)


def test_times_are_in_utc_and_say_so(page):
    page.call("Emulation.setTimezoneOverride", timezoneId="Asia/Tokyo")
    found = after_frame(page, "document.getElementById('clock').textContent", now=3600.0 * 10 + 61)
    page.call("Emulation.setTimezoneOverride", timezoneId="")
    assert found == "10:01:01 UTC"


@pytest.mark.parametrize("width", [1280, 360])
def test_the_stick_covers_no_words(page, width):
    page.set_size(width, 800)
    view(page, "steer")
    bottom = page.run(
        "(() => { const range = document.createRange(), box = document.querySelector('#steer-pad span');"
        " range.selectNodeContents(box);"
        " return range.getBoundingClientRect().bottom; })()"
    )
    assert bottom <= page.run("document.getElementById('steer-stick').getBoundingClientRect().top")
    page.set_size(1280, 800)


def test_a_log_shows_the_vehicle_that_wrote_it_and_not_the_first_by_name(page):
    replay = {"owner": "writer", "start": 0.0, "duration": 9.0, "position": 0.0, "speed": 1.0, "playing": False}
    around = {name: fake_vehicle(name) for name in ("another", "writer")}
    give_frame(page, vehicles=around, replay={**replay, "notice": "", "resume": False}, gone=[NAME])
    assert known(page, "store.chosen") == "writer"
    page.open("about:blank")


def test_it_has_no_errors(page):
    assert not [each for each in page.errors if "401" not in each]
