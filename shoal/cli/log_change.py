"""`shoal log cut` and `merge`: make new logs from others."""

from datetime import UTC, datetime
from pathlib import Path

import click

import imc
from runtime.logs import summarize
from shoal.cli.log_open import LOG, check_found, open_log, progress, refusals, takes_runs
from shoal.logs.edit import cut as cut_log
from shoal.logs.edit import merge as merge_logs
from shoal.logs.inspect import format_count, format_time
from shoal.logs.selection import select_by_names
from support.durations import parse_duration
from support.text import printable

TIMES = "a time since the start of the log (90, 1h30min), before its end (-30s), or a date (2026-01-01T00:05:00)"


@click.command(
    epilog="-m, -s and -e can be repeated, or take several names separated by commas; `shoal log info` lists them. "
    "The messages that describe a log (Announce, EntityInfo, EntityList, LoggingControl) are always kept."
)
@click.argument("log", type=LOG)
@click.argument("out", type=LOG)
@takes_runs("log")
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
    """Copy a part of LOG to the new folder OUT; packets stay unchanged."""
    with refusals():
        opened = open_log(log)
        with progress(opened.path) as tell:
            summary = summarize(opened, tell)
        check_found(opened, summary.packets)
        start, stop = (read_time(text, summary.start, summary.end) for text in (begin, end))
        if start is not None and stop is not None and stop <= start:
            raise click.ClickException("--to must be after --from")
        choice = select_by_names(
            summary, start, stop, split_words(messages), split_words(systems), split_words(entities)
        )
        if (start is not None and start > summary.end) or (stop is not None and stop <= summary.start):
            raise click.ClickException(
                f"the log covers only {format_time(summary.start)} to {format_time(summary.end)}"
            )
        with progress(opened.path, "cutting") as tell:
            done = cut_log(opened, out, choice, summary.owner, tell)
    kept = f", and {format_count(done.kept, 'message')} that describe the log" if done.kept else ""
    click.echo(printable(f"{format_count(done.chosen, 'message')}{kept}: {out}"))
    _tell_losses([(opened.path, loss) for loss in summary.losses])


@click.command()
@click.argument("logs", type=LOG, nargs=-1, required=True)
@click.option("-o", "--out", type=LOG, required=True, help="The new folder.")
@click.option("--copies", is_flag=True, help="Keep all copies of a packet that is in several logs.")
def merge(logs: tuple[Path, ...], out: Path, copies: bool) -> None:
    """Merge all LOGS into the new folder OUT, ordered by time."""
    with refusals():
        opened = [open_log(path) for path in logs]
        with progress(opened[0].path, "merging") as tell:
            merged = merge_logs(opened, out, copies, tell)
    left = f"; {format_count(merged.copies, 'duplicate')} skipped" if merged.copies else ""
    click.echo(
        printable(f"{format_count(merged.packets, 'message')} from {format_count(len(logs), 'log')}{left}: {out}")
    )
    for warning in merged.warnings:
        click.echo(printable(f"warning: {warning}; readers use only one of them"), err=True)
    _tell_losses(merged.losses)


def _tell_losses(losses: list[tuple[Path, imc.Loss]]) -> None:
    for path, (offset, length, reason) in losses[:20]:
        click.echo(printable(f"skipped: {path}: byte {offset}: {format_count(length, 'byte')}: {reason}"), err=True)
    if len(losses) > 20:
        click.echo(f"skipped: {format_count(len(losses) - 20, 'more damaged place')}", err=True)


def split_words(words: tuple[str, ...]) -> list[str]:
    """The names in an option that can be repeated, or has several separated by commas."""
    return [word.strip() for text in words for word in text.split(",") if word.strip()]


def read_time(text: str | None, start: float, end: float) -> float | None:
    """Read a time as in TIMES; the result, start and end of the log are in s since 1970 UTC. Raises ValueError."""
    if text is None:
        return None
    try:
        return end - parse_duration(text[1:]) if text.startswith("-") else start + parse_duration(text)
    except ValueError:
        pass
    try:
        time = datetime.fromisoformat(text.removesuffix(" UTC"))
    except ValueError:
        raise ValueError(f"{text!r} is not a time; write {TIMES}") from None
    return (time if time.tzinfo else time.replace(tzinfo=UTC)).timestamp()
