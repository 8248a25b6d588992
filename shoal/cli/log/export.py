"""`shoal log export`: writes a log in another format."""

import re
from collections.abc import Callable
from importlib import import_module
from pathlib import Path
from typing import NamedTuple, TypeAlias

import click

from imc.lsf import ReportProgress
from runtime.logs import summarize
from shoal.cli.log.log_input import (
    LOG,
    errors_as_messages,
    fail_if_most_is_lost,
    open_log,
    progress_bar,
    require_messages,
    run_selection_options,
)
from shoal.cli.log.selection_options import TIMES, parse_log_time, split_names
from shoal.cli.optional_extra import require_extra
from shoal.logs.export import LogSource
from shoal.logs.inspect import format_noun_count
from shoal.logs.selection import selection_from_names
from support.atomic_files import new_file, new_folder
from support.terminal_text import printable
from support.text_length import list_first


class ExportFormat(NamedTuple):
    """A format: what the name of the output ends with, whether it is one file or a folder, and its function.

    The module is imported when the format is used, because it may need a library.
    """

    ending: str
    is_file: bool
    module: str
    function: str


FORMATS = {
    "mcap": ExportFormat(".mcap", True, "shoal.logs.export.mcap", "export_mcap"),
    "netcdf": ExportFormat(".nc", True, "shoal.logs.export.netcdf", "export_netcdf"),
    "parquet": ExportFormat("-parquet", False, "shoal.logs.export.parquet", "export_parquet"),
    "csv": ExportFormat("-csv", False, "shoal.logs.export.csv", "export_csv"),
    "llf": ExportFormat("-llf", False, "shoal.logs.export.llf", "export_llf"),
    "euroc": ExportFormat("-euroc", False, "shoal.logs.export.euroc", "export_euroc"),
    "coco": ExportFormat("-coco", False, "shoal.rendering.coco", "export_coco"),
    "tum": ExportFormat("-tum", False, "shoal.logs.export.tum_rgbd", "export_tum_rgbd"),
}
LogWriter: TypeAlias = Callable[[LogSource, Path, ReportProgress], int]
"""Writes what is selected to a path, reports the bytes read, and returns how many messages or rows it wrote."""

NOUNS = {"mcap": "message", "coco": "picture"}
"""Content of a format that has no rows."""

MOST_LINES = 20
MOST_NAMES = 5
MOST_REASONS = 5


