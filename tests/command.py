"""The command `shoal` in the process of a test."""

from click.testing import CliRunner, Result

from shoal.cli import main


def shoal(*words: object, typed: str | None = None) -> Result:
    """What came of the command with these words, and with what was typed into it."""
    return CliRunner().invoke(main, [*map(str, words)], input=typed)
