"""`shoal record`: records what a console receives from running vehicles."""

import asyncio
import errno
import math
import signal
import time
from contextlib import suppress
from datetime import UTC, datetime
from importlib import import_module
from pathlib import Path
from typing import Any

import click

import imc
from imc.lsf import find_log
from runtime.logs import summarize
from shoal.cli.completion import complete_message, find_message_type
from shoal.cli.json_output import json_option, print_json_line
from shoal.cli.messages_option import messages_option
from shoal.cli.optional_extra import require_extra
from shoal.cli.remote_command import complete_vehicle, network_options, run_on_network
from shoal.cli.time_texts import format_clock_time, parse_duration_option
from shoal.cli.vehicle_selection import VehicleSelection, no_match_text, parse_selection
from shoal.logs.inspect import format_noun_count, format_size
from shoal.network import SILENCE, Network, NetworkError, NetworkRecorder, NetworkSystem, RecordingEnd
from support.byte_sizes import parse_byte_size
from support.file_errors import describe_os_error
from support.terminal_text import printable

FULL = (errno.ENOSPC, errno.EDQUOT, errno.EFBIG, errno.EIO)
STOPPING = [getattr(signal, name) for name in ("SIGINT", "SIGTERM", "SIGHUP") if hasattr(signal, name)]
CONVERTED = 6  # an MCAP file and the log that it is made of, as multiple of the log
SMALLEST = 200_000  # bytes of a limit: the definitions alone need 30 kB for each vehicle


def _parse_size(_: click.Context, __: click.Parameter, text: str | None) -> float:
    """Click callback: bytes."""
    try:
        size = math.inf if text is None else parse_byte_size(text)
    except ValueError as error:
        raise click.BadParameter(str(error)) from None
    if size < SMALLEST:
        raise click.BadParameter(f"{text!r} is too small; {format_size(SMALLEST)} are the least")
    return size


@click.command()
@click.argument("vehicles", metavar="[VEHICLE]...", nargs=-1, shell_complete=complete_vehicle)
@click.option("-o", "--output", metavar="FOLDER", type=click.Path(path_type=Path), help="[default: record-DATE-TIME]")
@click.option("-f", "--format", "form", type=click.Choice(["lsf", "mcap"]), default="lsf", show_default=True)
@click.option("-m", "--message", "names", multiple=True, shell_complete=complete_message, help="Only these messages.")
@click.option("--for", "duration", callback=parse_duration_option, metavar="TIME", help="End after this time: 30s, 2h.")
@click.option("--limit", callback=_parse_size, metavar="SIZE", help="End before the logs are larger: 500MB, 2GiB.")
@messages_option
@network_options
@json_option
def record(
    vehicles: tuple[str, ...],
    output: Path | None,
    form: str,
    names: tuple[str, ...],
    duration: float | None,
    limit: float,
    schema: imc.Schema,
    connection: dict[str, Any],
    as_json: bool,
) -> None:
    """Record what each VEHICLE sends to a console, until Ctrl-C; without names, all that are there or appear.

    VEHICLE is a name, several with commas, or a pattern in quotes such as 'lauv-*'. FOLDER gets a log for each vehicle,
    with its definitions, as from the vehicle itself; `shoal log info FOLDER/VEHICLE` shows it. With -f mcap, each log
    becomes a file for Foxglove at the end; if the command is killed before, the log stays.

    Exit status 1 if a log is not complete: a vehicle was not found or is silent at the end, the disk is full, or the
    limit was reached.
    """
    selection = parse_selection(vehicles or ("*",))
    kinds = [find_message_type(name, schema) for word in names for name in word.split(",")]
    if form == "mcap":
        with require_extra("analysis"):
            import_module("shoal.logs.export.mcap_writer")  # before anything is recorded
    elif output is not None and output.suffix.casefold() == ".mcap":
        raise click.UsageError(f"-o names a folder: for {output} add -f mcap, which makes a file of each log in it")
    folder = output or Path(f"record-{datetime.now(UTC):%Y%m%d-%H%M%S}")
    folder.mkdir(parents=True, exist_ok=True)
    if any(folder.iterdir()):
        raise click.ClickException(printable(f"{folder} is not empty; a recording needs a folder of its own"))
    troubles: list[str] = []
    room = limit / CONVERTED if form == "mcap" else limit

    def report(name: str, path: Path) -> None:
        click.echo(printable(f"recording {name} to {path}"), err=True)

    async def work(network: Network) -> NetworkRecorder:
        recorder = NetworkRecorder(
            network, folder, lambda name: _wants(selection, name), kinds, limit=room, report=report
        )
        loop = asyncio.get_running_loop()
        for number in STOPPING:
            if signal.getsignal(number) is not signal.SIG_IGN:
                loop.add_signal_handler(number, recorder.stop.set)
        finding = asyncio.create_task(_find(network, selection, troubles, recorder.stop))
        try:
            await recorder.run(duration)
            troubles.extend(_silences(network, recorder, receives_all=not kinds))
        except RecordingEnd:
            troubles.append(f"the limit of {format_size(int(limit))} is reached: nothing was recorded after that")
        except OSError as error:
            if error.errno not in FULL:
                raise
            when = format_clock_time(time.time())
            reason = describe_os_error(error)
            logs = f": the logs end at {when} UTC, and can be read up to there" if recorder.recordings else ""
            troubles.append(f"{reason}{logs}")
        finally:
            finding.cancel()
            for number in STOPPING:
                loop.remove_signal_handler(number)
        return recorder

    try:
        recorder = run_on_network({**connection, "messages": schema}, work)
        _finish(recorder, selection, form, troubles, as_json)
    finally:
        with suppress(OSError):
            folder.rmdir()  # if it is empty
    for text in troubles:
        click.echo(f"Error: {printable(text)}", err=True)
    if troubles:
        raise click.exceptions.Exit(1)


