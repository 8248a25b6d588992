"""Panels of the user: mistakes are named with their line, and a button sends its message by role and lease only."""

import json
import os
import time
from types import SimpleNamespace

import pytest
from click.testing import CliRunner

import imc
from shoal.cli.console import console
from shoal.console import PageSecurity, Role, Users
from shoal.console.panels.user_panels import MOST_VALUES, PanelFileError, read_panels
from shoal.console.vehicle_page import panels_of
from tests.shoal.console.foxglove.packet_radio import Radio
from tests.shoal.console.page_of_nobody import served_page

NAME = "lauv-noptilus-1"
PASSWORD = "correct horse"
LIGHT = "{abbrev: SetLedBrightness, name: front, value: 100}"
FILE = f"""panels:
- title: Light
  values: [{{label: Depth, field: EstimatedState.depth, digits: 1}}]
  plots: ["Temperature.value:CTD"]
  buttons:
  - {{label: On, message: {LIGHT}}}
  - {{label: Slow, message: {{abbrev: SetEntityParameters, name: GPS}}}}
- title: Of another
  vehicle: another
  buttons: [{{label: On, message: {LIGHT}}}]
"""


def read(folder, text):
    (folder / "panels.yaml").write_text(text)
    return read_panels(folder / "panels.yaml")


def test_values_have_the_unit_of_their_field_and_messages_names_of_values(tmp_path):
    panel, other = read(tmp_path, FILE)
    (value,) = panel.values
    assert (value.label, value.field, value.unit, value.digits) == ("Depth", "EstimatedState.depth", "m", 1)
    assert panel.plots == ("Temperature.value:CTD",)
    assert [(each.label, each.order) for each in panel.buttons] == [("On", "press"), ("Slow", "press-maintain")]
    assert panel.buttons[0].message == imc.SetLedBrightness(name="front", value=100)
    assert other.vehicle == "another"


@pytest.mark.parametrize(
    ("text", "words"),
    [
        ("panels: 3", "1: expected a list"),
        ("x: []", "1: "),
        ("panels:\n- {titel: x}", "2: "),
        ("panels:\n- title: ''", "2: a name has 1 to 60 characters"),
        ("panels:\n- title: a\n- title: a", "3: there is a panel 'a' already"),
        ("panels:\n- title: a\n  values:\n  - {field: EstimatedStat.depth}", "4: there is no message 'EstimatedStat'"),
        ("panels:\n- title: a\n  values:\n  - {field: EstimatedState.dept}", "4: EstimatedState has no number 'dept'"),
        ("panels:\n- title: a\n  plots: [Announce.sys_name]", "3: Announce has no number 'sys_name'"),
        ("panels:\n- title: a\n  values:\n  - {field: EstimatedState.x, digits: 10}", "4: digits are 0 to 9"),
        ("panels:\n- title: a\n  buttons:\n  - {label: x, message: {abbrev: Nope}}", "4: "),
        ("panels:\n- title: a\n  buttons:\n  - {label: x, message: {name: x}}", "4: "),
        ("panels:\n- title: a\n  buttons:\n  - {label: x, message: {abbrev: Abort, y: 1}}", "4: "),
        ("panels:\n- title: a\n  buttons:\n  - {label: x, message: {abbrev: SetLedBrightness, value: 300}}", "4: "),
        ("panels:\n- title: a\n  buttons: [{label: x, message: {abbrev: Abort}}, {label: x, message: "
         "{abbrev: Abort}}]", "3: two buttons have one label"),
        ("panels: !!python/object:os.system x", "1: "),
        ("panels: [", ""),
    ],
)  # fmt: skip
def test_a_mistake_is_named_with_its_line(tmp_path, text, words):
    with pytest.raises(PanelFileError, match=r"panels\.yaml") as found:
        read(tmp_path, text)
    assert f"panels.yaml:{words}" in str(found.value)


