"""`shoal resim`: re-runs tasks on a log and shows the differences."""

import shlex
import sys
from collections.abc import Iterator
from pathlib import Path

import click
from rich.console import Console
from rich.table import Table

import imc
from shoal.cli.log.log_input import last_option
from shoal.cli.options import add_user_task_folders, code_of_log_option, virtual_clock_option
from shoal.logs.inspect import format_noun_count
from shoal.rerun import EntityMessage, MessageCount, Resimulation, ResimulationError, resimulate
from support.diagnostics import ProfileError
from support.file_errors import describe_os_error
from support.terminal_text import printable

PIPE_WIDTH = 160
HEADER = frozenset({*imc.Message.__struct_fields__})


@click.command()
@click.argument("log", type=click.Path(exists=True, path_type=Path), required=False)
@last_option
@click.option("-t", "--task", "tasks", multiple=True, required=True, help="Task: section, entity label or class.")
@click.option(
    "--set",
    "overrides",
    multiple=True,
    metavar="SECTION:OPTION=VALUE",
    help="Override an option, to see what would have changed.",
)
@code_of_log_option
@virtual_clock_option
@click.option("-c", "--config-file", help="Profile to use instead of the log's Config.ini.")
@click.option("-o", "--out", type=click.Path(path_type=Path), help="New folder for the log of the re-simulation.")
def resim(
    log: Path,
    tasks: tuple[str, ...],
    overrides: tuple[str, ...],
    code: tuple[Path, ...],
    config_file: str | None,
    out: Path | None,
) -> None:
    """Re-run tasks on LOG, using the logged messages of all other tasks, and compare what they publish with the log.

    For example: shoal resim log/lauv-noptilus-1/20260101/000000 --task Simulators.MUGDetectionCamera. For the log of a
    virtual run, the exit status is 1 if anything differs; for any log, if an input of a task is not in it. With --set,
    the command shows what would have changed; the other tasks do not react, as their messages come from the log.
    """
    add_user_task_folders(code, of_log=True)
    try:
        done = resimulate(imc.Log(log), tasks, overrides=overrides, profile=config_file, out=out)
    except (ResimulationError, ProfileError, imc.SchemaError) as error:
        raise click.ClickException(printable(str(error))) from None
    except OSError as error:
        raise click.ClickException(printable(describe_os_error(error, log))) from None
    print_comparison(done)
    if out is not None:
        click.echo(f"log of the re-simulation: {out}")
    sys.exit(1 if done.missing or (done.exact and not done.comparison.equal) else 0)


def print_comparison(done: Resimulation) -> None:
    """Print the comparison."""
    console = Console(highlight=False, emoji=False, soft_wrap=True)
    if not console.is_terminal:
        console.width = PIPE_WIDTH
    for note in done.notes:
        click.echo(printable(f"note: {note}"), err=True)
    comparison = done.comparison
    for entity, inputs in done.missing.items():
        text = f"{_label(done, entity)}: not comparable: the log lacks what it subscribes to: {', '.join(inputs)}"
        click.echo(printable(text))
    for name in dict.fromkeys(name for inputs in done.missing.values() for name in inputs):
        click.echo(printable(_describe_sources(done, name)))
    comparable = {key: tally for key, tally in comparison.counts.items() if key[0] not in done.missing}
    if done.missing and not comparable:
        return
    if comparable:
        console.print(_messages(done, comparable))
    if any(tally.fields for tally in comparable.values()):
        console.print(_fields(done, comparable))
    if done.missing:
        return
    for line in _first(done):
        click.echo(printable(line))
    names = ", ".join(done.tasks)
    total = sum(tally.logged for tally in comparison.counts.values())
    if comparison.equal:
        click.echo(printable(f"{names}: {format_noun_count(total, 'message')}, 0 bytes of difference"))
    else:
        click.echo(printable(f"{names}: {format_noun_count(comparison.bytes, 'byte')} of difference"))


def _describe_sources(done: Resimulation, name: str) -> str:
    """The tasks that can make an input which the log lacks, and the option to add those that are not chosen."""
    sources = done.sources.get(name, [])
    others = [section for section in sources if section not in done.tasks]
    if not sources:
        return f"  {name}: no task of the profile makes it"
    again = [section for section in sources if section in done.tasks]
    words = [f"{', '.join(again)}, which published none here"] if again else []
    if others:
        words.append(f"{', '.join(others)}: add {' '.join(f'-t {shlex.quote(section)}' for section in others)}")
    return f"  {name} can come from {'; or '.join(words)}"


def _messages(done: Resimulation, tallies: dict[EntityMessage, MessageCount]) -> Table:
    table = _table("entity", "message", "log", "resim", "equal", "changed", "only log", "only resim")
    for (entity, kind), tally in sorted(tallies.items()):
        counts = tally.logged, tally.published, tally.equal, tally.changed, tally.only_logged, tally.only_published
        table.add_row(_label(done, entity), _name(done, kind), *map(str, counts))
    return table


def _fields(done: Resimulation, tallies: dict[EntityMessage, MessageCount]) -> Table:
    table = _table("message", "field", "changed", "mean", "rms", "largest")
    for (_, kind), tally in sorted(tallies.items()):
        for name, statistics in tally.fields.items():
            if statistics.changed:
                figures = [f"{value:.4g}" for value in (statistics.mean, statistics.rms, statistics.largest)]
                title = f"{name} [{statistics.unit}]" if statistics.unit else name
                table.add_row(_name(done, kind), _plain(title), str(statistics.changed), *figures)
    return table


def _table(*columns: str) -> Table:
    table = Table(box=None, pad_edge=False, header_style="bold")
    for index, column in enumerate(columns):
        table.add_column(column, justify="left" if index < 2 else "right", no_wrap=True)
    return table


def _first(done: Resimulation) -> Iterator[str]:
    """The first difference: its time, and both messages with the fields that differ."""
    first = done.comparison.first
    if first is None or (packet := first.logged or first.published) is None:
        return
    since = imc.header(packet).timestamp - done.begin
    yield f"first difference: at {since:.3f} s, after {format_noun_count(first.after, 'equal message')}"
    yield f"  log    {_words(done, first.logged, first.published)}"
    yield f"  resim  {_words(done, first.published, first.logged)}"


def _words(done: Resimulation, packet: bytes | None, other: bytes | None) -> str:
    """A message, with only the fields that differ if the other one is of the same type and entity."""
    if packet is None:
        return "nothing"
    message, like = (_decoded(done.log, p) for p in (packet, other))
    if message is None:
        return f"{len(packet)} bytes"
    same = type(like) is type(message) and like is not None and like.src_ent == message.src_ent
    names = [n for n in message.__struct_fields__ if n not in HEADER] if not same else message.__struct_fields__
    values = [f"{n}={getattr(message, n)!r}" for n in names if not same or getattr(like, n) != getattr(message, n)]
    return f"{type(message).__name__} of {_label(done, message.src_ent)}: {', '.join(values)}"


def _decoded(log: imc.Log, packet: bytes | None) -> imc.Message | None:
    try:
        return None if packet is None else log.schema.decode(packet)
    except imc.DecodeError:
        return None


def _label(done: Resimulation, entity: int) -> str:
    return printable(done.labels.get(entity, f"entity {entity}"))


def _name(done: Resimulation, kind: int) -> str:
    logged = any(tally.logged for (_, number), tally in done.comparison.counts.items() if number == kind)
    found = (done.log.schema if logged else imc.builtin()).types_by_id.get(kind)
    return found.abbrev if found else f"id {kind}"


def _plain(text: str) -> str:
    return text.replace("[", "\\[")
