"""`shoal replay`: plays a log onto the bus."""

from pathlib import Path
from typing import cast

import click

import imc
from runtime.kernel import parse_clock
from runtime.logs import summarize
from runtime.profile import derived_id, load_profile, own_etc
from runtime.vehicle import Vehicle, find_task, join_zenoh, missing_extra
from shoal.cli.log.log_input import errors_as_messages, logs_of_argument, run_selection_options
from shoal.cli.log.selection_options import split_names
from shoal.cli.options import check_vehicle_log_folder
from shoal.cli.replay_keyboard import ReplayControls, replay_keyboard
from shoal.cli.run import run_options, run_to_end
from shoal.logs.selection import selection_from_names
from support.diagnostics import ProfileError
from tasks.transports.logging import Logging
from tasks.transports.mavlink_links.signing_keys import parse_checked_link_url

NAME = "replay"


@click.command()
@click.argument("log", type=click.Path(exists=True, path_type=Path), required=False)
@run_selection_options("log")
@click.option(
    "--from", "begin", default="", metavar="TIME", help="Time to begin at: 90, 1h30min or 2026-01-01T00:05:00."
)
@click.option("--to", "end", default="", metavar="TIME", help="Time to end at, written as --from.")
@click.option("-m", "--messages", multiple=True, help="Messages to play, by name; all by default.")
@click.option("-s", "--systems", multiple=True, help="Systems to play, by name or id.")
@click.option("-e", "--entities", multiple=True, help="Entities to play, by label.")
@click.option("--mavlink", is_flag=True, help="Also show the vehicle of the log to MAVLink ground stations.")
@click.option(
    "-l", "--link", "links", multiple=True, metavar="LINK", help="A link to ground stations, instead of the usual ones."
)
@click.option("--loop", is_flag=True, help="Restart at the end.")
@run_options
def replay(
    log: Path,
    begin: str,
    end: str,
    messages: tuple[str, ...],
    systems: tuple[str, ...],
    entities: tuple[str, ...],
    mavlink: bool,
    links: tuple[str, ...],
    loop: bool,
    clock: str,
    duration: float | None,
    seed: int | None,
    bus: str | None,
    log_dir: Path,
    keep_going: bool | None,
) -> None:
    """Play LOG, a folder or a Data.lsf of Shoal or DUNE: its messages with their headers, in their order.

    For other programs: `shoal console LOG` shows a log on a page in the browser, with play, pause, speed and seek.

    The player is a system of its own, named replay, so its messages do not mix with those of the log. Separate several
    messages, systems or entities by commas. On a terminal, the space bar pauses, the left and right arrows skip 10 s,
    the down and up arrows 60 s. With --log-dir, what is played is also recorded. With --mavlink, ground stations see
    the vehicle that has written the log, or that --systems names first, and can move the replay by its parameters.
    """
    source = click.get_current_context().get_parameter_source("log_dir")
    wants_log = source is not click.core.ParameterSource.DEFAULT
    with errors_as_messages():
        opened = imc.Log(log)
    if next(iter(opened.packets()), None) is None:
        raise click.ClickException(f"{log}: there is no message in this log")
    if messages or systems or entities:
        with errors_as_messages():
            selection_from_names(summarize(opened), None, None, *map(split_names, (messages, systems, entities)))
    cls = find_task("Transports.Replay")
    assert cls is not None
    try:
        profile = load_profile(own_etc() / "common" / "imc-addresses.ini", vehicle=NAME)
        vehicle = Vehicle(
            NAME,
            derived_id(NAME),
            clock=parse_clock(clock, profile.start_time_ns),
            profile=profile,
            systems=profile.systems,
            seed=seed or 0,
            keep_going=bool(keep_going),
            log_root=log_dir,
            messages=_definitions(opened),
        )
        player = vehicle.add(
            cls,
            "Transports.Replay",
            load_at_start=str(log),
            exit_at_end=True,
            begin=begin,
            end=end,
            replay_messages=split_names(messages),
            replay_systems=split_names(systems),
            replay_entities=split_names(entities),
            loop=loop,
        )
        if mavlink or links:
            _show_to_stations(vehicle, links, split_names(systems))
        if wants_log:
            vehicle.add(Logging, "Transports.Logging", {"Entity Label": "Logger"})
            check_vehicle_log_folder(vehicle)
        if bus == "zenoh":
            join_zenoh(vehicle, profile)
    except ModuleNotFoundError as error:
        raise click.ClickException(f"{error}; a zenoh bus needs pip install 'shoal[zenoh]'") from None
    except (ProfileError, ConnectionError, ValueError) as error:
        raise click.ClickException(str(error)) from None
    with replay_keyboard(cast(ReplayControls, player), vehicle.kernel):
        run_to_end(vehicle, f"replay of {logs_of_argument(log)[0]}", duration)


def _show_to_stations(vehicle: Vehicle, links: tuple[str, ...], systems: list[str]) -> None:
    """Add the task that shows a vehicle of the log over MAVLink: the one that was chosen, or the log's owner."""
    if vehicle.has_virtual_time:
        raise click.UsageError("ground stations need a clock that they can follow: --clock real, or a factor")
    cls = find_task("Transports.MAVLinkReplay")
    assert cls is not None
    if extra := missing_extra(cls):
        raise click.ClickException(f"--mavlink needs pip install 'shoal[{extra}]'")
    for link in links:
        try:
            parse_checked_link_url(link)
        except ValueError as error:
            raise click.UsageError(str(error)) from None
    options = {"Shown System": systems[0] if systems else ""} | ({"Links": ", ".join(links)} if links else {})
    vehicle.add(cls, "Transports.MAVLinkReplay", options)


def _definitions(log: imc.Log) -> imc.Schema | None:
    """The log's messages if it has those of Shoal and further ones; None for the built-in ones."""
    theirs, ours = log.schema.types_by_id, imc.builtin().types_by_id
    return log.schema if all(theirs.get(number) == kind for number, kind in ours.items()) else None
