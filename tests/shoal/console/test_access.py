"""One-time links, sessions, and the limit of logins."""

import pytest

from shoal.console import Access, LoginError


class Clock:
    now = 1000.0

    def __call__(self) -> float:
        return self.now


@pytest.fixture
def clock() -> Clock:
    return Clock()


def test_a_link_logs_in_once(clock):
    access = Access(clock)
    token = access.make_link_token()
    secret = access.login(token)
    assert access.is_logged_in(secret)
    with pytest.raises(LoginError, match="has been used"):
        access.login(token)
    assert access.is_logged_in(secret)


def test_a_link_ends_after_ten_minutes(clock):
    access = Access(clock)
    token = access.make_link_token()
    clock.now += 601.0
    with pytest.raises(LoginError, match="older than ten minutes"):
        access.login(token)


@pytest.mark.parametrize("token", [None, 3, "", "ä", ["x"], "x" * 10_000, "\ud800"])
def test_a_wrong_token_is_rejected(clock, token):
    access = Access(clock)
    access.make_link_token()
    with pytest.raises(LoginError, match="used"):
        access.login(token)


def test_the_sixth_login_of_a_minute_waits(clock):
    access = Access(clock)
    for _ in range(5):
        with pytest.raises(LoginError, match="used"):
            access.login("guess")
    token = access.make_link_token()
    with pytest.raises(LoginError, match="wait a minute"):
        access.login(token)
    clock.now += 60.0
    assert access.is_logged_in(access.login(token))


def test_a_session_ends_when_it_is_not_used(clock):
    access = Access(clock)
    secret = access.login(access.make_link_token())
    clock.now += 11 * 3600.0
    assert access.is_logged_in(secret)
    clock.now += 11 * 3600.0
    assert access.is_logged_in(secret)
    clock.now += 13 * 3600.0
    assert not access.is_logged_in(secret)
    assert not access.is_logged_in(None)


def test_the_oldest_of_too_many_sessions_ends(clock):
    access = Access(clock)
    secrets = []
    for _ in range(65):
        clock.now += 60.0
        secrets.append(access.login(access.make_link_token()))
    assert [access.is_logged_in(each) for each in secrets[:2]] == [False, True]
