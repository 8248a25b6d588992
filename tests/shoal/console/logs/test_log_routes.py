"""Logs over the page: listed, streamed and drawn, while files grow, vanish, and several users ask."""

import http.client
import json
import os
import shutil
import threading
from urllib.parse import quote

import pytest

from shoal.console import PageSecurity, Role, Users
from shoal.console.logs import log_routes
from shoal.console.logs.log_library import LogLibrary
from tests.outside import until
from tests.shoal.console.logs.test_log_library import write_log
from tests.shoal.console.page_of_nobody import served_page

PASSWORD = "correct horse"


@pytest.fixture
def page(tmp_path):
    users = Users(tmp_path / "access")
    users.add("wanda", Role.WATCH, PASSWORD)
    (tmp_path / "log").mkdir()
    with served_page(log_root=tmp_path / "log", security=PageSecurity(users=users)) as found:
        found.folder = tmp_path / "log"
        found.log_in()
        yield found


def logs(page):
    status, content, _ = page.request("GET", "/api/logs")
    assert status == 200
    answer = json.loads(content)
    assert answer["ok"], answer
    return answer["logs"]


def file_of(page, key, name="Data.lsf"):
    return page.request("GET", f"/api/log-file?log={quote(key)}&file={quote(name)}")


def make_report(page, key):
    connection = http.client.HTTPConnection("127.0.0.1", page.server.port, timeout=120)
    headers = {"Host": page.host, "Origin": f"http://{page.host}", "Cookie": page.cookie}
    connection.request("POST", "/api/log-report-make", json.dumps({"log": key}), headers)
    with connection.getresponse() as answer:
        return json.loads(answer.read())


def report(page, key):
    return page.request("GET", f"/api/log-report?log={key}")


def test_a_file_is_downloaded_under_a_name_of_its_log(page):
    place = write_log(page.folder, "20260101/000005_dive")
    (row,) = logs(page)
    status, content, headers = file_of(page, row["key"])
    assert (status, content) == (200, (place / "Data.lsf").read_bytes())
    assert headers["content-disposition"].endswith("''20260101_000005_dive_Data.lsf")
    assert headers["content-type"] == "application/octet-stream"
    for key, name in ((row["key"], "../../../etc/passwd"), ("x", "Data.lsf"), (row["key"], "")):
        assert file_of(page, key, name)[0] == 404


def test_a_log_that_grows_or_is_removed_while_it_is_downloaded_comes_as_it_was(page):
    place = write_log(page.folder, "20260101/000005")
    data = os.urandom(16 << 20)
    (place / "Data.lsf").write_bytes(data)
    (row,) = logs(page)
    connection = http.client.HTTPConnection("127.0.0.1", page.server.port, timeout=20)
    address = f"/api/log-file?log={row['key']}&file=Data.lsf"
    connection.request("GET", address, headers={"Host": page.host, "Cookie": page.cookie})
    answer = connection.getresponse()
    first = answer.read(1000)
    with (place / "Data.lsf").open("ab") as file:
        file.write(b"more")
    shutil.rmtree(place)
    assert first + answer.read() == data
    connection.close()
    assert file_of(page, row["key"])[:2] == (404, b"Data.lsf: No such file or directory")


def test_of_many_downloads_at_once_no_more_than_allowed_are_begun(page, monkeypatch):
    monkeypatch.setattr(log_routes, "MOST_DOWNLOADS", 2)
    write_log(page.folder, "20260101/000005")
    (row,) = logs(page)
    opens, begun, answers = LogLibrary.open, threading.Event(), []
    monkeypatch.setattr(LogLibrary, "open", lambda *words: begun.wait(20.0) and opens(*words))
    users = [threading.Thread(target=lambda: answers.append(file_of(page, row["key"])[0])) for _ in range(4)]
    for each in users:
        each.start()
    try:
        until(lambda: answers == [503, 503])
    finally:
        begun.set()
    for each in users:
        each.join(20.0)
    assert answers == [503, 503, 200, 200]
    assert file_of(page, row["key"])[0] == 200


