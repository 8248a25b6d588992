"""The HTML page of a log: complete, self-contained, and safe for any log."""

import math
import re
from html.parser import HTMLParser
from pathlib import Path

import numpy as np
import pytest

import imc
from runtime.logs import summarize
from shoal.logs.inspect import render_comparison, render_report
from shoal.logs.inspect.field_plot import FieldPlot, join_plots
from shoal.logs.inspect.report_data import read_report_data
from shoal.logs.inspect.time_plot import Curve, decimate, ticks
from tests.log_messages import at, labels

LOGS = Path(__file__).parents[3] / "data" / "logs"
HOSTILE = "</script><script>alert(1)</script><img src=x onerror=alert(1)>\"'&\u202e\x00\x1b[2J\udcff]]>"


class Page(HTMLParser):
    """Tags with their attributes, and the text."""

    def __init__(self, text):
        super().__init__()
        self.tags, self.words = [], []
        self.feed(text)

    def handle_starttag(self, tag, attrs):
        self.tags.append((tag, dict(attrs)))

    def handle_data(self, data):
        self.words.append(data)


def mission():
    """A dive with a plan, detections, and trouble."""
    for n in range(1200):
        t = n / 10
        depth = min(5.0, t / 10)
        yield at(
            t, imc.EstimatedState, lat=0.7, lon=-0.15, x=t, y=5 * math.sin(t / 10), z=depth, depth=depth, alt=9 - depth
        )
        if n % 10 == 0:
            state = imc.EntityState.State.NORMAL if not 400 < n < 600 else imc.EntityState.State.ERROR
            yield at(t, imc.EntityState, state=state, description="no echo", src_ent=8)
            yield at(
                t, imc.PlanControlState, state=3, plan_id="survey", man_id=f"Goto{n // 400}", plan_progress=t / 1.2
            )
            yield at(t, imc.VehicleState, op_mode=3)
        if n % 100 == 0:
            yield at(t, imc.EstimatedMugState, id=4, x=1.0, y=2.0)
    yield at(60, imc.LogBookEntry, type=2, context="Sensors.DVL", text="no bottom lock")
    yield at(61, imc.LogBookEntry, type=1, context="Sensors.DVL", text="weak echo")


def test_all_parts_of_a_mission(make_log):
    log = imc.Log(make_log([*labels(DVL=8), *mission()]))
    text = render_report(log)
    heads = re.findall(r"<h2>(.*?)</h2>", text)
    assert heads == [
        "Track over ground",
        "Depth and seabed, m",
        "Altitude above the seabed, m",
        "Roll and pitch, °",
        "Heading, °",
        "Speed over ground, m/s",
        "Plan progress, %",
        "Plan and mode",
        "Entity states",
        "MUG detections",
        "Errors and warnings of the log book",
        "Messages",
    ]
    for word in ("lauv-noptilus-1", "MUG 4", "no bottom lock", "weak echo", "Goto2", "DVL", "EstimatedState", "start"):
        assert word in text
    assert len(text) < 300_000


def test_what_flies_has_an_altitude_and_no_depth(make_log):
    flight = [at(n / 10, imc.EstimatedState, lat=0.7, x=float(n), alt=n / 20, depth=-1.0) for n in range(600)]
    text = render_report(imc.Log(make_log(flight)))
    assert "greatest altitude" in text
    assert "greatest depth" not in text
    heads = re.findall(r"<h2>(.*?)</h2>", text)
    assert heads[:3] == ["Track over ground", "Altitude, m", "Roll and pitch, °"]


@pytest.mark.parametrize(("altitude", "drawn"), [(12.0, ["Altitude above the seabed, m"]), (-1.0, [])])
def test_what_stays_at_the_surface_has_no_depth(make_log, altitude, drawn):
    voyage = [at(n / 10, imc.EstimatedState, lat=0.7, x=float(n), depth=0.0, alt=altitude) for n in range(600)]
    text = render_report(imc.Log(make_log(voyage)))
    assert "greatest" not in text
    heads = re.findall(r"<h2>(.*?)</h2>", text)
    assert heads[: 2 + len(drawn)] == ["Track over ground", *drawn, "Roll and pitch, °"]


def test_states_without_a_position_are_not_in_the_track(make_log):
    unknown = [at(n / 10, imc.EstimatedState, depth=0.0) for n in range(50)]
    voyage = [at(5 + n / 10, imc.EstimatedState, lat=0.7, x=float(n)) for n in range(50)]
    log = imc.Log(make_log([*unknown, *voyage]))
    story = read_report_data(log, summarize(log))
    assert story.origin == (0.7, 0.0)
    assert story.distance == pytest.approx(49.0)