def _silences(network: Network, recorder: NetworkRecorder, *, receives_all: bool) -> list[str]:
    """Vehicles that are gone at the end, or silent though everything is recorded, and since when."""
    recorded = [(name, network.systems.get(name)) for name in sorted(recorder.recordings)]
    return [
        f"{name} is silent since {format_clock_time(time.time() - system.age)} UTC: its log ends there"
        for name, system in recorded
        if system is not None and (not system.is_there or (receives_all and system.age > SILENCE))
    ]


def _wants(selection: VehicleSelection, name: str) -> bool:
    return name in selection.names or selection.matches(name)


async def _find(network: Network, selection: VehicleSelection, troubles: list[str], stop: asyncio.Event) -> None:
    """Report missing vehicles; without any, the recording ends."""

    async def find(name: str) -> NetworkSystem | None:
        try:
            return await network.find_system(name, takes_clash=True)
        except NetworkError as error:
            click.echo(f"Error: {printable(str(error))}", err=True)
            return None

    found = await asyncio.gather(*map(find, selection.names))
    if any(found):
        return
    began = time.monotonic()
    while time.monotonic() - began < network.search.discovery_timeout:
        if selection.patterns and any(selection.matches(system.name) for system in network.vehicles()):
            return
        if not selection.patterns:
            break
        await network.wait_for_change(0.05)
    if selection.patterns:
        troubles.append(no_match_text(network, selection))
    stop.set()


def _finish(
    recorder: NetworkRecorder, selection: VehicleSelection, form: str, troubles: list[str], as_json: bool
) -> None:
    """Print what was recorded, convert it if requested, and note what is missing."""
    rows: list[dict[str, object]] = []
    for name, recording in sorted(recorder.recordings.items()):
        path = recording.folder
        if form == "mcap":
            path = _convert(path, troubles)
        if lost := recorder.lost.get(name, 0):
            troubles.append(f"{name}: {format_noun_count(lost, 'message')} lost: this computer is too slow")
        size = sum(file.stat().st_size for file in path.iterdir()) if path.is_dir() else path.stat().st_size  # integers
        rows.append(
            {
                "vehicle": name,
                "path": str(path),
                "messages": recording.count,
                "bytes": size,
                "start": recording.first,
                "end": recording.last,
                "lost": lost,
            }
        )
        if not as_json:
            span = f"{format_clock_time(recording.first)} to {format_clock_time(recording.last)} UTC"
            count = format_noun_count(recording.count, "message")
            click.echo(printable(f"{name}: {count}, {span}, {format_size(size)} in {path}"))
    if as_json:
        print_json_line(rows)
    missing = [name for name in selection.names if name not in recorder.recordings]
    troubles += [f"{name}: nothing was recorded" for name in missing]
    if not recorder.recordings and not missing and not troubles:
        troubles.append("nothing was recorded")


def _convert(folder: Path, troubles: list[str]) -> Path:
    """Turn a log into an MCAP file beside it; the log stays if that fails."""
    from shoal.logs.export import LogSource
    from shoal.logs.export.mcap import export_mcap
    from support.atomic_files import new_file

    path = folder.with_name(f"{folder.name}.mcap")
    log = imc.Log(find_log(folder))
    try:
        with new_file(path) as part:
            export_mcap(LogSource(log, summarize(log)), part)
    except OSError as error:
        troubles.append(f"{describe_os_error(error)}: the log stays in {folder}; `shoal log export` converts it")
        return folder
    for file in folder.iterdir():
        file.unlink()
    folder.rmdir()
    return path
