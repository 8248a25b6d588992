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

    An MCAP gives the same log, packet for packet. Each autopilot becomes a system, and what it measured, did and said
    becomes IMC messages: state, GPS, batteries, sensors, modes, missions, parameters, texts.
    """
    out = out or Path(file.stem)
    with errors_as_messages():
        if file.exists() and not file.is_file():  # a device has no end, and a pipe would be waited for
            raise ValueError(f"{file}: not a regular file")
        with require_extra("analysis" if _begins(file, MCAP_MAGIC) else "mavlink"):
            write = _reader(file, system)
            with new_folder(out, force) as part, progress_bar(file) as tell:
                warnings = write(file, part, tell)
        packets = len(imc.Log(out))
    click.echo(printable(f"{format_noun_count(packets, 'message')}: {out}"))
    for warning in warnings:
        click.echo(printable(f"warning: {warning}"), err=True)


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
    from shoal.logs.edit.flight_log_import import import_dataflash, import_ulog
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
        skipped = f"{format_noun_count(done.lost, 'byte')} of {path} skipped"
        lost = f"{skipped}: in no whole record, the first at byte {done.first_lost}"
        return [*([lost] if done.lost else []), *done.notes]

    return read
