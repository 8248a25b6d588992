"""Checks, parameters, rates, layouts, logs and alarms on the page of a vehicle in a real browser."""

import json
import re
import time

import pytest

from tests.outside import until
from tests.shoal.console.browser import browser
from tests.shoal.console.logs.test_log_in_browser import set_value
from tests.shoal.console.operator_page import vehicle_page
from tests.shoal.console.test_in_browser import fake_vehicle, give_frame, view

NAME = "lauv-noptilus-1"
PANELS = """panels:
- title: <img src=x>
  values: [{label: Depth, field: EstimatedState.depth, digits: 1}, {field: "Temperature.value:Nobody"}]
  plots: [EstimatedState.depth]
  buttons: [{label: Note, message: {abbrev: LogBookEntry, type: INFO, context: panel, text: pressed}}]
- {title: Other, vehicle: another, values: [{field: EstimatedState.phi}]}
"""
PATIENCE = 60.0  # s, on a busy computer
TONES = """window.tones = 0; const start = OscillatorNode.prototype.start;
OscillatorNode.prototype.start = function (...words) { window.tones += 1; return start.apply(this, words); };"""
pytestmark = pytest.mark.browser


@pytest.fixture(scope="module")
def page(tmp_path_factory):
    folder = tmp_path_factory.mktemp("vehicle")
    (folder / "panels.yaml").write_text(PANELS)
    settings = ("Simulators.DepthSensor:Standard Deviation=0.02", "Transports.Console:Panels=panels.yaml")
    with (
        vehicle_page(folder, *(word for setting in settings for word in ("--set", setting))) as vehicle,
        browser(tmp_path_factory.mktemp("browser")) as found,
    ):
        found.set_size(1280, 800)
        found.open(vehicle.link)
        until(lambda: "service" in found.text("#summary"), PATIENCE, told=lambda: found.text("#summary"))
        found.folder = folder
        yield found


def result(page, words: str) -> None:
    until(lambda: words in page.text("#result"), PATIENCE, told=lambda: page.text("#result"))


def row(page, name: str) -> str:
    """The text of a line of the parameters."""
    return page.run(
        f"[...document.querySelectorAll('#values tr')].find((row) => row.textContent.startsWith('{name}'))?.textContent"
    )


def press_in(page, selector: str, words: str) -> None:
    """Press the button with some words in it."""
    page.run(
        f"[...document.querySelectorAll({json.dumps(selector)})].find((each) => each.textContent === '{words}').click()"
    )


def change_deviation(page, value: str) -> None:
    page.run(  # at once: the table is drawn anew when an answer comes
        "(() => { const row = [...document.querySelectorAll('#values tr')]"
        ".find((each) => each.textContent.startsWith('Standard Deviation'));"
        f" row.querySelector('input').value = '{value}'; row.querySelector('button').click(); }})()"
    )


def test_checks_are_colored_in_words_and_a_vehicle_without_a_plan_is_not_ready(page):
    view(page, "checks")
    until(lambda: "NOT READY: " in page.text("#check-result"), PATIENCE, told=lambda: page.text("#check-result"))
    text = page.text("#checks")
    for words in ("✗ not readyPlannone is storedPlanDB", "✓ in orderModeservice", "sensors are dry", "HDOP"):
        assert words in text, text
    assert "! lookFree diskunknown: nothing was received" in text  # the task that reports it is off
    assert page.run("document.querySelectorAll('#checks tr').length") == 12


def test_a_parameter_shows_its_origin_and_is_set_saved_and_undone(page):
    view(page, "parameters")
    until(lambda: "Depth Sensor" in page.text("#entity"), PATIENCE)
    set_value(page, "entity", "Depth Sensor", "change")
    until(lambda: "Setfrom the command line" in (row(page, "Standard Deviation") or ""), PATIENCE)
    known = row(page, "Standard Deviation")
    assert "Standard deviation of the noise." in known
    assert "real; at least 0; default 0.05" in known
    assert re.search(r"set only before the start.*from \S*simulation.ini:\d+", row(page, "Entity Label"))
    change_deviation(page, "-1")
    result(page, "NOT OBEYED: Depth Sensor: Standard Deviation = '-1'")
    until(lambda: "Setfrom the command line" in (row(page, "Standard Deviation") or ""), PATIENCE)
    change_deviation(page, "0.03")
    changed = "set since the start, when it was 0.02 from the command line"
    until(lambda: changed in (row(page, "Standard Deviation") or ""), PATIENCE)
    page.press("#values-save")
    until(lambda: "saved for the next start: 0.03" in (row(page, "Standard Deviation") or ""), PATIENCE)
    assert "local: Depth Sensor: Standard Deviation 0.02 → 0.03" in page.text("#changes")
    press_in(page, "#changes button", "Undo")
    until(lambda: "(undone by local)" in page.text("#changes"), PATIENCE)
    until(lambda: "Setfrom the command line" in (row(page, "Standard Deviation") or ""), PATIENCE)
    view(page, "log")
    until(lambda: "local: undo Depth Sensor: Standard Deviation = 0.02" in page.text("#entries"), PATIENCE)


