"""Shared by the commands of `shoal campaign`: types of arguments, and errors as messages."""

from collections.abc import Generator
from contextlib import contextmanager
from pathlib import Path

import click

from shoal.cli.optional_extra import require_extra
from support.file_errors import describe_os_error
from support.terminal_text import printable

FILE = click.Path(path_type=Path, dir_okay=False)
FOLDER = click.Path(path_type=Path, file_okay=False)


@contextmanager
def errors_as_messages() -> Generator[None]:
    """Turns what is wrong with files, values and data sets into one line."""
    with require_extra("campaigns"):
        try:
            yield
        except ValueError as error:
            raise click.ClickException(printable(str(error))) from None
        except OSError as error:
            raise click.ClickException(printable(describe_os_error(error))) from None


def last_line(error: str) -> str:
    """The last line of an error; the others are its place."""
    lines = error.strip().splitlines()
    return printable(lines[-1]) if lines else ""
