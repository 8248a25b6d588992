"""Users of the page: passwords, roles, and the file that has them."""

import asyncio

import pytest

from shoal.console import Access, LoginError, Role, Users, UsersError


def test_a_user_has_a_password_and_a_role(tmp_path):
    users = Users(tmp_path)
    assert not users
    users.add("anna", Role.OPERATE, "correct horse")
    users.add("ben", Role.WATCH, "battery staple")
    found = users.check("anna", "correct horse")
    assert (found.name, found.role) == ("anna", Role.OPERATE)
    for name, password in (("anna", "battery staple"), ("ben", ""), ("clara", ""), ("", ""), ("anna", "\ud800" * 300)):
        assert users.check(name, password) is None
    assert users.roles() == {"anna": Role.OPERATE, "ben": Role.WATCH}


def test_the_file_has_no_password_and_only_its_owner_can_read_it(tmp_path):
    users = Users(tmp_path)
    users.add("anna", Role.OPERATE, "correct horse")
    assert users.path.stat().st_mode & 0o777 == 0o600
    assert "correct" not in users.path.read_text()
    users.path.chmod(0o640)
    with pytest.raises(UsersError, match="chmod 600"):
        Users(tmp_path)


def test_a_changed_file_counts_at_once(tmp_path):
    served, edited = Users(tmp_path), Users(tmp_path)
    edited.add("anna", Role.OPERATE, "correct horse")
    assert served.find("anna").role is Role.OPERATE
    edited.add("anna", Role.WATCH, "correct horse")
    assert served.find("anna").role is Role.WATCH
    edited.remove("anna")
    assert served.find("anna") is None
    with pytest.raises(UsersError, match="no user"):
        edited.remove("anna")


def test_users_are_read_without_computing_a_password(tmp_path, monkeypatch):
    Users(tmp_path).add("anna", Role.OPERATE, "correct horse")
    with monkeypatch.context() as patch:
        patch.setattr("shoal.console.access.users.hashlib.scrypt", None)
        users = Users(tmp_path)
    assert users.check("nobody", "") is None
    assert users.check("anna", "correct horse") is not None


@pytest.mark.parametrize("name", ["", "a b", "a:b", "../x", "local", "ä", "x" * 33, "a\n"])
def test_a_name_that_cannot_be_one_is_rejected(tmp_path, name):
    with pytest.raises(UsersError, match="cannot be the name"):
        Users(tmp_path).add(name, Role.WATCH, "correct horse")


def test_a_short_password_is_rejected(tmp_path):
    with pytest.raises(UsersError, match="8 to 256"):
        Users(tmp_path).add("anna", Role.WATCH, "1234567")


@pytest.mark.parametrize(
    "line",
    [
        "anna",
        "anna:operate:secret",
        "anna:king:scrypt$16384$AA==$AA==",
        "anna:watch:scrypt$99999999$AA==$AA==",
        "anna:watch:scrypt$x$AA==$AA==",
        "anna:watch:scrypt$16383$AA==$AA==",
        "local:watch:scrypt$16384$AA==$AA==",
        "a b:watch:scrypt$16384$AA==$AA==",
        "anna:watch:scrypt$16384$A$AA==",
    ],
)
def test_a_damaged_line_is_named_and_lets_nobody_in(tmp_path, line):
    users = Users(tmp_path)
    users.add("ben", Role.WATCH, "correct horse")
    users.path.write_text(f"\n{line}\n")
    assert users.check("ben", "correct horse") is None
    with pytest.raises(UsersError, match=r"users\.txt:2: not NAME:ROLE"):
        Users(tmp_path)


def test_a_file_that_is_edited_in_place_counts_at_once_and_a_damaged_one_ends_no_session(tmp_path):
    """While the file is damaged nobody may do anything; when it is repaired, sessions are there again."""
    users = Users(tmp_path)
    users.add("anna", Role.OPERATE, "correct horse")
    access = Access(users=users)
    secret = asyncio.run(access.login_user("anna", "correct horse"))
    before = users.path.read_text()
    with users.path.open("r+") as edited:
        edited.write(before.replace("operate", "watch  "))  # as long as before
    assert access.session(secret) is None
    assert "users.txt:1: not NAME:ROLE" in users.trouble
    with pytest.raises(LoginError, match="the file of users is damaged"):
        asyncio.run(access.login_user("anna", "correct horse"))
    users.path.write_text(before.replace("operate", "watch"))
    assert access.session(secret).user.role is Role.WATCH
    users.path.write_text("")
    assert access.session(secret) is None
    users.path.write_text(before)
    assert access.session(secret) is None, "she was removed"
