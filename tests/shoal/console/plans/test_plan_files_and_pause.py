"""Plans are read and written on the page as files of Shoal and of other programs."""

import json

import pytest

from tests.outside import until
from tests.shoal.console.operator_page import vehicle_page

NAME = "lauv-noptilus-1"
PLAN = """plan: "two/points"
maneuvers:
- goto: {lat: 41.1852°, lon: -8.7060°, depth: 2, speed: 1.2 m/s}
- goto: {lat: 41.1856°, lon: -8.7060°, altitude: 3, speed: 0.8 m/s}
"""
BOMB = '<!DOCTYPE x [<!ENTITY a "aaaa"><!ENTITY b "&a;&a;">]><kml>&b;</kml>'


@pytest.fixture(scope="module")
def page(tmp_path_factory):
    with vehicle_page(tmp_path_factory.mktemp("vehicle")) as found:
        found.log_in()
        yield found


def post(page, path: str, **words: object) -> dict:
    status, content, _ = page.request("POST", path, {"vehicle": NAME, **words})
    assert status == 200, content
    return json.loads(content)


@pytest.mark.parametrize("suffix", [".yaml", ".json", ".plan", ".waypoints", ".geojson", ".kml", ".gpx"])
def test_a_plan_is_written_and_read_in_each_format(page, suffix):
    written = post(page, "/api/plan-export", text=PLAN, suffix=suffix)
    assert written["ok"], written
    assert written["name"] == f"two_points{suffix}"
    read = post(page, "/api/plan-import", name=written["name"], text=written["text"])
    assert read["ok"], read
    places = [place for leg in read["path"] for place in leg["places"]]
    assert [41.1852, -8.706] in [pytest.approx(place, abs=1e-6) for place in places]
    again = post(page, "/api/plan-export", text=read["text"], suffix=".json")
    assert again["ok"], again
    if suffix in (".yaml", ".json"):
        assert json.loads(again["text"]) == json.loads(
            post(page, "/api/plan-export", text=PLAN, suffix=".json")["text"]
        )


@pytest.mark.parametrize(
    ("words", "reason"),
    [
        ({"name": "x.exe", "text": ""}, "files of plans end in"),
        ({"name": "a.yaml", "text": "plan: x"}, "a.yaml"),
        ({"name": "../../etc/a.json", "text": "{"}, "etc_a.json"),
        ({"name": "a.plan", "text": "[]"}, "a.plan"),
        ({"name": "a.kml", "text": BOMB}, "a.kml"),
        ({"name": "a.kml", "text": "x" * 900_001}, "at most 900000 characters"),
        ({"name": 5, "text": ""}, "a file has a name"),
    ],
)
def test_a_bad_file_is_named_with_the_reason(page, words, reason):
    answer = post(page, "/api/plan-import", **words)
    assert not answer["ok"]
    assert reason in answer["text"]
    assert "/tmp" not in answer["text"]


def test_a_plan_in_no_form_is_not_written(page):
    assert "maneuvers" in post(page, "/api/plan-export", text="plan: x", suffix=".yaml")["text"]
    assert "end in" in post(page, "/api/plan-export", text=PLAN, suffix="/../x")["text"]


def test_a_stored_plan_comes_back_as_text_and_a_change_shows_on_the_page(page):
    def stored() -> object:
        with page.frames() as frames:
            return json.loads(frames.recv(10))["vehicles"].get(NAME, {}).get("plan", {}).get("stored")

    before = stored()
    assert page.order(NAME, "put", text=PLAN)["ok"]
    found = page.get(f"/api/plan-text?vehicle={NAME}&plan=two/points")
    assert found["ok"], found
    assert "altitude: 3" in found["text"]
    assert not page.get(f"/api/plan-text?vehicle={NAME}&plan=nobody")["ok"]
    until(lambda: (now := stored()) is not None and now != before, 20.0)


LEGS = [[40, 30], [80, 30], [80, 60], [0, 60]]
PATH = f"""plan: "legs"
maneuvers:
- follow_path: {{at: "41.185°, -8.7062°", depth: 2, speed: 1.2 m/s, points: {[[*leg, 0] for leg in LEGS]}}}
"""


def running(page) -> tuple[object, object]:
    with page.frames() as frames:
        plan = json.loads(frames.recv(10))["vehicles"][NAME]["plan"]
    return plan["name"], plan["mode"]


def test_a_plan_is_paused_and_resumed_where_it_was(page):
    until(lambda: running(page)[1] == "service", 60.0)
    assert "no plan is running" in page.order(NAME, "pause")["text"]
    assert page.order(NAME, "put", text=PATH)["ok"]
    assert page.order(NAME, "start", plan="legs")["ok"]
    until(lambda: running(page) == ("legs", "maneuver"), 60.0)
    found = page.order(NAME, "pause")
    assert found["text"].startswith("obeyed: console-hold is carried out"), found
    assert found["text"].endswith("Resume continues legs at FollowPath1")
    assert running(page)[0] == "console-hold"
    (leg,) = page.get(f"/api/plans?vehicle={NAME}&plan=console-rest")["path"]
    assert (leg["kind"], leg["name"], len(leg["places"])) == ("FollowPath", "FollowPath1", len(LEGS))
    assert "no plan is running that could be paused" in page.order(NAME, "pause")["text"]
    assert "console-rest is carried out" in page.order(NAME, "resume")["text"]
    assert page.order(NAME, "abort")["ok"]
