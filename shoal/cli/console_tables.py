"""Output of commands: tables, sentences, ranges; and the look-up of names."""

from difflib import get_close_matches

import click
from rich.console import Console
from rich.table import Table

from runtime.task import Task
from runtime.vehicle import TaskImportError, find_task


def open_console(*, markup: bool = True) -> Console:
    """A console as wide as the terminal; 200 columns for a file or a pipe."""
    width = None if Console().is_terminal else 200
    return Console(highlight=False, markup=markup, emoji=False, width=width)


def plain_table(*columns: str, right: tuple[str, ...] = ()) -> Table:
    """A table without lines; the columns in `right` hold numbers."""
    table = Table(box=None, header_style="dim", pad_edge=False)
    for place, column in enumerate(columns):
        table.add_column(column, overflow="fold", no_wrap=place == 0, justify="right" if column in right else "left")
    return table


def first_sentence(cls: type) -> str:
    """The first line of a docstring."""
    return (cls.__doc__ or "").strip().partition("\n")[0]


def format_range(low: float | None, high: float | None) -> str:
    if low is None and high is None:
        return ""
    return f"{'-inf' if low is None else f'{low:g}'} to {'inf' if high is None else f'{high:g}'}"


def resolve_name(name: str, known: dict[str, type], what: str) -> str:
    """The key of `known` that `name` means, ignoring case and module; `what` it is called in errors.

    Raises ClickException if there is none.
    """
    if name in known:
        return name
    folded = {word: key for key in known for word in (key.lower().rpartition(".")[2], key.lower())}
    if name.lower() in folded:
        return folded[name.lower()]
    close = dict.fromkeys(folded[key] for key in get_close_matches(name.lower(), folded, 3, 0.65))
    raise click.ClickException(
        f"there is no {what} {name!r}" + (f"; did you mean {', '.join(close)}?" if close else "")
    )


def find_task_class(section: str) -> type[Task] | None:
    """The task class of a section, None if there is none. Raises ClickException if it cannot be imported."""
    try:
        return find_task(section)
    except TaskImportError as error:
        raise click.ClickException(str(error)) from None