@click.command(
    epilog="MCAP: one topic per system, message and entity, for Foxglove, PlotJuggler and ROS 2 tools, and the packets "
    "from which `shoal log import` restores the same log. NetCDF: one file, one group per message type, CF "
    "conventions. Parquet, CSV, LLF: a folder with one file per message type. EuRoC, TUM: a folder with inertial "
    "samples, true and estimated motion, and pictures, for visual-inertial navigation. COCO: a folder with the "
    "pictures, and boxes and masks of the objects of a simulation. MCAP, NetCDF and Parquet need the extra "
    "shoal[analysis]."
)
@click.argument("log", type=LOG, required=False)
@click.argument("out", type=LOG, required=False)
@run_selection_options("log")
@click.option("-f", "--format", "form", type=click.Choice([*FORMATS]), help="[default: by the ending of OUT, or mcap]")
@click.option("--from", "begin", metavar="TIME", help=f"Start: {TIMES}.")
@click.option("--to", "end", metavar="TIME", help="End, not included; written as --from.")
@click.option("-m", "--messages", multiple=True, help="Messages, by name or id, separated by commas.")
@click.option("-s", "--systems", multiple=True, help="Systems, by name or id.")
@click.option("-e", "--entities", multiple=True, help="Entities, by label or id.")
@click.option("--raw/--no-raw", default=True, help="MCAP: include the packets, to restore the log from them.")
@click.option("--images/--no-images", default=True, help="MCAP: include the pictures in the folder Photos.")
@click.option("--force", is_flag=True, help="Replace existing files.")
def export(
    log: Path,
    out: Path | None,
    form: str | None,
    begin: str | None,
    end: str | None,
    messages: tuple[str, ...],
    systems: tuple[str, ...],
    entities: tuple[str, ...],
    raw: bool,
    images: bool,
    force: bool,
) -> None:
    """Write LOG to OUT as MCAP, NetCDF, Parquet, CSV, LLF, EuRoC, TUM or COCO.

    OUT is named after the log by default. Exit status 1 if less than half of what is selected could be written; if
    nothing could, there is no OUT.
    """
    with errors_as_messages():
        form = form or (_format_of(out) if out else "mcap")
        with require_extra("analysis"):
            write = _writer(form, raw, images)
        opened = open_log(log)
        out = out or Path(default_output_name(opened.path) + FORMATS[form].ending)
        with progress_bar(opened.path) as advance:
            summary = summarize(opened, advance)
        require_messages(opened, summary.packets)
        start, stop = (parse_log_time(text, summary.start, summary.end) for text in (begin, end))
        words = split_names(messages), split_names(systems), split_names(entities)
        source = LogSource(opened, summary, selection_from_names(summary, start, stop, *words))
        with (new_file if FORMATS[form].is_file else new_folder)(out, force) as part:
            with progress_bar(opened.path, "exporting") as advance:
                written = write(source, part, advance)
            if source.packets == 0:
                raise ValueError("no message is selected; nothing is written")
            if not written:
                reasons = [*dict(source.skipped.most_common(MOST_REASONS)), *source.notes, *source.unreadable_photos]
                why = "".join(f"; {reason}" for reason in reasons[:MOST_REASONS])
                raise ValueError(f"nothing of the log can be written as {form}; no {out}{why}")
    of = f"{format_noun_count(source.packets, 'message')} of the log"
    click.echo(printable(f"{of}: {format_noun_count(written, NOUNS.get(form, 'row'))} in {out}"))
    for reason, count in source.skipped.most_common(MOST_LINES):
        click.echo(printable(f"skipped: {format_noun_count(count, 'message')}: {reason}"), err=True)
    for note in source.notes:
        click.echo(printable(f"note: {note}"), err=True)
    if source.unreadable_photos:
        named = list_first(source.unreadable_photos, MOST_NAMES)
        click.echo(
            printable(f"skipped: {format_noun_count(len(source.unreadable_photos), 'picture')}: {named}"), err=True
        )
    for offset, length, reason in opened.losses[:MOST_LINES]:
        click.echo(printable(f"skipped: byte {offset}: {format_noun_count(length, 'byte')}: {reason}"), err=True)
    if len(opened.losses) > MOST_LINES:
        click.echo(f"skipped: {format_noun_count(len(opened.losses) - MOST_LINES, 'more damaged place')}", err=True)
    damaged = sum(loss.length for loss in opened.losses)  # integers
    fail_if_most_is_lost(str(opened.path), summary.unpacked - damaged, damaged)
    whole = form == "mcap" and raw  # it has the packets of messages that no topic can show
    skipped = len(source.unreadable_photos) + (0 if whole else source.skipped.total())
    fail_if_most_is_lost("what is selected", written, skipped)


def _format_of(out: Path) -> str:
    """The format for the ending of a name; MCAP if it has none. Raises ValueError if the ending is unknown."""
    ending = out.suffix[1:].lower()
    for name, form in FORMATS.items():
        if ending in (name, form.ending[1:]) or out.name.lower().endswith(form.ending):
            return name
    if not ending:
        return "mcap"
    raise ValueError(f"{out}: unknown ending '.{ending}'; choose a format with --format")


def _writer(form: str, raw: bool, images: bool) -> LogWriter:
    write = getattr(import_module(FORMATS[form].module), FORMATS[form].function)
    if form != "mcap":
        return write
    return lambda source, path, advance: write(source, path, raw, images, advance)


def default_output_name(path: Path) -> str:
    """The name of a log: vehicle, date and time, if its folders have them."""
    if not path.name.startswith("Data.lsf"):
        return path.name.split(".")[0]
    folder = path.resolve().parent
    dated = re.fullmatch(r"\d{8}", folder.parent.name)
    return "-".join((folder.parent.parent.name, folder.parent.name, folder.name)) if dated else folder.name