def test_what_the_story_holds(make_log):
    log = imc.Log(make_log([*labels(DVL=8), *mission()]))
    story = read_report_data(log, summarize(log))
    assert story.origin == (0.7, -0.15)
    assert story.motion.north[-1] == pytest.approx(119.9)
    assert story.distance == pytest.approx(122.0, rel=0.05)
    assert np.nanmax(story.motion.depth) == 5.0
    assert [(s.value, round(s.begin), round(s.end)) for s in story.entities["DVL"]] == [
        ("NORMAL", 0, 41),
        ("ERROR", 41, 60),
        ("NORMAL", 60, 120),
    ]
    assert [stretch.value for stretch in story.maneuvers] == ["Goto0", "Goto1", "Goto2"]
    assert story.detections.north[0] == pytest.approx(1.0)
    assert story.detections.north[-1] == pytest.approx(111.0)
    assert (story.levels["ERROR"], story.levels["WARNING"]) == (1, 1)


def test_the_page_needs_no_other_file_and_no_host():
    text = render_report(imc.Log(LOGS / "dune-idle"))
    page = Page(text)
    assert not re.search(r"https?://(?!www\.w3\.org/2000/svg)|@import|url\(", text)
    attributes = [name for _, attrs in page.tags for name in attrs]
    assert not {"src", "href", "srcset", "action", "xlink:href"} & set(attributes)
    policies = [attrs["content"] for tag, attrs in page.tags if attrs.get("http-equiv")]
    assert len(policies) == 1
    assert policies[0].startswith("default-src 'none'")
    assert "script-src 'sha256-" in policies[0]


def hostile_log():
    text = HOSTILE
    yield at(0, imc.Announce, sys_name=text)
    yield from (at(0, imc.EntityInfo, label=text + str(n), src_ent=n, id=n) for n in (7, 8))
    for n in range(20):
        yield at(n, imc.EstimatedState, lat=0.7, lon=0.1, depth=(math.nan, math.inf, 1e30, -5.0)[n % 4], x=float(n))
        yield at(n, imc.EntityState, state=(1, 4, 77)[n % 3], description=text, src_ent=8)
        yield at(n, imc.LogBookEntry, type=n % 9, context=text, text=text * 3)
        yield at(n, imc.PlanControlState, state=3, plan_id=text, man_id=text, plan_progress=math.inf)
        yield at(n, imc.VehicleState, op_mode=200, last_error=text)
        yield at(n, imc.EstimatedMugState, id=-n, x=math.nan, y=1.0)
        yield at(n, imc.EstimatedMugState, id=n, x=1e30, y=-1e30)


def test_hostile_text_and_numbers_are_only_shown(make_log):
    page = Page(render_report(imc.Log(make_log(hostile_log()))))
    assert [tag for tag, _ in page.tags].count("script") == 1
    assert "img" not in [tag for tag, _ in page.tags]
    assert not [name for _, attrs in page.tags for name in attrs if name.startswith("on")]
    shown = "".join(page.words)
    assert "<img src=x onerror=alert(1)>" in shown
    assert not {"\u202e", "\x00", "\x1b", "\udcff"} & set(shown)


@pytest.mark.parametrize("kinds", [(), (imc.EstimatedState,), (imc.EntityState,), (imc.PlanControlState,)])
def test_logs_that_lack_most(make_log, kinds):
    text = render_report(imc.Log(make_log([at(0), *(at(1, kind) for kind in kinds)])))
    assert "Track over ground" in text


def test_a_state_beyond_the_pole_or_without_a_place_is_left_out(make_log):
    states = [(math.nan, 0.0), (9.0, 0.0), (0.7, math.inf)]
    log = imc.Log(make_log(at(n, imc.EstimatedState, lat=lat, lon=lon) for n, (lat, lon) in enumerate(states)))
    assert read_report_data(log, summarize(log)).origin is None


@pytest.mark.heavy
def test_a_page_stays_small_whatever_the_log_says(make_log):
    def flood():
        for n in range(6000):
            yield at(n / 50, imc.EntityState, state=n % 5, description=f"{n} " + "x" * 500)
            yield at(n / 50, imc.LogBookEntry, type=2, context="y" * 3000, text="z" * 3000)
            yield at(n / 50, imc.EstimatedState, lat=0.7, x=math.sin(n) * 100, y=math.cos(n * 1.1) * 100, depth=n % 7)

    assert len(render_report(imc.Log(make_log(flood())))) < 1_000_000


