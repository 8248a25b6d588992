"""Requests to the page that are not those of its own scripts."""

import asyncio
import json
import socket
import time
from contextlib import ExitStack, suppress
from types import SimpleNamespace

import pytest
from websockets.exceptions import InvalidStatus

import imc
from shoal.console import Role, Users
from shoal.console.access.page_security import PageSecurity
from shoal.console.application import WORDS_PAUSE, ConsoleApplication
from tests.shoal.console.foxglove.packet_radio import Radio
from tests.shoal.console.page_of_nobody import served_page


def test_a_name_is_reached_in_any_case():
    """Browsers send the name of a computer in small letters, however it is written in its certificate."""
    with served_page(security=PageSecurity(hosts=("LAUV-Noptilus", "127.0.0.1"))) as page:
        name = f"lauv-noptilus:{page.server.port}"
        assert page.request("GET", "/", Host=name)[0] == 200
        words = {"vehicle": "x", "order": "abort"}
        assert page.request("POST", "/api/order", words, Host=name, Origin=f"http://{name}")[0] == 401
        assert page.request("GET", "/", Host=f"otter:{page.server.port}")[0] == 403


def test_numbers_of_any_length_are_no_error_of_the_page():
    """Python reads none of more than 4300 digits."""
    with served_page() as page:
        assert page.request("GET", f"/tiles/a/{'9' * 5000}/1/1")[0] == 401
        page.log_in()
        for place in ("9" * 5000 + "/1/1", "1/x/1", "1/1/-1"):
            assert page.request("GET", f"/tiles/a/{place}")[0] == 404


def test_no_header_gives_a_client_another_address(tmp_path):
    Users(tmp_path).add("anna", Role.OPERATE, "correct horse")
    with served_page(security=PageSecurity(users=Users(tmp_path))) as page:
        texts = [
            page.request("POST", "/api/login", {"token": "guess"}, **{"X-Forwarded-For": f"10.0.0.{number}"})[1]
            for number in range(7)
        ]
        assert b"wait a minute" in texts[-1]


def test_a_large_login_is_not_read():
    with served_page() as page:
        status, text, _ = page.request("POST", "/api/login", {"token": "x" * 5000})
        assert (status, text) == (413, b"a login has at most 4096 bytes")
        assert page.request("POST", "/api/login", {"token": "x" * 3000})[0] == 403


def test_an_order_whose_session_ends_while_it_comes_is_rejected():
    body = b'{"vehicle": "x", "order": "abort"}'
    with served_page() as page:
        page.log_in()
        sent = {"Host": page.host, "Origin": f"http://{page.host}", "Cookie": page.cookie, "Content-Length": len(body)}
        head = "\r\n".join(f"{name}: {value}" for name, value in sent.items())
        with socket.create_connection(("127.0.0.1", page.server.port), timeout=10) as slow:
            slow.sendall(f"POST /api/order HTTP/1.1\r\n{head}\r\n\r\n".encode() + body[:5])
            time.sleep(0.2)
            page.request("POST", "/api/logout")
            slow.sendall(body[5:])
            assert slow.recv(100).startswith(b"HTTP/1.1 401")


class Announced(Radio):
    """A radio by which two vehicles are received, one with a name that is a path."""

    async def open(self, listener, console):
        await super().open(listener, console)
        for number, name in enumerate(("lauv-noptilus-1", "../x"), 0x1A):
            self.bring(imc.Announce(sys_name=name, sys_type=imc.SystemType.UUV, src=number), system=name)


def test_contours_are_made_once_and_for_vehicles_that_are_there_only(monkeypatch):
    made = []
    monkeypatch.setattr(
        "shoal.console.charts.depth_contours.depth_contours", lambda profile: made.append(profile) or []
    )
    with served_page(Announced()) as page:
        page.log_in()

        def contours(name):
            return json.loads(page.request("GET", f"/api/contours?vehicle={name}")[1])

        assert contours("lauv-noptilus-1") == contours("lauv-noptilus-1") == {"ok": True, "lines": []}
        assert contours("otter") == {"ok": False, "text": "there is no such vehicle", "lines": []}
        assert contours("../x") == {"ok": False, "text": "no name of a profile", "lines": []}
    assert made == ["lauv-noptilus-1"]


def test_who_may_watch_only_leaves_pages_to_those_who_command(tmp_path, monkeypatch):
    monkeypatch.setattr("shoal.console.application.MOST_WATCHING", 3)
    Users(tmp_path).add("anna", Role.WATCH, "correct horse")
    Users(tmp_path).add("ben", Role.OPERATE, "correct horse")
    with served_page(security=PageSecurity(users=Users(tmp_path))) as page, ExitStack() as opened:
        page.log_in(user="anna", password="correct horse")
        for _ in range(3):
            assert json.loads(opened.enter_context(page.frames()).recv(10))["all"]
        with pytest.raises(InvalidStatus):
            page.frames()
        page.log_in(user="ben", password="correct horse")
        assert json.loads(opened.enter_context(page.frames()).recv(10))["all"]


def test_who_logs_out_gives_up_the_lease_at_once(tmp_path):
    for name in ("anna", "ben"):
        Users(tmp_path).add(name, Role.OPERATE, "correct horse")
    with served_page(Announced(), security=PageSecurity(users=Users(tmp_path))) as page:
        words = {"vehicle": "lauv-noptilus-1", "change": "take"}
        page.log_in(user="anna", password="correct horse")
        assert json.loads(page.request("POST", "/api/lease", words)[1])["ok"]
        assert page.request("POST", "/api/logout", {})[0] == 200
        page.log_in(user="ben", password="correct horse")
        content = page.request("POST", "/api/lease", words)[1]
        assert json.loads(content) == {"ok": True, "text": "you command this vehicle"}


def test_a_page_that_draws_other_fields_all_the_time_has_a_few_of_them_read():
    drawn = []

    async def receive_text() -> str:
        await asyncio.sleep(0.0)
        return json.dumps({"fields": [f"{len(drawn)}"]})

    async def run() -> None:
        page = SimpleNamespace(_feed=SimpleNamespace(set_fields=lambda _, fields: drawn.append(fields)))
        with suppress(TimeoutError):
            async with asyncio.timeout(2.5 * WORDS_PAUSE):
                await ConsoleApplication._read_words(page, SimpleNamespace(receive_text=receive_text), None)

    asyncio.run(run())
    assert drawn[0] == ["0"]
    assert len(drawn) <= 3
