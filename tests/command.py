"""The command `shoal` in the process of a test."""

from click.testing import CliRunner, Result

from shoal.cli import main


def shoal(*words: object, typed: str | None = None) -> Result:
    """The result of the command with these words, and with some text typed into it."""
    return CliRunner().invoke(main, [*map(str, words)], input=typed)
