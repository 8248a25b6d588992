"""`shoal log report`: a log as an HTML page."""

from pathlib import Path

import click

from shoal.cli.log.log_input import (
    LOG,
    errors_as_messages,
    logs_of_argument,
    open_log,
    progress_bar,
    run_selection_options,
)
from shoal.logs.inspect import format_size
from shoal.logs.inspect import render_report as draw
from support.file_errors import add_path_to_errors
from support.terminal_text import printable


@click.command()
@click.argument("log", type=LOG, required=False)
@run_selection_options("log")
@click.option("-o", "--out", type=LOG, help="The page [default: report.html in the folder of the log]")
def report(log: Path, out: Path | None) -> None:
    """Draw LOG as one HTML page that needs no other file and no network."""
    with errors_as_messages():
        opened = open_log(log)
        with progress_bar(opened.path) as tell:
            text = draw(opened, tell)
        logs = logs_of_argument(log)
        out = out or (opened.path.parent / "report.html" if len(logs) == 1 else logs[0] / "report-run.html")
        with add_path_to_errors(out):
            out.write_text(text, encoding="utf-8")
    click.echo(printable(f"{format_size(len(text.encode()))}: {out}"))
