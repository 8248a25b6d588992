"""Two operators in two browsers on the vehicle's own page: passwords, and the lease that goes from one to the other."""

import json
import re

import pytest

from shoal.console import Role, Users
from tests.outside import until
from tests.shoal.console.browser import Browser, browser
from tests.shoal.console.operator_page import vehicle_page

PASSWORD = "correct horse"

pytestmark = pytest.mark.browser


def log_in(tab: Browser, address: str, name: str) -> None:
    tab.open(address)
    until(lambda: tab.run("!document.getElementById('login').hidden"), told=lambda: tab.text("#result"))

    def give(password: str) -> None:
        for field, value in (("user", name), ("password", password)):
            tab.run(f"document.getElementById('{field}').value = {json.dumps(value)}")
        tab.press("#login button")

    give("wrong")
    # The refusal stays when the page asks again whether it is logged in.
    until(lambda: re.search(r"^(?!Log in).+\. Log in:", tab.text("#result")), told=lambda: tab.text("#result"))
    give(PASSWORD)
    until(lambda: tab.text("#me") == f"{name} (operate)", told=lambda: tab.text("#result"))
    until(lambda: "service" in tab.text("#summary"), 60.0, told=lambda: tab.text("#summary"))


def lease(tab: Browser) -> str:
    return tab.text("#lease")


def test_two_operators_hand_over_the_lease(tmp_path):
    for name in ("anna", "ben"):
        Users(tmp_path).add(name, Role.OPERATE, PASSWORD)
    with (
        vehicle_page(tmp_path, "--set", f"Transports.Console:Access Folder={tmp_path}") as served,
        browser(tmp_path / "anna") as anna,
        browser(tmp_path / "ben") as ben,
    ):
        for tab, name in ((anna, "anna"), (ben, "ben")):
            tab.set_size(1280, 800)
            log_in(tab, f"http://{served.host}/", name)
            until(lambda tab=tab: tab.run("!document.getElementById('lease-take').hidden"))
        assert lease(anna) == "nobody commands"
        anna.press("#lease-take")
        until(lambda: (lease(anna), lease(ben)) == ("you command", "anna commands"))
        for _ in range(2):
            ben.press("#hold")
        until(lambda: "NOT OBEYED: anna commands this vehicle" in ben.text("#result"), told=lambda: ben.text("#result"))
        ben.press("#lease-take")
        until(lambda: "you command; ben asks for it" in lease(anna), told=lambda: lease(anna))
        assert anna.text("#lease-give") == "Hand over to ben"
        anna.press("#lease-give")
        until(lambda: (lease(ben), lease(anna)) == ("you command", "ben commands"))
        for _ in range(2):
            anna.press("#abort")
        until(lambda: "mode" in anna.text("#result"), told=lambda: anna.text("#result"))
        assert anna.text("#result").startswith("lauv-noptilus-1: obeyed")
        ben.press("#logout")
        until(lambda: ben.text("#me") == "" and ben.run("document.getElementById('login')?.hidden === false"))
        until(lambda: lease(anna) == "nobody commands", 45.0, told=lambda: lease(anna))
        refused = "403"  # the wrong passwords
        assert not [each for each in (*anna.errors, *ben.errors) if refused not in each]
