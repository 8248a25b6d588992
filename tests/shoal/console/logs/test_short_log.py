"""A short log on the page, in this process."""

import json
import math

import pytest

import imc
from shoal.console import LogLink, PageSecurity, Role, Users
from shoal.logs.log_states import LogStates
from tests.shoal.console.foxglove.viewer import Viewer
from tests.shoal.console.page_of_nobody import served_page

NAME = "lauv-noptilus-1"
REJECTED = "this page shows a log: nothing in it can be commanded"


@pytest.fixture
def page(tmp_path):
    head = {"src": 0x1A, "src_ent": 1}
    announce = imc.Announce(sys_name=NAME, sys_type=imc.SystemType.UUV, timestamp=1.7e9, **head)
    states = [imc.EstimatedState(depth=1.0, timestamp=1.7e9 + number, **head) for number in range(20)]
    (tmp_path / "Data.lsf").write_bytes(b"".join(map(imc.encode, (announce, *states))))
    player = LogLink(LogStates(tmp_path / "Data.lsf"))
    security = PageSecurity(users=Users(tmp_path))
    with served_page(player, player=player, log_root=tmp_path / "resumed", security=security) as found:
        found.log_in()
        yield found


def test_a_viewer_that_may_operate_commands_nothing_in_a_log(page):
    with Viewer(page.server.foxglove_link(operate=True)) as viewer:
        viewer.until(lambda: viewer.services)
        _, answer = viewer.call("/lauv_noptilus_1/hold", 1, b"{}")
        assert json.loads(answer) == {"success": False, "message": REJECTED}
        viewer.send("setParameters", parameters=[{"name": f"{NAME}/Navigation/Frequency", "value": 7}], id="set")
        viewer.status(REJECTED)


@pytest.mark.parametrize(
    "words",
    [
        {"seconds": 1e9},
        {"seconds": math.inf},
        {"seconds": math.nan},
        {"seconds": 0},
        {"position": -1},
        {"position": 10**400},
    ],
)
def test_a_run_is_resumed_within_its_log_and_for_hours_at_most(page, words):
    status, content, _ = page.request("POST", "/api/resume", {"position": 1.0, **words})
    assert (status, json.loads(content)["ok"]) == (200, False)
    assert "seconds at most 21600" in json.loads(content)["text"]


def test_a_run_in_real_time_is_not_resumed_and_the_reason_says_so(page, tmp_path):
    (tmp_path / "Config.ini").write_text(f"[General]\nVehicle = {NAME}\n")
    status, content, _ = page.request("POST", "/api/resume", {"position": 1.0, "seconds": 1})
    answer = json.loads(content)
    assert (status, answer["ok"]) == (200, False)
    assert "a run in real time cannot be resumed" in answer["text"]
    assert "e+" not in answer["text"]


def test_a_number_that_is_too_large_for_a_time_is_rejected(page):
    status, content, _ = page.request("POST", "/api/replay", {"position": 10**400})
    assert (status, json.loads(content)) == (200, {"ok": False, "text": "position is a finite number"})


def test_who_may_watch_sees_plots_and_moves_nothing(page, tmp_path):
    Users(tmp_path).add("anna", Role.WATCH, "correct horse")
    page.log_in(user="anna", password="correct horse")
    status, content, _ = page.request("GET", f"/api/series?path={NAME}/EstimatedState.depth")
    assert (status, json.loads(content)["values"]) == (200, [1.0] * 20)
    for path, role in (("/api/replay", "operate"), ("/api/resume", "maintain")):
        content = json.loads(page.request("POST", path, {"position": 1.0})[1])
        assert content == {"ok": False, "text": f"anna may watch: this needs the role {role}"}
