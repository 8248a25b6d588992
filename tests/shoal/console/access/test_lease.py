"""Leases: one session commands a vehicle, the others watch."""

import pytest

from shoal.console import LeaseError, Leases
from tests.shoal.console.access.test_page_sessions import Clock

ANNA, BEN, CLARA = (1, "anna"), (2, "ben"), (3, "clara")


@pytest.fixture
def told():
    return []


@pytest.fixture
def clock():
    return Clock()


@pytest.fixture
def leases(told, clock):
    return Leases(lambda vehicle, text: told.append(f"{vehicle}: {text}"), clock)


def test_the_first_order_takes_a_free_lease_and_others_are_rejected(leases, told):
    leases.require("lauv", *ANNA)
    leases.require("lauv", *ANNA)
    with pytest.raises(LeaseError, match="anna commands this vehicle"):
        leases.require("lauv", *BEN)
    leases.require("otter", *BEN)
    assert leases.view() == {"lauv": {"session": 1, "user": "anna"}, "otter": {"session": 2, "user": "ben"}}
    assert told == ["lauv: anna takes the lease", "otter: ben takes the lease"]


def test_a_second_session_of_one_user_is_another_one(leases):
    leases.require("lauv", *ANNA)
    with pytest.raises(LeaseError):
        leases.require("lauv", 4, "anna")


def test_a_lease_ends_30_s_after_the_page_of_its_holder(leases, told, clock):
    leases.require("lauv", *ANNA)
    clock.now += 29.0
    leases.see(1)
    clock.now += 29.0
    assert "lauv" in leases.view()
    clock.now += 1.0
    assert leases.view() == {}
    assert told[-1] == "lauv: the lease of anna ends: its pages are closed"
    leases.require("lauv", *BEN)


def test_a_lease_is_handed_over_to_who_asks(leases, told):
    leases.take("lauv", *ANNA)
    assert leases.take("lauv", *BEN) == "anna has been asked: it is yours in 30 s, unless anna keeps it"
    with pytest.raises(LeaseError, match="ben has asked"):
        leases.take("lauv", *CLARA)
    assert leases.view()["lauv"] == {"session": 1, "user": "anna", "by": 2, "asked": "ben", "left": 30}
    with pytest.raises(LeaseError, match="anna commands"):
        leases.hand_over("lauv", 2)
    assert leases.hand_over("lauv", 1) == "ben commands this vehicle now"
    leases.require("lauv", *BEN)
    assert told == ["lauv: anna takes the lease", "lauv: ben asks anna for the lease", "lauv: ben takes the lease"]


def test_a_request_passes_after_30_s_unless_the_holder_keeps_the_lease(leases, clock):
    leases.take("lauv", *ANNA)
    leases.take("lauv", *BEN)
    clock.now += 20.0
    leases.see(1)
    assert leases.keep("lauv", 1) == "you command this vehicle"
    clock.now += 20.0
    leases.see(1)
    leases.require("lauv", *ANNA)
    leases.take("lauv", *BEN)
    clock.now += 30.0
    leases.see(1)
    assert leases.view()["lauv"] == {"session": 2, "user": "ben"}


def test_a_lease_is_given_up(leases):
    leases.take("lauv", *ANNA)
    assert leases.hand_over("lauv", 1) == "nobody commands this vehicle now"
    with pytest.raises(LeaseError, match="nobody commands"):
        leases.keep("lauv", 1)
    leases.require("lauv", *BEN)


@pytest.mark.parametrize("asks", [True, False])
def test_a_session_that_ends_after_its_lease_leaves_nothing_and_fails_not(leases, told, clock, asks):
    leases.require("lauv", *ANNA)
    if asks:
        leases.take("lauv", *BEN)
    clock.now += 30.0
    leases.leave(1)
    assert [found["user"] for found in leases.view().values()] == (["ben"] if asks else [])
    assert told[-1] == ("lauv: ben takes the lease" if asks else "lauv: the lease of anna ends: its pages are closed")
