"""The help lists all commands, each once, by their use."""

from shoal.cli import COMMANDS, GROUPS
from tests.command import shoal


def test_the_help_lists_each_command_once_by_its_use():
    grouped = [name for names in GROUPS.values() for name in names]
    assert sorted(grouped) == sorted(COMMANDS)
    text = shoal("--help").output
    places = [text.index(f"{title}:") for title in GROUPS]
    assert places == sorted(places)
    assert all(f"\n  {name} " in text for name in COMMANDS)
    assert "docs/README.md" in text
