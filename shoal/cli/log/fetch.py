"""`shoal log fetch`: copies logs of a running vehicle."""

import sys
from pathlib import Path
from typing import Any

import click

from shoal.cli.remote_command import (
    exit_with_reason,
    json_option,
    network_options,
    print_json_line,
    run_on_vehicle,
    vehicle_argument,
)
from shoal.network import AsyncRemoteVehicle, RemoteLog
from support.terminal_text import printable

STEP = 1 << 20  # bytes between two lines of progress on a terminal


@click.command()
@vehicle_argument
@click.argument("logs", metavar="[LOG]...", nargs=-1)
@click.option("--list", "only_list", is_flag=True, help="Only list the logs of the vehicle.")
@click.option("--all", "everything", is_flag=True, help="Copy all logs.")
@click.option(
    "--log-dir", default="log", show_default=True, type=click.Path(file_okay=False, path_type=Path), help="Destination."
)
@network_options
@json_option
def fetch(
    vehicle: str,
    logs: tuple[str, ...],
    only_list: bool,
    everything: bool,
    log_dir: Path,
    connection: dict[str, Any],
    as_json: bool,
) -> None:
    """Copy logs of VEHICLE over its FTP server: the last one, or each whose name contains LOG, such as 20260101.

    A copy that was interrupted is continued.
    """

    async def act(there: AsyncRemoteVehicle) -> list[tuple[RemoteLog, Path | None]]:
        found = await there.log.list()
        if not found:
            exit_with_reason(f"{there.name} has no logs")
        if only_list:
            return [(log, None) for log in found]
        chosen = found if everything else [log for log in found if any(word in log.name for word in logs)]
        chosen = chosen if logs or everything else found[-1:]
        if not chosen:
            exit_with_reason(f"{there.name} has no log with {' or '.join(logs)} in its name; --list shows all")
        total, done = sum(log.size for log in chosen), 0  # integers

        def show(step: int) -> None:
            nonlocal done
            before, done = done, done + step
            if sys.stderr.isatty() and before // STEP != done // STEP:
                click.echo(f"\r\x1b[K{done >> 20} of {total >> 20} MiB", nl=False, err=True)

        return [(log, await there.log.fetch(log, log_dir, show)) for log in chosen]

    for log, path in run_on_vehicle(vehicle, connection, act):
        if as_json:
            print_json_line(
                {"name": log.name, "size": log.size, "files": log.files, "path": None if path is None else str(path)}
            )
        else:
            click.echo(printable(f"{log.name:32} {log.size:12} B" if path is None else str(path)))
