"""`shoal log export` and `import`: convert logs to and from other formats."""

import re
from collections.abc import Callable, Generator
from contextlib import contextmanager
from importlib import import_module
from pathlib import Path
from typing import NamedTuple, TypeAlias

import click

import imc
from imc.lsf import ReportProgress
from runtime.logs import summarize
from shoal.cli.log_change import TIMES, read_time, split_words
from shoal.cli.log_open import LOG, check_found, open_log, progress, refusals, takes_runs
from shoal.logs.edit import new_file, new_folder
from shoal.logs.export import Source
from shoal.logs.look import number
from shoal.logs.selection import choose
from support.text import printable


class Format(NamedTuple):
    """A format: what the name of the output ends with, whether it is one file or a folder, and its function.

    The module is imported when the format is used, because it may need a library.
    """

    ending: str
    is_file: bool
    module: str
    function: str


FORMATS = {
    "mcap": Format(".mcap", True, "shoal.logs.export.mcap", "export_mcap"),
    "netcdf": Format(".nc", True, "shoal.logs.export.netcdf", "export_netcdf"),
    "parquet": Format("-parquet", False, "shoal.logs.export.parquet", "export_parquet"),
    "csv": Format("-csv", False, "shoal.logs.export.csv", "export_csv"),
    "llf": Format("-llf", False, "shoal.logs.export.llf", "export_llf"),
    "euroc": Format("-euroc", False, "shoal.logs.export.euroc", "export_euroc"),
    "coco": Format("-coco", False, "shoal.rendering.coco", "export_coco"),
    "tum": Format("-tum", False, "shoal.logs.export.tum", "export_tum"),
}
Writer: TypeAlias = Callable[[Source, Path, ReportProgress], int]
"""Writes what is selected to a path, reports the bytes read, and returns how many messages or rows it wrote."""

NOUNS = {"mcap": "message", "coco": "picture"}
"""What a format has, if not rows."""