def test_an_empty_log_has_no_page(make_log):
    with pytest.raises(ValueError, match="no message"):
        render_report(imc.Log(make_log([])))


def test_decimation_keeps_the_extremes():
    time = np.linspace(0.0, 100.0, 100_000)
    value = np.sin(time) + np.where(np.arange(100_000) == 54_321, 50.0, 0.0)
    value[7] = math.nan
    kept, heights = decimate(time, value)
    assert len(kept) <= 1402
    assert heights.max() == np.nanmax(value)
    assert heights.min() == np.nanmin(value)
    assert (np.diff(kept) > 0).all()
    assert (kept[0], kept[-1]) == (0.0, 100.0)


@pytest.mark.parametrize(("low", "high"), [(0.0, 1.0), (-7.3, 1234.0), (1e-9, 2e-9), (-1e30, 1e30), (5.0, 5.0)])
def test_ticks_are_round_and_few(low, high):
    found = ticks(low, high, 5)
    assert 1 <= len(found) <= 12
    assert all(low <= at <= high for at in found)


def with_temperatures(folder, name, offset):
    path = folder / name / "Data.lsf"
    path.parent.mkdir()
    messages = [*labels(CTD=7, Sonde=8), *mission()]
    for n in range(120):
        messages.append(at(n, imc.Temperature, value=15 + offset + n / 100))
        messages.append(at(n, imc.Temperature, value=4 + offset, src_ent=8))
        messages.append(at(n, imc.FuelLevel, value=90 - n / 10))
    path.write_bytes(b"".join(imc.encode(message) for message in messages))
    return imc.Log(path)


def curves(text):
    """The names of the curves of each figure, by its title."""
    found = {}
    for figure in re.findall(r"<figure>(.*?)</figure>", text, re.DOTALL):
        found[re.search(r"<h2>(.*?)</h2>", figure)[1]] = re.findall(r'class="curve \w+" data-name="(.*?)"', figure)
    return found


def test_a_chosen_field_is_drawn_by_entity_and_the_battery_always(tmp_path):
    log = with_temperatures(tmp_path, "a", 0.0)
    found = curves(render_report(log, fields=["Temperature.value", "EstimatedState.psi"]))
    assert found["Temperature.value, °C"] == ["CTD", "Sonde"]
    assert "FuelLevel.value, %" in found
    assert "EstimatedState.psi, °" in found
    assert curves(render_report(log, fields=["Temperature.value:Sonde"]))["Temperature.value, °C"] == ["Sonde"]


@pytest.mark.parametrize(
    ("field", "words"),
    [
        ("Temperatur.value", "there is no message 'Temperatur'; did you mean 'Temperature'"),
        ("Temperature.valu", "Temperature has no field 'valu'; did you mean 'value'"),
        ("Temperature.value:CDT", "no Temperature is from 'CDT'"),
        ("Temperature", r"expected Message\.field"),
        ("EntityInfo.label", "is not a number"),
        ("Salinity.value", "there is no Salinity of this vehicle"),
    ],
)
def test_a_field_that_is_not_there_is_named_with_the_nearest(tmp_path, field, words):
    with pytest.raises(ValueError, match=words):
        render_report(with_temperatures(tmp_path, "a", 0.0), fields=[field])


def test_a_plot_says_how_many_of_its_curves_it_shows():
    line = np.array([0.0, 1.0])
    plots = [FieldPlot("Temperature.value, °C", [Curve(name, "a", line, line, "°C", 1) for name in "pqrs"])]
    (joined,) = join_plots([("A", plots), ("B", plots)])
    assert joined.title == "Temperature.value, °C (6 of 8 curves)"
    assert [curve.name for curve in joined.curves] == ["A p", "A q", "A r", "A s", "B p", "B q"]
    assert len({curve.color for curve in joined.curves}) == 6


def test_two_runs_are_drawn_over_each_other(tmp_path):
    logs = [with_temperatures(tmp_path, name, offset) for name, offset in (("a", 0.0), ("b", 2.0))]
    text = render_comparison(logs, ["Temperature.value:CTD"])
    found = curves(text)
    assert found["Temperature.value, °C"] == ["A CTD", "B CTD"]
    assert found["Depth, m"] == ["A", "B"]
    page = Page(text)
    tracks = [attrs for tag, attrs in page.tags if tag == "path" and attrs.get("class", "").startswith("track")]
    assert [attrs["class"] for attrs in tracks] == ["track a", "track b"]
    assert {"duration", "over ground", "greatest depth"} <= set(page.words)
