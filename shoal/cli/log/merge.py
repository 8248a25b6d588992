"""`shoal log merge`: merges several logs into one."""

from pathlib import Path

import click

from shoal.cli.log.log_input import (
    LOG,
    errors_as_messages,
    fail_if_most_is_lost,
    open_log,
    progress_bar,
    report_losses,
)
from shoal.logs.edit import merge as merge_logs
from shoal.logs.inspect import format_noun_count
from support.terminal_text import printable


@click.command()
@click.argument("logs", type=LOG, nargs=-1, required=True)
@click.option("-o", "--out", type=LOG, required=True, help="The new folder.")
@click.option("--copies", is_flag=True, help="Keep all copies of a packet that is in several logs.")
def merge(logs: tuple[Path, ...], out: Path, copies: bool) -> None:
    """Merge all LOGS into the new folder OUT, ordered by time.

    Exit status 1 if most of a log could not be read: the rest is written.
    """
    with errors_as_messages():
        opened = [open_log(path) for path in logs]
        with progress_bar(opened[0].path, "merging") as advance:
            merged = merge_logs(opened, out, copies, advance)
    left = f"; {format_noun_count(merged.copies, 'duplicate')} skipped" if merged.copies else ""
    click.echo(
        printable(
            f"{format_noun_count(merged.packets, 'message')} from {format_noun_count(len(logs), 'log')}{left}: {out}"
        )
    )
    for warning in merged.warnings:
        click.echo(printable(f"warning: {warning}; readers use only one of them"), err=True)
    report_losses(merged.losses)
    for path, kept in merged.read:
        lost = sum(loss.length for of, loss in merged.losses if of == path)  # integers
        fail_if_most_is_lost(str(path), kept, lost)
