"""`shoal log ls`: lists the logs below a folder."""

from pathlib import Path

import click

from shoal.cli.console_tables import open_console, plain_table
from shoal.cli.json_output import json_option, print_json
from shoal.cli.log.log_input import LOG
from shoal.logs.inspect import format_duration, format_size, format_time, logs_below
from support.terminal_text import printable


@click.command()
@click.argument("folder", type=LOG, default=Path("log"))
@json_option
def ls(folder: Path, as_json: bool) -> None:
    """List the logs below FOLDER (log by default), one line each."""
    if not folder.exists():
        raise click.ClickException(printable(f"{folder}: there is no such folder"))
    found = logs_below(folder)
    if not found:
        raise click.ClickException(printable(f"{folder}: there are no logs in it"))
    if as_json:
        print_json([glance._asdict() for glance in found])
        return
    console = open_console(markup=False)
    table = plain_table("log", "system", "from", "duration", "size", "", right=("duration", "size"))
    for glance in found:
        path = glance.path.parent if glance.path.name.startswith("Data.lsf") else glance.path
        when = format_time(glance.start) if glance.start == glance.start else ""
        length = format_duration(glance.end - glance.start) if when else ""
        table.add_row(
            *map(printable, (str(path), glance.system, when, length, format_size(glance.size), glance.problem))
        )
    console.print(table)