@pytest.mark.heavy
def test_downloads_that_nobody_reads_are_limited_and_end(page, monkeypatch):
    monkeypatch.setattr(log_routes, "MOST_DOWNLOADS", 2)
    place = write_log(page.folder, "20260101/000005")
    (place / "Data.lsf").write_bytes(os.urandom(64 << 20))
    (row,) = logs(page)
    waiting = []
    for _ in range(2):
        connection = http.client.HTTPConnection("127.0.0.1", page.server.port, timeout=20)
        address = f"/api/log-file?log={row['key']}&file=Data.lsf"
        connection.request("GET", address, headers={"Host": page.host, "Cookie": page.cookie})
        connection.getresponse().read(10)
        waiting.append(connection)
    assert file_of(page, row["key"], "Output.txt")[0] == 503
    for connection in waiting:
        connection.close()
    until(lambda: file_of(page, row["key"], "Output.txt")[0] == 200)


@pytest.mark.heavy
def test_a_report_is_a_document_that_reaches_nothing_of_the_page(page):
    write_log(page.folder, "20260101/000005_<script>")
    (row,) = logs(page)
    assert report(page, row["key"])[0] == 404
    assert make_report(page, row["key"])["ok"]
    status, content, headers = report(page, row["key"])
    assert (status, b"<html" in content, b"Heartbeat" in content) == (200, True, True)
    policy = headers["content-security-policy"]
    assert policy.startswith("sandbox allow-scripts; default-src 'none'; ")
    assert "allow-same-origin" not in policy
    assert headers["cross-origin-opener-policy"] == "unsafe-none"  # HTML forbids another one of what is in a sandbox
    assert headers["x-content-type-options"] == "nosniff"
    assert "self" in page.request("GET", "/")[2]["content-security-policy"]


@pytest.mark.heavy
def test_what_is_no_log_has_a_reason_instead_of_a_report(page):
    (page.folder / "noise").mkdir()
    (page.folder / "noise" / "Data.lsf").write_bytes(b"noise" * 100)
    (row,) = logs(page)
    assert make_report(page, row["key"])["text"] == "noise: there is no message in this log"
    for key in ("x", None, ["x"], 7):
        assert make_report(page, key)["text"].startswith("this log is not in the list")


@pytest.mark.heavy
def test_one_report_at_a_time_is_made_and_can_be_cancelled(page):
    write_log(page.folder, "20260101/000005")
    (row,) = logs(page)
    answers = []
    users = [threading.Thread(target=lambda: answers.append(make_report(page, row["key"]))) for _ in range(2)]
    for each in users:
        each.start()
    until(lambda: answers)
    page.request("POST", "/api/log-report-cancel", {})
    for each in users:
        each.join(30.0)
    assert answers[0]["text"].startswith("local has a report made, for ")
    assert answers[1]["text"] == "cancelled"


def test_who_may_watch_lists_and_downloads_and_makes_no_report(page):
    write_log(page.folder, "20260101/000005")
    page.log_in(user="wanda", password=PASSWORD)
    (row,) = logs(page)
    assert file_of(page, row["key"])[0] == 200
    assert make_report(page, row["key"])["text"] == "wanda may watch: this needs the role operate"


def test_without_a_login_there_is_no_log(page):
    write_log(page.folder, "20260101/000005")
    (row,) = logs(page)
    page.cookie = ""
    for path in ("/api/logs", f"/api/log-file?log={row['key']}&file=Data.lsf", f"/api/log-report?log={row['key']}"):
        assert page.request("GET", path)[0] == 401
    assert page.request("POST", "/api/log-report-make", {"log": row["key"]})[0] == 401


def test_a_request_of_another_site_makes_no_report(page):
    write_log(page.folder, "20260101/000005")
    (row,) = logs(page)
    words = {"log": row["key"]}
    assert page.request("POST", "/api/log-report-make", words, Origin="http://evil.example")[0] == 403
