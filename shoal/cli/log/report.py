"""`shoal log report`: a log as an HTML page."""

from pathlib import Path

import click

import imc
from shoal.cli.log.log_input import (
    LOG,
    errors_as_messages,
    logs_of_argument,
    open_log,
    progress_bar,
    run_selection_options,
)
from shoal.logs.inspect import format_size, read_chart_reference, render_comparison, render_report
from support.atomic_files import write_output
from support.terminal_text import printable


@click.command()
@click.argument("log", type=LOG, required=False)
@click.argument("other", type=LOG, required=False)
@run_selection_options("log", optional=("other",))
@click.option(
    "--plot",
    "fields",
    multiple=True,
    metavar="MESSAGE.FIELD[:ENTITY]",
    help="Plot a field, too, of all entities or one; may be repeated.",
)
@click.option("-o", "--out", type=LOG, help="The page [default: in the folder of LOG, report.html or compared.html]")
def report(log: Path, other: Path | None, fields: tuple[str, ...], out: Path | None) -> None:
    """Draw LOG as one HTML page that needs no other file and no network; with OTHER, both runs over each other."""
    with errors_as_messages():
        opened = open_log(log)
        if other is None:
            with progress_bar(opened.path) as advance:
                text = render_report(opened, advance, fields)
        else:
            text = render_comparison([opened, open_log(other)], fields)
        logs = logs_of_argument(log)
        out = out or _default_page(opened, logs, other)
        write_output(out, text.encode())
    if other is None and (chart := read_chart_reference(logs[0])) is not None and not chart.is_found:
        click.echo(printable(f"detections are not compared with the truth: the chart {chart.describe()}"), err=True)
    click.echo(printable(f"{format_size(len(text.encode()))}: {out}"))


def _default_page(opened: imc.Log, logs: list[Path], other: Path | None) -> Path:
    folder = opened.path.parent if len(logs) == 1 else logs[0]
    if other is not None:
        return folder / "compared.html"
    return folder / ("report.html" if len(logs) == 1 else "report-run.html")
