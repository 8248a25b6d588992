"""Options that several commands have, and the parsing of their values."""

from pathlib import Path

import click

from runtime.durations import parse_duration

SHORTEST = 0.01  # s; the shortest period of a repeated action

config_dir_option = click.option(
    "-d", "--config-dir", multiple=True, type=click.Path(path_type=Path), help="Search this folder for profiles first."
)
modes_option = click.option(
    "-p", "--profiles", multiple=True, help="Modes to select, separated by commas, such as Simulation."
)
overrides_option = click.option(
    "--set", "overrides", multiple=True, metavar="SECTION:OPTION=VALUE", help="Override an option; can be repeated."
)
log_dir_option = click.option(
    "--log-dir", default="log", show_default=True, type=click.Path(path_type=Path), help="Folder for logs."
)


def parse_period(context: click.Context, parameter: click.Parameter, text: str | None) -> float | None:
    """Click callback: seconds of a duration of at least `SHORTEST`."""
    period = parse_time(context, parameter, text)
    if period is not None and period < SHORTEST:
        raise click.BadParameter(f"{text!r} is too short; use at least {SHORTEST:g} s")
    return period


def parse_time(_: click.Context, __: click.Parameter, text: str | None) -> float | None:
    """Click callback: seconds of a duration."""
    try:
        return None if text is None else parse_duration(text)
    except ValueError as error:
        raise click.BadParameter(str(error)) from None
