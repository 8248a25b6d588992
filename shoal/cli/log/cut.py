"""`shoal log cut`: copies a part of a log to a new one."""

from pathlib import Path

import click

from runtime.logs import summarize
from shoal.cli.log.log_input import (
    LOG,
    errors_as_messages,
    fail_if_most_is_lost,
    open_log,
    progress_bar,
    report_losses,
    require_messages,
    run_selection_options,
)
from shoal.cli.log.selection_options import TIMES, parse_log_time, split_names
from shoal.logs.edit import cut as cut_log
from shoal.logs.inspect import format_noun_count, format_time
from shoal.logs.selection import selection_from_names
from support.terminal_text import printable


@click.command(
    epilog="-m, -s and -e can be repeated, or take several names separated by commas; `shoal log info` lists them. "
    "The messages that describe a log (Announce, EntityInfo, EntityList, LoggingControl) are always kept."
)
@click.argument("log", type=LOG)
@click.argument("out", type=LOG)
@run_selection_options("log")
@click.option("--from", "begin", metavar="TIME", help=f"Start: {TIMES}.")
@click.option("--to", "end", metavar="TIME", help="End, not included; written as --from.")
@click.option("-m", "--messages", multiple=True, help="Messages, by name or id.")
@click.option("-s", "--systems", multiple=True, help="Systems, by name or id.")
@click.option("-e", "--entities", multiple=True, help="Entities, by label or id.")
def cut(
    log: Path,
    out: Path,
    begin: str | None,
    end: str | None,
    messages: tuple[str, ...],
    systems: tuple[str, ...],
    entities: tuple[str, ...],
) -> None:
    """Copy a part of LOG to the new folder OUT; packets stay unchanged.

    Exit status 1 if most of LOG could not be read: the rest is written.
    """
    with errors_as_messages():
        opened = open_log(log)
        with progress_bar(opened.path) as advance:
            summary = summarize(opened, advance)
        require_messages(opened, summary.packets)
        start, stop = (parse_log_time(text, summary.start, summary.end) for text in (begin, end))
        if start is not None and stop is not None and stop <= start:
            raise click.ClickException("--to must be after --from")
        choice = selection_from_names(
            summary, start, stop, split_names(messages), split_names(systems), split_names(entities)
        )
        if (start is not None and start > summary.end) or (stop is not None and stop <= summary.start):
            raise click.ClickException(
                f"the log covers only {format_time(summary.start)} to {format_time(summary.end)}"
            )
        with progress_bar(opened.path, "cutting") as advance:
            done = cut_log(opened, out, choice, summary.owner, advance)
    kept = f", and {format_noun_count(done.kept, 'message')} that describe the log" if done.kept else ""
    click.echo(printable(f"{format_noun_count(done.chosen, 'message')}{kept}: {out}"))
    report_losses([(opened.path, loss) for loss in summary.losses])
    lost = sum(loss.length for loss in summary.losses)  # integers
    fail_if_most_is_lost(str(opened.path), summary.unpacked - lost, lost)
