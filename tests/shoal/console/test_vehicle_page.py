"""The page that a shipped vehicle serves itself: orders, users, roles and leases."""

import json
import socket
import subprocess
import sys
import time

import pytest

from shoal.console import Role, Users, make_certificate
from tests.outside import ALONE_WORDS, until
from tests.shoal.console.operator_page import OperatorPage, frame_of, vehicle_page

NAME = "lauv-noptilus-1"
PLAN = 'plan: "east"\nmaneuvers:\n- goto: {lat: 41.1850°, lon: -8.7000°, depth: 0, speed: 1.0 m/s}\n'
PASSWORD = "correct horse"

pytestmark = pytest.mark.heavy


@pytest.fixture(scope="module")
def access(tmp_path_factory):
    """A folder with a user of each role, and a certificate."""
    folder = tmp_path_factory.mktemp("access")
    for name, role in (("anna", Role.OPERATE), ("ben", Role.MAINTAIN), ("wanda", Role.WATCH)):
        Users(folder).add(name, role, PASSWORD)
    make_certificate(folder, ["localhost", "127.0.0.1"])
    return folder


@pytest.fixture(scope="module")
def page(access, tmp_path_factory):
    with vehicle_page(
        tmp_path_factory.mktemp("vehicle"), "--set", f"Transports.Console:Access Folder={access}"
    ) as found:
        found.log_in()
        until(lambda: mode(found) == "service", 40.0)
        yield found


@pytest.fixture(scope="module")
def users(page):
    """A page of each user: more logins within a minute are rejected."""
    return {name: page.another(user=name, password=PASSWORD) for name in ("anna", "ben", "wanda")}


def mode(page: OperatorPage) -> str | None:
    vehicle = frame_of(page)["vehicles"].get(NAME)
    return None if vehicle is None else vehicle["plan"]["mode"]


def test_the_first_frame_has_the_vehicle_and_no_other(page):
    until(lambda: len(frame_of(page)["vehicles"][NAME]["health"]["entities"]) > 30)
    frame = frame_of(page)
    vehicle = frame["vehicles"][NAME]
    assert list(frame["vehicles"]) == [NAME]
    assert (vehicle["system"]["id"], vehicle["system"]["type"]) == ("0x001A", "uuv")
    assert vehicle["system"]["networks"] == ["bus"]
    assert vehicle["state"]["lat"] == pytest.approx(41.185, abs=0.01)
    assert {each["entity"]: each["state"] for each in vehicle["health"]["entities"]}["Navigation"] == "normal"


def test_a_plan_is_stored_started_and_aborted_and_each_order_is_in_the_log_book(page):
    stored = page.order(NAME, "put", text=PLAN)
    assert stored["ok"], stored
    assert page.order(NAME, "start", plan="east")["text"].startswith("obeyed: east is carried out; estimated time")
    aborted = page.order(NAME, "abort")
    assert aborted["ok"], aborted
    until(lambda: mode(page) == "service", 40.0)
    reasons = [entry[4] for entry in frame_of(page)["log"] if "aborted by" in entry[4]]
    assert "aborted by local on this page" in reasons
    assert frame_of(page)["vehicles"][NAME]["plan"]["error"] == "aborted by local on this page"
    assert page.order(NAME, "delete", plan="east")["ok"]
    page.lease(NAME, "hand over")
    until(lambda: any("local gives up the lease" in line for line in page.lines))
    texts = [entry[4] for entry in frame_of(page)["log"] if entry[3] == "Transports.Console"]
    expected = ["local takes the lease", "local: store a plan", "local: start east", "local: abort"]
    assert [text for text in texts if "local" in text] == [*expected, "local: delete east", "local gives up the lease"]


def test_each_role_may_give_its_orders_only(users):
    anna, ben, wanda = users.values()
    for order in ("abort", "hold", "start", "set"):
        answer = wanda.order(NAME, order, plan="x")
        assert (answer["ok"], answer["text"].startswith("wanda may watch: this needs the role")) == (False, True)
    assert wanda.lease(NAME, "take")["text"] == "wanda may watch: this needs the role operate"
    assert json.loads(wanda.request("POST", "/api/order", {"order": "abort-all"})[1])["ok"] is False
    assert "Depth Sensor" in wanda.get(f"/api/parameters?vehicle={NAME}")["entities"]
    words = {"entity": "Depth Sensor", "parameter": "Standard Deviation", "value": "0.05"}
    assert anna.order(NAME, "set", **words)["text"] == "anna may operate: this needs the role maintain"
    assert ben.order(NAME, "set", **words)["ok"]
    ben.lease(NAME, "hand over")


