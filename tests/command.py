"""The command `shoal` in the process of a test."""

from click.testing import CliRunner, Result

from shoal.cli import main


def shoal(*words: object) -> Result:
    """What came of the command with these words."""
    return CliRunner().invoke(main, [*map(str, words)])
