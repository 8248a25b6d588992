"""One-time links, sessions, and the limit of logins."""

import asyncio

import pytest

from shoal.console import Access, LoginError, Role, Users


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


def test_a_user_logs_in_with_a_password_and_is_out_when_removed(clock, tmp_path):
    users = Users(tmp_path)
    users.add("anna", Role.OPERATE, "correct horse")
    access = Access(clock, users)
    secret = asyncio.run(access.login_user("anna", "correct horse"))
    assert access.session(secret).user.name == "anna"
    users.add("anna", Role.WATCH, "correct horse")
    assert access.session(secret).user.role is Role.WATCH
    users.remove("anna")
    assert access.session(secret) is None


def test_another_password_ends_the_sessions_of_its_user(clock, tmp_path):
    users = Users(tmp_path)
    for name in ("anna", "ben"):
        users.add(name, Role.OPERATE, "correct horse")
    access = Access(clock, Users(tmp_path))
    anna, ben = (asyncio.run(access.login_user(name, "correct horse")) for name in ("anna", "ben"))
    users.add("anna", Role.OPERATE, "battery staple")
    assert (access.session(anna), access.session(ben).user.name) == (None, "ben")


@pytest.mark.parametrize(("name", "password"), [("anna", "wrong"), ("ben", "correct horse"), (None, None), (3, [])])
def test_a_wrong_name_or_password_is_rejected_in_the_same_words(clock, tmp_path, name, password):
    users = Users(tmp_path)
    users.add("anna", Role.OPERATE, "correct horse")
    for access in (Access(clock, users), Access(clock)):
        with pytest.raises(LoginError, match=r"^wrong name or password$"):
            asyncio.run(access.login_user(name, password))


def test_who_guesses_shuts_out_nobody_at_another_address(clock):
    access = Access(clock)
    for _ in range(20):
        with pytest.raises(LoginError):
            access.login("guess", "10.0.0.9")
    assert access.is_logged_in(access.login(access.make_link_token(), "10.0.0.7"))