def test_a_disk_that_takes_no_parameters_is_named(page):
    saved = page.folder / "db" / f"{NAME}-saved.ini"
    saved.unlink()
    saved.mkdir()
    view(page, "parameters")
    page.press("#values-save")
    result(page, "NOT OBEYED: parameters of Depth Sensor not saved: ")
    until(lambda: "commandline" in "".join((row(page, "Standard Deviation") or "").split()), PATIENCE)
    until(lambda: "saved for the next start" not in page.text("#values"), PATIENCE)


def test_rates_are_counted_while_the_table_is_open(page):
    view(page, "plots")
    page.press("#rates-box summary")
    set_value(page, "rates-filter", "Depth Sensor", "input")

    def rows():
        return page.run("[...document.querySelectorAll('#rates tr')].map((each) => each.innerText.split('\\t'))")

    until(lambda: rows() and float(rows()[0][3]) == pytest.approx(10.0, abs=1.5), PATIENCE, told=rows)
    assert rows()[0][:2] == ["Depth", "Depth Sensor"]
    page.press("#rates-box summary")


def test_a_layout_is_saved_opened_and_imported_and_a_hostile_file_changes_nothing(page):
    view(page, "plots")
    until(lambda: page.run("document.querySelectorAll('#fields option').length") > 1000, PATIENCE)
    for field in ("EstimatedState.depth", "Temperature.value:Depth Sensor"):
        set_value(page, "field", field)
        page.press("#field-add")
    until(lambda: page.run("document.querySelectorAll('#plots canvas').length") == 2, PATIENCE)
    set_value(page, "plot-window", "60", "change")
    page.press("#layout-box summary")
    set_value(page, "layout-name", "__proto__")
    page.press("#layout-save")
    result(page, "layout __proto__ is saved in this browser")
    import_file(page, {"two": {"fields": ["EstimatedState.phi", "<img src=x>", 7, "No.such"], "window": "x"}})
    result(page, "layouts: two")
    assert page.run("document.getElementById('layouts').options.length") == 2
    for content in ("no JSON", [], {"": {"fields": []}}, {"x" * 61: {"fields": []}}, {"x": {"fields": "y"}}, None):
        import_file(page, content)
        result(page, "is not imported: ")
        page.run("document.getElementById('result').textContent = ''")
    assert page.run("document.getElementById('layouts').options.length") == 2
    set_value(page, "layouts", "two")
    page.press("#layout-open")
    result(page, 'there is no field "No.such"')
    assert page.run("document.querySelectorAll('#plots canvas').length") == 1
    set_value(page, "layouts", "__proto__")
    page.press("#layout-open")
    until(lambda: page.run("document.querySelectorAll('#plots canvas').length") == 2, PATIENCE)
    assert page.run("document.getElementById('plot-window').value") == "60"
    assert page.run("document.querySelectorAll('img[src=x]').length") == 0


def import_file(page, content) -> None:
    text = content if isinstance(content, str) else json.dumps(content)
    page.run(
        f"(() => {{ const files = new DataTransfer(); files.items.add(new File([{json.dumps(text)}], 'layouts.json'));"
        " const input = document.getElementById('layout-import'); input.files = files.files;"
        " input.dispatchEvent(new Event('change')); })()"
    )


def test_a_layout_that_the_browser_cannot_keep_is_an_error(page):
    page.run("Storage.prototype.setItem = () => { throw new Error('the quota has been exceeded'); }")
    set_value(page, "layout-name", "another")
    page.press("#layout-save")
    result(page, "the layout is not saved: the quota has been exceeded")


def test_logs_are_listed_and_their_report_opens_apart_from_the_page(page):
    view(page, "logs")
    until(lambda: page.run("document.querySelectorAll('#logs li').length") == 1, PATIENCE)
    assert "lauv-noptilus-1, " in page.text("#logs")
    press_in(page, "#logs button", "Report")
    until(lambda: "Open the report of" in page.text("#logs-note"), PATIENCE, told=lambda: page.text("#logs-note"))
    address = page.run("document.querySelector('#logs-note a').href")
    policy = page.run(f"fetch({json.dumps(address)}).then((answer) => answer.headers.get('content-security-policy'))")
    assert policy.startswith("sandbox allow-scripts; default-src 'none'; ")
    size = page.run(
        "fetch(document.querySelector('#logs a[href*=\"Data.lsf\"]').href).then((answer) => answer.blob())"
        ".then((blob) => blob.size)"
    )
    assert size > 10_000