MCAP_MAGIC = b"\x89MCAP0\r\n"
MOST_LINES = 20
MOST_NAMES = 5


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
@takes_runs("log")
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

    OUT is named after the log by default.
    """
    with refusals():
        form = form or (_format_of(out) if out else "mcap")
        with extra("analysis"):
            write = _writer(form, raw, images)
        opened = open_log(log)
        out = out or Path(default_name(opened.path) + FORMATS[form].ending)
        with progress(opened.path) as tell:
            summary = summarize(opened, tell)
        check_found(opened, summary.packets)
        start, stop = (read_time(text, summary.start, summary.end) for text in (begin, end))
        words = split_words(messages), split_words(systems), split_words(entities)
        source = Source(opened, summary, choose(summary, start, stop, *words))
        with (new_file if FORMATS[form].is_file else new_folder)(out, force) as part:
            with progress(opened.path, "exporting") as tell:
                written = write(source, part, tell)
            if source.packets == 0:
                raise ValueError("no message is selected; nothing is written")
    of = f"{number(source.packets, 'message')} of the log"
    click.echo(printable(f"{of}: {number(written, NOUNS.get(form, 'row'))} in {out}"))
    for reason, count in source.skipped.most_common(MOST_LINES):
        click.echo(printable(f"skipped: {number(count, 'message')}: {reason}"), err=True)
    for note in source.notes:
        click.echo(printable(f"note: {note}"), err=True)
    if source.unread:
        named = ", ".join(source.unread[:MOST_NAMES]) + (", ..." if len(source.unread) > MOST_NAMES else "")
        click.echo(printable(f"skipped: {number(len(source.unread), 'picture')}: {named}"), err=True)
    for offset, length, reason in opened.losses[:MOST_LINES]:
        click.echo(printable(f"skipped: byte {offset}: {number(length, 'byte')}: {reason}"), err=True)
    if len(opened.losses) > MOST_LINES:
        click.echo(f"skipped: {number(len(opened.losses) - MOST_LINES, 'more damaged place')}", err=True)


@click.command()
@click.argument("file", type=LOG)
@click.argument("out", type=LOG, required=False)
@click.option("--system", default="", help="A name for the vehicle, the first one of a .tlog; mavlink-<id> by default.")
@click.option("--force", is_flag=True, help="Write to an existing folder, and replace the log in it.")
def import_(file: Path, out: Path | None, system: str, force: bool) -> None:
    """Convert FILE to a log in the folder OUT: an MCAP of `shoal log export`, a MAVLink .tlog, the .BIN of an
    ArduPilot, or the .ulg of a PX4.

    An MCAP gives the same log, packet for packet. Each autopilot becomes a system, and what it measured, did and said
    becomes IMC messages: state, GPS, batteries, sensors, modes, missions, parameters, texts.
    """
    out = out or Path(file.stem)
    with refusals():
        if file.exists() and not file.is_file():  # a device has no end, and a pipe would be waited for
            raise ValueError(f"{file}: not a regular file")
        with extra("analysis" if _begins(file, MCAP_MAGIC) else "mavlink"):
            write = _reader(file, system)
            with new_folder(out, force) as part, progress(file) as tell:
                warnings = write(file, part, tell)
        packets = len(imc.Log(out))
    click.echo(printable(f"{number(packets, 'message')}: {out}"))
    for warning in warnings:
        click.echo(printable(f"warning: {warning}"), err=True)


def _format_of(out: Path) -> str:
    """The format for the ending of a name; MCAP if it has none. Raises ValueError if the ending is unknown."""
    ending = out.suffix[1:].lower()
    for name, form in FORMATS.items():
        if ending in (name, form.ending[1:]) or out.name.lower().endswith(form.ending):
            return name
    if not ending:
        return "mcap"
    raise ValueError(f"{out}: unknown ending '.{ending}'; choose a format with --format")


def _writer(form: str, raw: bool, images: bool) -> Writer:
    write = getattr(import_module(FORMATS[form].module), FORMATS[form].function)
    if form != "mcap":
        return write
    return lambda source, path, tell: write(source, path, raw, images, tell)


def _begins(file: Path, magic: bytes) -> bool:
    with file.open("rb") as opened:
        return opened.read(len(magic)) == magic


def _reader(file: Path, system: str) -> Callable[[Path, Path, ReportProgress], list[str]]:
    """What imports a file: by how it begins or, if its beginning is damaged, by its name; a .tlog begins anyhow."""
    if not file.stat().st_size:
        raise ValueError(f"{file}: the file is empty")
    if _begins(file, MCAP_MAGIC):
        from shoal.logs.edit.mcap_import import import_mcap

        return lambda path, folder, _: import_mcap(path, folder)
    from mavlink import dataflash, ulog
    from shoal.logs.edit.flight_import import import_dataflash, import_ulog
    from shoal.logs.edit.tlog_import import import_tlog

    ending = file.suffix.lower()
    if _begins(file, ulog.MAGIC) or ending == ".ulg":
        convert = import_ulog
    elif _begins(file, dataflash.HEAD) or ending == ".bin":
        convert = import_dataflash
    else:
        convert = import_tlog

    def read(path: Path, folder: Path, tell: ReportProgress) -> list[str]:
        done = convert(path, folder, system, tell)
        lost = f"{number(done.lost, 'byte')} of {path} skipped: in no whole record, the first at byte {done.first_lost}"
        return [*([lost] if done.lost else []), *done.notes]

    return read


@contextmanager
def extra(name: str) -> Generator[None]:
    """Turns a missing library into the advice to install an extra of Shoal."""
    try:
        yield
    except ModuleNotFoundError as error:
        raise click.ClickException(f"this needs {error.name}: pip install 'shoal[{name}]'") from None


def default_name(path: Path) -> str:
    """The name of a log: vehicle, date and time, if its folders have them."""
    if not path.name.startswith("Data.lsf"):
        return path.name.split(".")[0]
    folder = path.resolve().parent
    dated = re.fullmatch(r"\d{8}", folder.parent.name)
    return "-".join((folder.parent.parent.name, folder.parent.name, folder.name)) if dated else folder.name
