"""The page at other addresses than loopback: only with users and a certificate."""

import os
import ssl

import pytest

from shoal.console import PageSecurityError, Role, Users, certificate_names, make_certificate, read_page_security
from tests.command import shoal

NAMES = ["vehicle.example", "10.0.0.7", "fd00::7"]


def test_on_loopback_nothing_is_needed(tmp_path):
    security = read_page_security("127.0.0.1", tmp_path)
    assert (security.is_open, security.scheme, security.hosts) == (False, "http", ("127.0.0.1", "localhost"))


def test_elsewhere_it_names_the_commands_that_are_missing(tmp_path):
    with pytest.raises(PageSecurityError) as error:
        read_page_security("0.0.0.0", tmp_path)
    assert f"shoal console user NAME --role operate --folder {tmp_path}" in str(error.value)
    assert f"shoal console certificate --folder {tmp_path}" in str(error.value)
    Users(tmp_path).add("anna", Role.OPERATE, "correct horse")
    with pytest.raises(PageSecurityError) as error:
        read_page_security("10.0.0.7", tmp_path)
    assert "console user" not in str(error.value)
    make_certificate(tmp_path, NAMES)
    security = read_page_security("10.0.0.7", tmp_path)
    assert (security.is_open, security.scheme) == (True, "https")
    assert security.hosts == ("10.0.0.7", "vehicle.example", "fd00::7", "127.0.0.1", "localhost")


def test_the_certificate_has_its_names_and_a_private_key(tmp_path):
    fingerprint = make_certificate(tmp_path, NAMES)
    assert len(fingerprint.split(":")) == 32
    assert certificate_names(tmp_path / "certificate.pem") == ["vehicle.example", "10.0.0.7", "fd00::7"]
    assert (tmp_path / "key.pem").stat().st_mode & 0o777 == 0o600
    ssl.create_default_context(ssl.Purpose.CLIENT_AUTH).load_cert_chain(
        tmp_path / "certificate.pem", tmp_path / "key.pem"
    )


def test_a_certificate_that_does_not_fit_its_key_is_named(tmp_path):
    Users(tmp_path).add("anna", Role.OPERATE, "correct horse")
    make_certificate(tmp_path, NAMES)
    certificate = (tmp_path / "certificate.pem").read_bytes()
    make_certificate(tmp_path, NAMES)
    for content in (certificate, b"nonsense"):
        (tmp_path / "certificate.pem").write_bytes(content)
        with pytest.raises(PageSecurityError, match=r"certificate\.pem: not the certificate of"):
            read_page_security("10.0.0.7", tmp_path)


def test_the_commands_make_users_and_a_certificate(tmp_path):
    folder = ("--folder", str(tmp_path))
    done = shoal("console", "--address", "0.0.0.0", *folder)
    assert (done.exit_code, "shoal console user NAME --role operate" in done.output) == (2, True), done.output
    done = shoal("console", "user", "anna", "--role", "operate", *folder, typed="correct horse\n")
    assert (done.exit_code, done.output) == (0, f"anna may operate: {tmp_path}/users.txt\n")
    assert shoal("console", "user", *folder).output == "anna  operate\n"
    assert Users(tmp_path).check("anna", "correct horse").role is Role.OPERATE
    done = shoal("console", "certificate", "vehicle.example", *folder)
    assert done.exit_code == 0, done.output
    assert f"{tmp_path}/certificate.pem: for vehicle.example\nSHA-256 " in done.output
    done = shoal("console", "certificate", *folder)
    assert (done.exit_code, "--force replaces it" in done.output) == (2, True), done.output
    assert read_page_security("0.0.0.0", tmp_path).hosts[0] == "vehicle.example"
    done = shoal("console", "user", "anna", "--remove", *folder)
    assert (done.exit_code, Users(tmp_path).roles()) == (0, {}), done.output


@pytest.mark.parametrize(
    ("words", "text"),
    [
        (("user", "anna"), "name a role: --role watch, operate, maintain"),
        (("user", "--remove"), "name a user"),
        (("user", "a b", "--role", "watch"), "cannot be the name of a user"),
        (("user", "anna", "--role", "watch"), "a password has 8 to 256 characters"),
        (("user", "ben", "--remove"), "there is no user"),
        (("certificate", "a\nb"), "neither the name nor the address of a computer"),
        (("--address", "nonsense"), "nonsense"),
    ],
)
def test_a_mistake_is_named(tmp_path, words, text):
    done = shoal("console", *words, "--folder", str(tmp_path), typed="short\n")
    assert (done.exit_code, text in done.output) == (2, True), done.output
    assert not any(tmp_path.iterdir())


@pytest.mark.parametrize("name", ["users.txt", "certificate.pem", "key.pem"])
def test_a_vehicle_does_not_wait_for_a_pipe_in_place_of_a_file_of_its_page(tmp_path, name):
    Users(tmp_path).add("anna", Role.WATCH, "correct horse")
    make_certificate(tmp_path, ["10.0.0.2"])
    (tmp_path / name).unlink()
    os.mkfifo(tmp_path / name, 0o600)
    with pytest.raises(OSError, match="not a regular file") as caught:
        read_page_security("10.0.0.2", tmp_path)
    assert caught.value.filename == str(tmp_path / name)