def test_what_becomes_worse_is_shown_until_it_is_acknowledged_and_sounds_once_it_may(page):
    page.run(TONES)
    name, now = "alarming", time.time()

    def give(state, text="", mode="service", **words):
        entities = [{"entity": "<img src=x>", "state": state, "text": text, "advice": "look", "since": now}]
        vehicle = fake_vehicle(name)
        vehicle["health"], vehicle["plan"]["mode"] = {"entities": entities}, mode
        give_frame(page, vehicles={name: vehicle}, **words)

    give("error")  # when the page sees it first, it has not become worse
    assert name not in page.text("#alarm-list")
    give("normal")
    give("fault", "a little")
    assert "alarming: <img src=x>: fault: a little" in page.text("#alarm-list")
    assert page.run("window.tones") == 0
    page.press("#sound")
    until(lambda: page.run("window.tones") == 3, told=lambda: page.run("window.tones"))
    assert page.text("#sound") == "Sound is on"
    give("failure", "worse", mode="error")
    text = page.text("#alarm-list")
    assert "failure: worse" in text
    assert "mode error: aborted" in text

    def sounds_again() -> bool:
        give("normal")
        give("failure", "worse")
        return page.run("window.tones") == 6

    until(sounds_again, told=lambda: f"{page.run('window.tones')} tones; {page.text('#alarm-list')}")
    assert re.search(r"failure: worse \(\d+ times\)", page.text("#alarm-list"))
    page.press("#alarms-acknowledge")
    assert page.run("document.getElementById('alarms').hidden")
    give_frame(page, gone=[name])
    assert "alarming: LOST" in page.text("#alarm-list")
    page.press("#alarms-acknowledge")
    page.press("#sound")
    assert page.run("document.querySelectorAll('img[src=x]').length") == 0


def test_an_entity_that_is_not_in_order_has_advice_and_its_lines_of_the_log_book(page):
    name = "alarming"
    vehicle = fake_vehicle(name)
    entity = {"entity": "GPS", "state": "error", "text": "GPS is missing", "advice": "free sky", "since": time.time()}
    vehicle["health"] = {"entities": [entity]}
    lines = [[0, name, "error", "x", "antenna is open", "GPS"], [0, "other", "error", "x", "not this one", "GPS"]]
    give_frame(page, vehicles={name: vehicle}, log=lines)
    choose_at_once(page, name)
    view(page, "health")
    assert page.text("#entities td:nth-child(3)") == "GPS is missingfree sky00:00:00 antenna is open"
    give_frame(page, gone=[name])
    page.press("#alarms-acknowledge")
    choose_at_once(page, NAME)


def choose_at_once(page, name: str) -> None:
    """Choose a vehicle between two frames: each restores the choice."""
    page.run(
        f"(() => {{ const list = document.getElementById('vehicle'); list.value = {json.dumps(name)};"
        " list.dispatchEvent(new Event('change')); })()"
    )


def test_a_panel_has_values_plots_and_a_button_that_is_pressed_twice(page):
    view(page, "panels")
    value = "#panels-view tr:first-child td:last-child"
    until(lambda: page.text(value).endswith(" m"), PATIENCE, told=lambda: page.text("#panels-view"))
    assert abs(float(page.text(value).split()[0])) < 1.0
    assert page.text("#panels-view tr:last-child td:last-child") == "unknown"
    assert page.text("#panels-view h2") == "<img src=x>"
    assert page.run("document.querySelectorAll('#panels-view h2').length") == 1
    page.press("#panels-view .panel-buttons button")
    assert page.text("#panels-view .panel-buttons button") == "Note: press again"
    page.press("#panels-view .panel-buttons button")
    result(page, "Note: LogBookEntry was sent")
    press_in(page, "#panels-view button", "Plots")
    until(lambda: page.run("document.querySelectorAll('#plots canvas').length") == 1, PATIENCE)
    view(page, "log")
    until(lambda: f"local: press <img src=x>: Note{NAME} · Transports.Console" in page.text("#entries"), PATIENCE)
    assert page.run("document.querySelectorAll('img[src=x]').length") == 0


@pytest.mark.parametrize("name", ["checks", "parameters", "plots", "logs", "panels"])
def test_each_view_fits_a_narrow_screen(page, name):
    page.set_size(360, 640)
    view(page, name)
    assert page.run("document.documentElement.scrollWidth") <= 360
    page.set_size(1280, 800)


def test_it_has_no_errors(page):
    assert page.errors == []


def test_the_report_is_drawn_and_reaches_neither_the_page_nor_its_login(page):
    """It leaves the page, and is the last one."""
    view(page, "logs")
    until(lambda: "Open the report" in page.text("#logs"), PATIENCE)  # also after the list was read anew
    page.open(page.run("document.querySelector('#logs a[target]').href"))
    assert page.text("h1") == NAME
    assert page.run("document.querySelectorAll('svg').length") > 0
    assert page.run("window.origin") == "null"
    assert page.errors == []
    cookies = page.run("(() => { try { return document.cookie } catch (error) { return String(error) } })()")
    assert "SecurityError" in cookies
    assert "Failed to fetch" in page.run("fetch('/api/me').then((answer) => answer.text()).catch(String)")
