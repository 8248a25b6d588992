"""`shoal log import`: converts files of other formats to logs."""

from collections.abc import Callable
from pathlib import Path

import click

import imc
from imc.lsf import ReportProgress
from shoal.cli.log.log_input import LOG, errors_as_messages, progress_bar
from shoal.cli.optional_extra import require_extra
from shoal.logs.inspect import format_noun_count
from support.atomic_files import new_folder
from support.terminal_text import printable

MCAP_MAGIC = b"\x89MCAP0\r\n"


@click.command()
@click.argument("file", type=LOG)
@click.argument("out", type=LOG, required=False)
@click.option("--system", default="", help="A name for the vehicle, the first one of a .tlog; mavlink-<id> by default.")
@click.option("--force", is_flag=True, help="Write to an existing folder, and replace the log in it.")
def import_(file: Path, out: Path | None, system: str, force: bool) -> None:
    """Convert FILE to a log in the folder OUT: an MCAP of `shoal log export`, a MAVLink .tlog, the .BIN of an
    ArduPilot, or the .ulg of a PX4.

    An MCAP gives the same log, packet for packet. Autopilots become systems; their measurements, actions and texts
    become IMC messages: state, GPS, batteries, sensors, modes, missions, parameters, texts.

    Exit status 1 if most of FILE could not be read: the rest is written.
    """
    out = out or Path(file.stem)
    with errors_as_messages():
        if file.exists() and not file.is_file():  # a device has no end, and a pipe would be waited for
            raise ValueError(f"{file}: not a regular file")
        with require_extra("analysis" if _begins(file, MCAP_MAGIC) else "mavlink"):
            write = _reader(file, system)
            with new_folder(out, force) as part, progress_bar(file) as advance:
                warnings, most_is_lost = write(file, part, advance)
        packets = len(imc.Log(out))
    click.echo(printable(f"{format_noun_count(packets, 'message')}: {out}"))
    for warning in warnings:
        click.echo(printable(f"warning: {warning}"), err=True)
    if most_is_lost:
        click.echo(printable(f"Error: most of {file} could not be read; the log has only the rest"), err=True)
        raise click.exceptions.Exit(1)


def _begins(file: Path, magic: bytes) -> bool:
    with file.open("rb") as opened:
        return opened.read(len(magic)) == magic


def _reader(file: Path, system: str) -> Callable[[Path, Path, ReportProgress], tuple[list[str], bool]]:
    """Importer of a file: by its first bytes or, if its beginning is damaged, by its name; a .tlog begins anyhow."""
    if not file.stat().st_size:
        raise ValueError(f"{file}: the file is empty")
    if _begins(file, MCAP_MAGIC):
        from shoal.logs.edit.mcap_import import expected_packets, import_mcap

        def restore(path: Path, folder: Path, _: ReportProgress) -> tuple[list[str], bool]:
            warnings = import_mcap(path, folder)
            return warnings, 2 * len(imc.Log(folder)) < expected_packets(path)

        return restore
    from mavlink import dataflash, ulog
    from shoal.logs.edit.flight_log_import import import_dataflash, import_ulog
    from shoal.logs.edit.tlog_import import import_tlog

    ending = file.suffix.lower()
    if _begins(file, ulog.MAGIC) or ending == ".ulg":
        convert = import_ulog
    elif _begins(file, dataflash.HEAD) or ending == ".bin":
        convert = import_dataflash
    else:
        convert = import_tlog

    def read(path: Path, folder: Path, advance: ReportProgress) -> tuple[list[str], bool]:
        done = convert(path, folder, system, advance)
        skipped = f"{format_noun_count(done.lost, 'byte')} of {path} skipped"
        lost = f"{skipped}: in no whole record, the first at byte {done.first_lost}"
        most_is_lost = 2 * done.lost > path.stat().st_size or 2 * done.skipped > done.records
        return [*([lost] if done.lost else []), *done.notes], most_is_lost

    return read
