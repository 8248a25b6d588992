"""`shoal replay`: plays a log onto the bus."""

from pathlib import Path

import click

from runtime.build import join_zenoh
from runtime.catalogue import find_task
from runtime.cli.run import options, swim
from runtime.clock import parse_clock
from runtime.folders import own_etc
from runtime.problem import ProfileError
from runtime.profile import derived_id, load_profile
from runtime.vehicle import Vehicle

NAME = "replay"


@click.command()
@click.argument("log", type=click.Path(exists=True, path_type=Path))
@click.option("--skip", default=0.0, show_default=True, help="Seconds of the log to leave out at its beginning.")
@click.option("--messages", default="", help="Names of the messages to play, separated by commas; all by default.")
@options
def replay(
    log: Path,
    skip: float,
    messages: str,
    clock: str,
    duration: float | None,
    seed: int | None,
    bus: str | None,
    log_dir: Path,
    keep_going: bool | None,
) -> None:
    """Play LOG, a folder or a Data.lsf of Shoal or DUNE, with the headers and in the order of the log.

    The player is a system of its own, named replay, so nothing is mixed into what the log says.
    """
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
        )
        wanted = [name.strip() for name in messages.split(",") if name.strip()]
        vehicle.add(
            cls,
            "Transports.Replay",
            load_at_start=str(log),
            exit_at_end=True,
            seconds_to_skip=skip,
            replay_messages=wanted,
        )
        if bus == "zenoh":
            join_zenoh(vehicle, profile)
    except ModuleNotFoundError as error:
        raise click.ClickException(f"{error}; a zenoh bus needs pip install 'shoal[zenoh]'") from None
    except (ProfileError, ConnectionError, ValueError) as error:
        raise click.ClickException(str(error)) from None
    swim(vehicle, f"replay of {log}", duration)
