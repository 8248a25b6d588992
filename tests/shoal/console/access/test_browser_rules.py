"""Rules that the page gives browsers, which keep other sites from it: cookie, content policy, methods, origins."""

import socket

import pytest
from websockets.exceptions import InvalidStatus
from websockets.sync.client import connect

from tests.shoal.console.page_of_nobody import served_page

CHANGES = [
    *("order", "lease", "login", "logout", "checks", "flight", "flight-cancel", "plan-draw", "plan-import"),
    *("plan-export", "forecast", "log-report-make", "log-report-cancel"),
]
"""Requests that do something; the page sends them by POST."""


@pytest.fixture(scope="module")
def page():
    with served_page() as found:
        token = found.server.login_link().partition("#")[2]
        _, _, found.login_headers = found.request("POST", "/api/login", {"token": token})
        found.cookie = found.login_headers["set-cookie"].partition(";")[0]
        yield found


def test_scripts_and_other_sites_do_not_have_the_cookie(page):
    words = {word.strip().lower() for word in page.login_headers["set-cookie"].split(";")[1:]}
    assert {"httponly", "samesite=strict", "path=/"} <= words


@pytest.mark.parametrize("path", ["/", "/files/main.js", "/api/me", "/healthz", "/nothing"])
def test_each_answer_lets_the_browser_load_from_this_page_only(page, path):
    _, _, headers = page.request("GET", path)
    rules = {rule.strip() for rule in headers["content-security-policy"].split(";")}
    assert {"default-src 'self'", "img-src 'self' data: blob:", "frame-ancestors 'none'"} <= rules
    assert headers["x-content-type-options"] == "nosniff"


@pytest.mark.parametrize("name", CHANGES)
def test_nothing_is_changed_by_get(page, name):
    status = page.request("GET", f"/api/{name}")[0]
    # The same path by GET may ask how far the work is.
    assert status == 405 or (name in ("flight", "forecast") and status == 200)


@pytest.mark.parametrize(
    ("path", "origin"),
    [
        ("frames", "http://evil.example"),
        ("frames", "null"),
        ("frames", None),
        ("steering", "http://evil.example"),
        ("steering", "null"),
        ("steering", None),
        ("foxglove", "http://evil.example"),
    ],
)
def test_no_connection_of_another_site_is_opened(page, path, origin):
    words = {"origin": origin, "additional_headers": {"Cookie": page.cookie}}
    with pytest.raises(InvalidStatus, match="403"), connect(f"ws://{page.host}/{path}", **words):
        pass


@pytest.mark.parametrize("path", ["frames", "steering", "foxglove"])
def test_no_connection_is_opened_for_a_name_of_another_site(page, path):
    """A name that leads to this computer (DNS rebinding) has the Origin of its own Host."""
    name = f"evil.example:{page.server.port}"
    words = {"origin": f"http://{name}", "additional_headers": {"Cookie": page.cookie}}
    with (
        socket.create_connection(("127.0.0.1", page.server.port)) as opened,
        pytest.raises(InvalidStatus, match="403"),
        connect(f"ws://{name}/{path}", sock=opened, **words),
    ):
        pass
