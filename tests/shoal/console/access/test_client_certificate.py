"""Logins with the certificate of a browser: who has one, who has lost it, and strangers."""

import json
import ssl
import time
from datetime import timedelta

import pytest
from cryptography.hazmat.primitives.serialization import Encoding, NoEncryption, PrivateFormat, pkcs12

from shoal.console import Role, Users, make_certificate, make_client_certificate
from shoal.console.access import client_certificate
from shoal.console.access.page_security import PageSecurity, read_page_security
from shoal.console.access.users import MOST_CERTIFICATES
from tests.command import shoal
from tests.shoal.console.page_of_nobody import ServedPage, served_page

PASSWORD = "correct horse"


def security_of(folder) -> PageSecurity:
    """That of a page for others, at the loopback address."""
    make_certificate(folder, ["localhost", "127.0.0.1"])
    found = read_page_security("0.0.0.0", folder)
    return PageSecurity("127.0.0.1", found.users, found.certificate, found.key, found.client_authority)


def browser_with(page: ServedPage, made=None) -> ServedPage:
    """The page in a browser that has imported a certificate, or none."""
    context = ssl.create_default_context()
    context.check_hostname, context.verify_mode = False, ssl.CERT_NONE
    if made is not None:
        key, certificate, _ = pkcs12.load_key_and_certificates(made.path.read_bytes(), made.password.encode())
        pem = made.path.with_suffix(".pem")
        private = key.private_bytes(Encoding.PEM, PrivateFormat.PKCS8, NoEncryption())
        pem.write_bytes(certificate.public_bytes(Encoding.PEM) + private)
        context.load_cert_chain(pem)
    found = ServedPage(page.server)
    found.tls = context
    return found


def me(page: ServedPage) -> dict:
    return json.loads(page.request("GET", "/api/me")[1])


def test_a_certificate_logs_in_its_user_until_the_user_is_removed(tmp_path):
    made = make_client_certificate(tmp_path, "anna", Role.OPERATE)
    assert made.is_first
    assert made.path.stat().st_mode & 0o777 == 0o600
    users = Users(tmp_path)
    users.add("ben", Role.WATCH, PASSWORD)
    with served_page(security=security_of(tmp_path)) as page:
        anna = browser_with(page, made)
        assert me(anna) == {"ok": False, "passwords": True, "certificate": "anna"}
        anna.log_in(certificate=True)
        assert (me(anna)["user"], me(anna)["role"]) == ("anna", "operate")
        users.add("anna", Role.WATCH, PASSWORD)  # a password beside it, and another role
        assert me(anna)["role"] == "watch"
        users.remove("anna")
        assert me(anna) == {"ok": False, "passwords": True}
        users.add("anna", Role.OPERATE, PASSWORD)  # somebody else with her name
        assert me(anna) == {"ok": False, "passwords": True}
        status, content, _ = anna.request("POST", "/api/login", {"certificate": True})
        assert (status, content) == (403, b"the browser has shown no certificate of a user")


def test_a_browser_without_a_certificate_logs_in_with_a_password(tmp_path):
    make_client_certificate(tmp_path, "anna", Role.OPERATE)
    Users(tmp_path).add("ben", Role.WATCH, PASSWORD)
    with served_page(security=security_of(tmp_path)) as page:
        ben = browser_with(page)
        assert ben.request("POST", "/api/login", {"certificate": True})[0] == 403
        assert ben.request("POST", "/api/login", {"certificate": True}, Origin="https://evil.example")[0] == 403
        ben.log_in(user="ben", password=PASSWORD)
        assert me(ben)["user"] == "ben"


def test_a_certificate_of_another_authority_opens_nothing(tmp_path):
    for name in ("own", "other"):
        (tmp_path / name).mkdir()
    made = make_client_certificate(tmp_path / "other", "anna", Role.MAINTAIN)
    make_client_certificate(tmp_path / "own", "anna", Role.MAINTAIN)
    with served_page(security=security_of(tmp_path / "own")) as page:
        with pytest.raises((ssl.SSLError, ConnectionError)):
            browser_with(page, made).request("GET", "/api/me")
        assert me(browser_with(page))["ok"] is False


