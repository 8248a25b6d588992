"""`shoal console LOG`: a log is played, nothing in it is commanded, and its run is resumed."""

import asyncio
import json
import time
from pathlib import Path
from urllib.parse import quote

import pytest

import imc
from shoal.console.logs.replay_answers import WORKER
from shoal.console.page_job import PageJob
from tests.outside import TOO_LARGE, largest_file, until
from tests.shoal.console.logs.logged_run import SECONDS, record_run
from tests.shoal.console.operator_page import OperatorPage, operator_page

NAME = "lauv-noptilus-1"
pytestmark = pytest.mark.heavy


@pytest.fixture(scope="module")
def logs(tmp_path_factory):
    return record_run(tmp_path_factory.mktemp("run"))


@pytest.fixture(scope="module")
def page(logs, tmp_path_factory):
    with operator_page(str(logs[1]), "--log-dir", str(tmp_path_factory.mktemp("resumed"))) as found:
        found.log_in()
        yield found


def post(page: OperatorPage, address: str, **words: object) -> dict:
    status, content, _ = page.request("POST", address, words)
    assert status == 200, content
    return json.loads(content)


def series(page: OperatorPage, path: str) -> dict:
    return page.get(f"/api/series?path={quote(path)}")


def frame(page: OperatorPage) -> dict:
    with page.frames() as frames:
        return json.loads(frames.recv(10))


def test_a_jump_shows_the_state_of_that_time_at_once(page):
    for position in (30.0, 2.0, 17.5):
        began = time.monotonic()
        answer = post(page, "/api/replay", position=position)
        assert time.monotonic() - began < 2.0
        assert (answer["ok"], answer["position"], answer["playing"]) == (True, position, False)
        shown = frame(page)
        state = shown["vehicles"][NAME]["state"]
        assert shown["now"] == pytest.approx(answer["start"] + position, abs=0.02)
        assert state["time"] == pytest.approx(shown["now"], abs=0.2)
        assert shown["vehicles"][NAME]["plan"]["name"] == "dive"
        assert shown["replay"]["notice"] == "this is 1 of 2 logs of its run: --run plays all of them"
        assert len(shown["vehicles"][NAME]["health"]["entities"]) > 40
    assert state["depth"] == pytest.approx(1.8, abs=0.3)
    assert len(shown["tracks"][NAME]) > 30


def test_it_plays_pauses_and_stops_at_the_end(page):
    post(page, "/api/replay", position=5.0)
    post(page, "/api/replay", playing=True, speed=10)
    until(lambda: frame(page)["replay"]["position"] > 12.0)
    assert post(page, "/api/replay", playing=False)["position"] < SECONDS - 5.0
    before = frame(page)["replay"]["position"]
    time.sleep(0.5)
    assert frame(page)["replay"]["position"] == before
    post(page, "/api/replay", playing=True, speed=100)
    until(lambda: not frame(page)["replay"]["playing"])
    shown = frame(page)
    assert shown["replay"]["position"] == pytest.approx(shown["replay"]["duration"], abs=0.01)


@pytest.mark.parametrize("words", [{"position": "x"}, {"speed": None, "position": True}, {"speed": [1]}])
def test_what_is_no_number_is_rejected(page, words):
    answer = post(page, "/api/replay", **words)
    assert not answer["ok"]
    assert "is a number" in answer["text"]


def test_nothing_can_be_commanded(page):
    for path, words in (("/api/order", {"order": "abort", "vehicle": NAME}), ("/api/order", {"order": "abort-all"})):
        assert page.request("POST", path, words)[:2] == (403, b"this page shows a log: nothing in it can be commanded")
    for path in ("/api/plans", "/api/parameters"):
        assert page.request("GET", f"{path}?vehicle={NAME}")[0] == 403
    assert page.request("POST", "/api/flight", {"text": "plan: x"})[0] == 404


def test_a_plot_has_the_whole_log(page):
    found = series(page, f"{NAME}/EstimatedState.depth")
    assert found["times"] == sorted(found["times"])
    assert found["times"][-1] - found["times"][0] == pytest.approx(SECONDS - 5.05, abs=0.5)
    assert max(found["values"]) == pytest.approx(1.9, abs=0.3)
    depth = series(page, f"{NAME}/Temperature.value:Depth Sensor")
    assert depth["ok"], depth
    for path in ("x", f"{NAME}/Nope.x", f"{NAME}/EstimatedState.nope", "nobody/EstimatedState.depth"):
        assert not series(page, path)["ok"]


def test_a_virtual_run_is_resumed_with_a_change(page):
    answer = post(page, "/api/resume", position=20.0, seconds=5, change="Simulators.GPS:HDOP=2")
    assert answer["ok"], answer
    assert "resumed at 25.0 s of the run for 5 s" in answer["text"]
    assert (Path(answer["log"]) / "Data.lsf.gz").is_file()
    answer = post(page, "/api/resume", position=20.0, change="Simulators.Nope:x=1")
    assert (answer["ok"], "Simulators.Nope" in answer["text"]) == (False, True)


def test_a_full_disk_under_a_resumed_run_is_reported(logs, tmp_path):
    """The disk holds the repeated run, but not the log of the new one."""
    start = imc.Log(logs[1]).array("EstimatedState")["timestamp"][0]
    job = {"log": str(logs[1]), "time": start + 5.0, "seconds": 120.0, "changes": [], "log_root": str(tmp_path)}
    with largest_file(700_000):
        found = asyncio.run(PageJob(WORKER).run(job))
    assert found["ok"] is False
    assert found["text"].startswith("the new log is not complete: ")
    assert TOO_LARGE in found["text"]
    assert "resumed at" in found["text"]
    assert (Path(found["log"]) / "Data.lsf.gz").stat().st_size <= 700_000


def test_all_logs_of_a_run_are_one(logs):
    with operator_page(str(logs[1]), "--run") as page:
        page.log_in()
        shown = frame(page)
        assert shown["replay"]["duration"] == pytest.approx(SECONDS, abs=0.2)
        assert shown["replay"]["notice"] == ""
        assert shown["vehicles"][NAME]["plan"]["name"] is None
        post(page, "/api/replay", position=30.0)
        assert frame(page)["vehicles"][NAME]["plan"]["name"] == "dive"


def test_a_truncated_log_is_shown_with_a_notice(logs, tmp_path):
    for name in ("Data.lsf.gz", "IMC.xml.gz"):
        (tmp_path / name).write_bytes((logs[1] / name).read_bytes())
    data = tmp_path / "Data.lsf.gz"
    data.write_bytes(data.read_bytes()[: data.stat().st_size // 2])
    with operator_page(str(tmp_path)) as page:
        page.log_in()
        shown = frame(page)
        assert "this log is not complete: " in shown["replay"]["notice"]
        assert not shown["replay"]["resume"]
        assert NAME in shown["vehicles"]
