"""`shoal console` beside a shipped vehicle, each in a process of its own."""

import json
import math
import re
import time

import pytest
from websockets.exceptions import ConnectionClosed, InvalidStatus

from tests.outside import until
from tests.shoal.console.operator_page import OperatorPage, frame_of, operator_page
from tests.shoal.network.running import running

NAME = "lauv-noptilus-1"
PLAN = 'plan: "east"\nmaneuvers:\n- goto: {lat: 41.1850°, lon: -8.7000°, depth: 0, speed: 1.0 m/s}\n'


@pytest.fixture(scope="module")
def page(tmp_path_factory):
    with running(tmp_path_factory.mktemp("vehicle")) as vehicle, operator_page() as found:
        found.vehicle_output = vehicle.log
        found.log_in()
        until(lambda: mode(found) == "service", 40.0)
        yield found


def first_frame(page: OperatorPage) -> dict:
    with page.frames() as frames:
        return json.loads(frames.recv(10))


def read_to_the_end(frames) -> None:
    while True:
        frames.recv(10)


def mode(page: OperatorPage) -> str | None:
    vehicle = first_frame(page)["vehicles"].get(NAME)
    return None if vehicle is None else vehicle["plan"]["mode"]


pytestmark = pytest.mark.heavy


def test_the_first_frame_has_the_vehicle(page):
    frame = first_frame(page)
    assert frame["all"]
    vehicle = frame["vehicles"][NAME]
    assert (vehicle["system"]["id"], vehicle["system"]["type"], vehicle["system"]["there"]) == ("0x001A", "uuv", True)
    assert vehicle["state"]["lat"] == pytest.approx(41.185, abs=0.01)
    assert vehicle["state"]["depth"] == pytest.approx(0.0, abs=0.5)
    assert vehicle["plan"]["motors"] == "at rest"
    entities = {each["entity"]: each["state"] for each in vehicle["health"]["entities"]}
    assert entities["Navigation"] == "normal"
    assert len(entities) > 40


def test_later_frames_have_changes_and_the_fields_that_are_drawn(page):
    fields = [f"{NAME}/EstimatedState.depth", f"{NAME}/Temperature.value:Depth Sensor", f"{NAME}/Nope.x", "x", NAME]
    with page.frames() as frames:
        assert json.loads(frames.recv(10))["all"]
        frames.send(json.dumps({"fields": fields}))
        values = {}
        end = time.monotonic() + 20.0
        while len(values) < 2 and time.monotonic() < end:
            frame = json.loads(frames.recv(10))
            assert "all" not in frame
            values |= frame["values"]
    assert set(values) == set(fields[:2])
    assert values[fields[1]][1] == pytest.approx(20.0, abs=10.0)


def test_a_plan_is_stored_drawn_started_held_and_aborted(page):
    stored = page.order(NAME, "put", text=PLAN)
    assert stored["ok"], stored
    assert "estimated time" in stored["text"]
    assert [plan["name"] for plan in page.get(f"/api/plans?vehicle={NAME}")["plans"]] == ["east"]
    (leg,) = page.get(f"/api/plans?vehicle={NAME}&plan=east")["path"]
    assert (leg["kind"], leg["places"], leg["reference"]) == ("Goto", [[41.185, -8.7]], "depth")
    assert page.order(NAME, "start", plan="east")["text"].startswith("obeyed: east is carried out; estimated time")
    until(lambda: first_frame(page)["vehicles"][NAME]["plan"]["motors"] == "turning", 30.0)
    assert first_frame(page)["vehicles"][NAME]["plan"]["name"] == "east"
    another = page.order(NAME, "put", text=PLAN.replace("east", "another"))
    assert "another is stored; time and energy unknown" in another["text"]
    assert another["text"].endswith("(a vehicle estimates none while another one is carried out)")
    assert page.order(NAME, "delete", plan="another")["ok"]
    assert page.order(NAME, "hold")["text"].startswith("obeyed: console-hold is carried out")
    assert page.order(NAME, "surface")["text"].startswith("obeyed: console-surface is carried out")
    aborted = page.order(NAME, "abort")
    assert aborted["ok"], aborted
    assert re.match(r"(obeyed|aborted): mode (error|service)", aborted["text"]), aborted
    until(lambda: mode(page) == "service", 40.0)
    assert page.order(NAME, "delete", plan="east")["ok"]


def test_an_order_is_in_the_log_of_the_vehicle_with_its_user(page):
    page.order(NAME, "delete", plan="nope")
    until(lambda: "Console] local: delete nope" in page.vehicle_output.read_text())
    assert [NAME, "info", "Console", "local: delete nope"] in [entry[1:5] for entry in frame_of(page)["log"]]


def test_abort_all_is_one_request_with_the_answer_of_each_vehicle(page):
    status, content, _ = page.request("POST", "/api/order", {"order": "abort-all"})
    found = json.loads(content)
    assert (status, found["ok"]) == (200, True)
    (answer,) = found["answers"]
    assert (answer["vehicle"], answer["ok"]) == (NAME, True)
    assert re.match(r"(obeyed|aborted): mode (error|service)", answer["text"]), answer
    until(lambda: mode(page) == "service", 40.0)


