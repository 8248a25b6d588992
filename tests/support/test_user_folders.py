"""Folders of the user."""

from pathlib import Path

import pytest

from runtime.profile.profile_search import user_etc
from support.user_folders import cache_folder


@pytest.mark.parametrize(
    ("named", "found"), [("/a", "/a/shoal"), ("a", "/home/ada/.cache/shoal"), ("", "/home/ada/.cache/shoal")]
)
def test_the_cache_is_where_xdg_has_it(monkeypatch: pytest.MonkeyPatch, named: str, found: str) -> None:
    monkeypatch.setenv("HOME", "/home/ada")
    monkeypatch.setenv("XDG_CACHE_HOME", named)
    assert cache_folder() == Path(found)


def test_a_relative_folder_of_configurations_counts_as_none(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.delenv("SHOAL_ETC", raising=False)
    monkeypatch.setenv("HOME", "/home/ada")
    monkeypatch.setenv("XDG_CONFIG_HOME", "settings")
    assert user_etc() == Path("/home/ada/.config/shoal/etc")