def test_one_session_commands_and_the_others_see_who_does(page, users):
    anna, ben, _ = users.values()
    assert anna.lease(NAME, "take") == {"ok": True, "text": "you command this vehicle"}
    number = anna.get("/api/me")["session"]
    assert frame_of(ben)["leases"] == {NAME: {"session": number, "user": "anna"}}
    answer = ben.order(NAME, "stop")
    assert (answer["ok"], answer["text"]) == (False, "anna commands this vehicle: take the lease first")
    assert ben.order(NAME, "abort")["ok"]  # by anybody who may operate
    assert ben.lease(NAME, "take")["text"].startswith("anna has been asked")
    assert frame_of(anna)["leases"][NAME]["asked"] == "ben"
    assert anna.lease(NAME, "hand over")["text"] == "ben commands this vehicle now"
    assert "no plan is running" in ben.order(NAME, "stop")["text"]
    assert ben.lease("nobody", "take") == {"ok": False, "text": "there is no such vehicle"}
    assert ben.lease(NAME, "steal")["ok"] is False
    ben.lease(NAME, "hand over")
    until(lambda: mode(page) == "service", 40.0)


def test_what_needs_no_login_reveals_nothing(page):
    stranger = {"Cookie": "", "Origin": ""}
    assert page.request("GET", "/healthz", **stranger)[:2] == (200, b"ok")
    status, content, _ = page.request("GET", "/register_service", **stranger)
    assert status == 200
    assert {"name", "description", "icon", "company", "version", "webpage", "api"} <= set(json.loads(content))
    assert NAME.encode() not in content
    assert json.loads(page.request("GET", "/api/me", **stranger)[1]) == {"ok": False, "passwords": True}


def test_who_logs_out_is_out(users):
    wanda = users["wanda"]
    assert wanda.get("/api/me")["user"] == "wanda"
    assert wanda.request("POST", "/api/logout", {})[0] == 200
    assert wanda.request("GET", "/api/plans")[0] == 401


def test_a_thousand_logins_slow_reads_and_forged_origins_do_not_reach_the_vehicle(page):
    began = time.monotonic()
    assert {login_status(page, "anna", f"guess {number}") for number in range(1000)} == {403}
    assert login_status(page, "anna", PASSWORD) == 403  # it waits, too
    assert time.monotonic() - began < 60.0
    slow = [socket.create_connection(("127.0.0.1", page.port)) for _ in range(20)]
    for each in slow:
        each.sendall(b"POST /api/login HTTP/1.1\r\nHost: x")
    assert (
        page.request("POST", "/api/order", {"vehicle": NAME, "order": "abort"}, Origin="http://evil.example")[0] == 403
    )
    assert mode(page) == "service"
    for each in slow:
        each.close()
    assert not [line for line in page.lines if "fell behind" in line]


def login_status(page: OperatorPage, user: str, password: str) -> int:
    return page.request("POST", "/api/login", {"user": user, "password": password})[0]


def test_at_another_address_it_needs_users_and_tls_and_the_vehicle_runs_on_without(tmp_path):
    settings = ("Address=0.0.0.0", f"Access Folder={tmp_path / 'none'}")
    words = [word for setting in settings for word in ("--set", f"Transports.Console:{setting}")]
    alone = [word for word in ALONE_WORDS if "Console" not in word and word != "--set"]
    words += [word for setting in alone for word in ("--set", setting)]
    command = [
        sys.executable,
        "-m",
        "shoal.cli",
        "run",
        NAME,
        "-p",
        "Simulation",
        "--clock",
        "4x",
        "--for",
        "12s",
        *words,
    ]
    done = subprocess.run(command, cwd=tmp_path, capture_output=True, text=True, timeout=120)
    assert done.returncode == 0, done.stderr
    reason = "ERROR   [Transports.Console] the page is not served at 0.0.0.0"
    assert done.stdout.count(reason) == 1  # it is tried again, and told once
    assert "shoal console user NAME --role operate" in done.stdout
    assert "shoal console certificate" in done.stdout
    assert "12.0 s of vehicle time" in done.stdout


def test_over_tls_users_log_in_with_a_password_only(access, tmp_path):
    settings = ("Address=0.0.0.0", f"Access Folder={access}")
    words = [word for setting in settings for word in ("--set", f"Transports.Console:{setting}")]
    with vehicle_page(tmp_path, *words) as page:
        assert (page.scheme, page.token) == ("https", "")
        headers = page.log_in(user="anna", password=PASSWORD)
        assert "Secure" in headers["set-cookie"]
        assert page.get("/api/me")["role"] == "operate"
        assert page.request("GET", "/", Host=f"evil.example:{page.port}")[0] == 403
        assert page.request("POST", "/api/logout", {}, Origin=f"http://{page.host}")[0] == 403