def test_an_expired_certificate_opens_nothing(tmp_path, monkeypatch):
    monkeypatch.setattr(client_certificate, "LIFETIME", timedelta(hours=-1))
    made = make_client_certificate(tmp_path, "anna", Role.MAINTAIN)
    with served_page(security=security_of(tmp_path)) as page:
        with pytest.raises((ssl.SSLError, ConnectionError)):
            browser_with(page, made).request("GET", "/api/me")
        assert me(browser_with(page))["ok"] is False


def test_a_session_ends_with_its_certificate_on_an_open_connection_too(tmp_path, monkeypatch):
    monkeypatch.setattr(client_certificate, "LIFETIME", timedelta(minutes=5))
    made = make_client_certificate(tmp_path, "anna", Role.OPERATE)
    with served_page(security=security_of(tmp_path)) as page:
        anna = browser_with(page, made)
        anna.log_in(certificate=True)
        assert me(anna)["user"] == "anna"
        page.server._access._date = lambda: time.time() + 301.0
        assert me(anna) == {"ok": False, "passwords": True}
        assert anna.request("POST", "/api/login", {"certificate": True})[0] == 403


def test_the_command_makes_a_certificate_for_a_user(tmp_path):
    words = ("console", "certificate", "--client", "anna", "--role", "operate", "--folder", str(tmp_path))
    done = shoal(*words)
    assert done.exit_code == 0, done.output
    assert f"anna may operate: import {tmp_path}/anna.p12 into the browser; its password: " in done.output
    assert "from its next start on" in done.output
    password = done.output.splitlines()[0].rpartition(" ")[2]
    assert pkcs12.load_key_and_certificates((tmp_path / "anna.p12").read_bytes(), password.encode())[1] is not None
    assert Users(tmp_path).roles() == {"anna": Role.OPERATE}
    again = shoal(*words)
    assert (again.exit_code, "--force replaces it" in again.output) == (2, True), again.output
    assert shoal(*words, "--force").exit_code == 0  # for another device
    (tmp_path / "client-authority-key.pem").write_text("nonsense")
    broken = shoal(*words, "--force")
    assert (broken.exit_code, "client-authority.pem: not a certificate with its key" in broken.output) == (2, True)


@pytest.mark.parametrize(
    ("words", "text"),
    [
        (("--client", "anna"), "name a user and a role"),
        (("--role", "watch"), "name a user and a role"),
        (("--client", "../x", "--role", "watch"), "cannot be the name of a user"),
        (("vehicle.example", "--client", "anna", "--role", "watch"), "not for names of a computer"),
    ],
)
def test_a_mistake_is_named_and_leaves_no_file(tmp_path, words, text):
    done = shoal("console", "certificate", *words, "--folder", str(tmp_path))
    assert (done.exit_code, text in done.output) == (2, True), done.output
    assert not any(tmp_path.iterdir())


def test_a_page_whose_certificate_lacks_its_address_says_how_to_make_a_right_one(tmp_path):
    Users(tmp_path).add("anna", Role.OPERATE, PASSWORD)
    make_certificate(tmp_path, ["old.example"])
    command = f"shoal console certificate --force --folder {tmp_path}"
    for address in ("10.0.0.7", "0.0.0.0"):
        notice = read_page_security(address, tmp_path).notice
        assert notice.startswith("the certificate of the page names none of ")
        assert notice.endswith(command)
    make_certificate(tmp_path, ["10.0.0.7"])
    assert read_page_security("10.0.0.7", tmp_path).notice == ""


def test_one_certificate_too_many_leaves_the_file_of_the_one_before(tmp_path):
    for _ in range(MOST_CERTIFICATES):
        made = make_client_certificate(tmp_path, "anna", Role.OPERATE, replaces=True)
    before = made.path.read_bytes()
    with pytest.raises(ValueError, match="anna has 8 certificates"):
        make_client_certificate(tmp_path, "anna", Role.OPERATE, replaces=True)
    assert made.path.read_bytes() == before