def test_there_are_only_as_many_values_as_a_page_draws(tmp_path):
    values = ", ".join(["{field: EstimatedState.x}"] * (MOST_VALUES // 2 + 1))
    with pytest.raises(PanelFileError, match="at most 24 values"):
        read(tmp_path, f"panels:\n- title: a\n  values: [{values}]\n- title: b\n  values: [{values}]")


class Transmitter(Radio):
    """A radio that keeps what is sent."""

    fragment_size = 0

    def __init__(self):
        self.sent = []

    def send(self, system, message, packet):
        self.sent.append(message)


@pytest.fixture
def page(tmp_path):
    users = Users(tmp_path / "access")
    for name, role in (("wanda", Role.WATCH), ("anna", Role.OPERATE), ("mia", Role.MAINTAIN)):
        users.add(name, role, PASSWORD)
    radio, panels = Transmitter(), read(tmp_path, FILE)
    with served_page(radio, panels=panels, security=PageSecurity(users=users), log_root=tmp_path) as found:
        radio.bring(imc.Heartbeat(timestamp=time.time(), src=0x1A))
        found.sent = lambda: [each for each in radio.sent if type(each).__name__.startswith("Set")]
        found.notes = lambda: [each.text for each in radio.sent if isinstance(each, imc.LogBookEntry)]
        yield found


def press(page, button, order="press", panel="Light", vehicle=NAME):
    words = {"vehicle": vehicle, "order": order, "panel": panel, "button": button}
    return json.loads(page.request("POST", "/api/order", words)[1])


def test_a_button_needs_its_role_and_the_lease_and_is_in_the_log_book(page):
    page.log_in(user="wanda", password=PASSWORD)
    assert press(page, "On")["text"] == "wanda may watch: this needs the role operate"
    page.log_in(user="anna", password=PASSWORD)
    assert press(page, "Slow", "press-maintain")["text"] == "anna may operate: this needs the role maintain"
    assert not press(page, "Slow", "press")["ok"]  # under the order of another button
    assert page.sent() == []
    assert press(page, "On")["text"].startswith("On: SetLedBrightness was sent; ")
    assert [(type(each).__name__, each.value) for each in page.sent()] == [("SetLedBrightness", 100)]
    assert "anna: press Light: On" in page.notes()
    page.log_in(user="mia", password=PASSWORD)
    assert press(page, "Slow", "press-maintain")["text"] == "anna commands this vehicle: take the lease first"


@pytest.mark.parametrize(
    "words",
    [
        {"button": "Nope"},
        {"button": "On", "panel": "Of another"},
        {"button": None},
        {"button": ["On"]},
        {"button": "On", "order": "press-x"},
        {"button": "On", "order": "pressure"},
    ],
)
def test_what_is_no_button_of_this_vehicle_sends_nothing(page, words):
    page.log_in(user="mia", password=PASSWORD)
    assert not press(page, **words)["ok"]
    assert page.sent() == []


def test_a_vehicle_whose_file_of_panels_is_wrong_serves_its_page_without_and_a_console_ends(tmp_path):
    (tmp_path / "panels.yaml").write_text("panels: 3")
    logged = []
    for name, words in (("panels.yaml", "panels.yaml:1: expected a list"), ("none.yaml", "No such file")):
        task = SimpleNamespace(panels=str(tmp_path / name), log=SimpleNamespace(warning=logged.append))
        task.vehicle = SimpleNamespace(bus=SimpleNamespace(messages=imc.builtin()))
        assert panels_of(task) == ()
        assert words in logged[-1]
    result = CliRunner().invoke(console, ["--panels", str(tmp_path / "panels.yaml")])
    assert (result.exit_code, "panels.yaml:1: expected a list" in result.output) == (1, True)


def test_a_vehicle_does_not_wait_for_a_pipe_in_place_of_its_panels(tmp_path):
    os.mkfifo(tmp_path / "panels.yaml")
    warnings = []
    task = SimpleNamespace(panels=str(tmp_path / "panels.yaml"), log=SimpleNamespace(warning=warnings.append))
    task.vehicle = SimpleNamespace(bus=SimpleNamespace(messages=imc.builtin()))
    assert panels_of(task) == ()
    assert warnings == [f"there are no panels on the page: {tmp_path}/panels.yaml: not a regular file"]