@pytest.mark.parametrize(
    ("order", "words", "text"),
    [
        ("put", {"text": "plan: x\nmaneuvers:\n- goto: {lat: 41.2, lon: -8.7}\n"}, "plan:3: lat: 2360.59° is not a"),
        ("put", {"text": 'plan: "x'}, "not YAML"),
        ("start", {"plan": "nope"}, "undefined plan"),
        ("start", {}, "name a plan"),
        ("stop", {}, "no plan is running"),
        ("set", {"entity": "Nope", "parameter": "x", "value": "1"}, "Nope"),
        ("fly", {}, "no such order: 'fly'"),
    ],
)
def test_an_order_that_fails_has_its_reason(page, order, words, text):
    answer = page.order(NAME, order, **words)
    assert not answer["ok"]
    assert text in answer["text"]


def test_a_vehicle_that_is_not_there_takes_no_order(page):
    for name in ("nobody", "", None, 3, "x" * 10_000):
        assert page.order(name, "abort") == {"ok": False, "text": "there is no such vehicle"}


def test_parameters_are_read_and_set(page):
    assert "Depth Sensor" in page.get(f"/api/parameters?vehicle={NAME}")["entities"]
    values = page.get(f"/api/parameters?vehicle={NAME}&entity=Depth%20Sensor")["values"]
    assert math.isfinite(float(values["Standard Deviation"]))
    answer = page.order(NAME, "set", entity="Depth Sensor", parameter="Standard Deviation", value="0.05")
    assert answer == {"ok": True, "text": "Depth Sensor: Standard Deviation = 0.05"}


def test_without_a_login_there_is_nothing_but_the_page(page):
    other = {"Cookie": "shoal-console=wrong"}
    for path in ("/api/plans", "/api/parameters", "/api/fields", "/api/tiles", "/tiles/a/1/0/0"):
        assert page.request("GET", path, **other)[:2] == (401, b"log in first"), path
    assert page.request("POST", "/api/order", {"vehicle": NAME, "order": "abort"}, **other)[0] == 401
    before, page.cookie = page.cookie, ""
    try:
        with pytest.raises(InvalidStatus), page.frames() as frames:
            frames.recv(10)
    finally:
        page.cookie = before
    assert page.request("GET", "/healthz", **other)[:2] == (200, b"ok")
    status, content, headers = page.request("GET", "/", **other)
    assert status == 200
    assert b"<title>Shoal</title>" in content
    assert "default-src 'self'" in headers["content-security-policy"]


def test_requests_of_other_sites_are_rejected(page):
    order = {"vehicle": NAME, "order": "abort"}
    evil = "http://evil.example"
    for headers in ({"Origin": evil}, {"Origin": "null"}, {"Origin": ""}, {"Host": "evil.example"}):
        assert page.request("POST", "/api/order", order, **headers)[0] == 403, headers
    assert page.request("GET", "/api/plans?vehicle=x", Host=f"evil.example:{page.port}")[0] == 403
    assert page.request("GET", "/api/order")[0] == 405
    with pytest.raises((InvalidStatus, ConnectionClosed)), page.frames(origin=evil) as frames:
        frames.recv(10)
    assert mode(page) == "service"


def test_bodies_that_are_no_orders_change_nothing(page):
    for body in (b"", b"[]", b"{", b"\xff\xfe", b'{"vehicle": ' + b"[" * 100_000):
        status, content, _ = page.request("POST", "/api/order", body)
        assert (status, json.loads(content)["ok"]) == (200, False)
    assert page.request("POST", "/api/order", b"x" * ((1 << 20) + 1))[0] == 403
    assert page.request("POST", "/api/login", iter([b"x"] * 10))[0] == 403  # in pieces, without a length
    with page.frames() as frames:
        for text in ("", "[]", "{", '{"fields": 3}', '{"fields": [3, null, ["x"]]}', "x" * 5000):
            frames.send(text)
        assert json.loads(frames.recv(10))["all"]
        frames.recv(10)
    with page.frames() as frames:
        frames.send("x" * 100_000)
        with pytest.raises(ConnectionClosed, match="1009"):
            read_to_the_end(frames)
    assert mode(page) == "service"


def test_a_page_that_does_not_read_delays_no_other(page):
    with page.frames(max_queue=1), page.frames() as frames:
        for _ in range(40):
            frames.recv(10)


def checks_of(page, **words):
    status, content, _ = page.request("POST", "/api/checks", {"vehicle": NAME, **words})
    assert status == 200, content
    return {each["name"]: each for each in json.loads(content)["checks"]}


def test_checks_descriptions_and_rates_come_over_a_network(page):
    checks = checks_of(page)
    assert checks["Link"]["value"].startswith("zenoh")
    assert checks["GPS fix"]["color"] == "green"
    assert checks["Plan"]["source"] == "PlanDB"
    assert page.order(NAME, "put", text=PLAN)["ok"]
    assert "east would start; " in checks_of(page, plan="east")["Plan"]["value"]
    details = page.get(f"/api/parameter-details?vehicle={NAME}&entity=Depth%20Sensor")
    deviation = details["values"]["Standard Deviation"]
    assert (deviation["unit"], deviation["default"], deviation["where"]) == ("m", "0.05", None)
    rates = until(lambda: page.get(f"/api/rates?vehicle={NAME}")["rows"])
    assert {"Depth", "EstimatedState", "Heartbeat"} <= {row[0] for row in rates}
    assert page.order(NAME, "delete", plan="east")["ok"]
