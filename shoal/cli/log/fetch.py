"""`shoal log fetch`: copies logs of a running vehicle."""

from pathlib import Path
from typing import Any

import click

from shoal.cli.json_output import json_option, print_json_line
from shoal.cli.remote_command import (
    exit_with_reason,
    network_options,
    run_on_vehicle,
    vehicle_argument,
)
from shoal.network import AsyncRemoteVehicle, RemoteLog
from support.terminal_text import printable


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
        from rich.progress import DownloadColumn

        from shoal.cli.progress_bar import ProgressBar

        done = 0
        with ProgressBar("copying", sum(log.size for log in chosen), amount=DownloadColumn(binary_units=True)) as bar:

            def show(step: int) -> None:
                nonlocal done
                done += step
                bar.show(done)

            return [(log, await there.log.fetch(log, log_dir, show)) for log in chosen]

    for log, path in run_on_vehicle(vehicle, connection, act):
        if as_json:
            print_json_line(
                {"name": log.name, "size": log.size, "files": log.files, "path": None if path is None else str(path)}
            )
        else:
            click.echo(printable(f"{log.name:32} {log.size:12} B" if path is None else str(path)))
