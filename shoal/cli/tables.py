"""Shared by `check`, `explain`, `tasks` and `message`: options, tables, and the look-up of names."""

from difflib import get_close_matches
from pathlib import Path

import click
from rich.console import Console
from rich.table import Table

from runtime.task import Task
from runtime.vehicle import TaskImportError, find_task

config_dir_option = click.option(
    "-d", "--config-dir", multiple=True, type=click.Path(path_type=Path), help="A folder with profiles."
)
modes_option = click.option("-p", "--profiles", multiple=True, help="Modes to select, such as Simulation.")
overrides_option = click.option(
    "--set", "overrides", multiple=True, metavar="SECTION:OPTION=VALUE", help="Override a value."
)


def open_console() -> Console:
    """A console as wide as the terminal; 200 columns for a file or a pipe."""
    console = Console(highlight=False)
    return console if console.is_terminal else Console(highlight=False, width=200)


def plain_table(*columns: str) -> Table:
    table = Table(box=None, header_style="dim", pad_edge=False)
    for number, column in enumerate(columns):
        table.add_column(column, overflow="fold", no_wrap=number == 0)
    return table


def sentence(cls: type) -> str:
    """The first line of a docstring."""
    return (cls.__doc__ or "").strip().partition("\n")[0]


def range_text(low: float | None, high: float | None) -> str:
    if low is None and high is None:
        return ""
    return f"{'-inf' if low is None else f'{low:g}'} to {'inf' if high is None else f'{high:g}'}"


def choose(name: str, known: dict[str, type], what: str) -> str:
    """The key of `known` that `name` means, ignoring case and module; `what` it is called in errors.

    Raises ClickException if there is none.
    """
    if name in known:
        return name
    folded = {word: key for key in known for word in (key.lower().rpartition(".")[2], key.lower())}
    if name.lower() in folded:
        return folded[name.lower()]
    close = dict.fromkeys(folded[key] for key in get_close_matches(name.lower(), folded, 3, 0.5))
    raise click.ClickException(
        f"there is no {what} {name!r}" + (f"; did you mean {', '.join(close)}?" if close else "")
    )


def task_of(section: str) -> type[Task] | None:
    """The task class of a section, None if there is none. Raises ClickException if it cannot be imported."""
    try:
        return find_task(section)
    except TaskImportError as error:
        raise click.ClickException(str(error)) from None
