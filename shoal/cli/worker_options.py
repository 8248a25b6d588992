"""Options of the commands that do runs in processes beside their own."""

from typing import Final

import click

from shoal.campaigns import WALL_LIMIT
from shoal.cli.time_texts import parse_duration_option

workers_option: Final = click.option(
    "-j",
    "--workers",
    type=click.IntRange(0),
    help="How many run at a time; with 0 this process does it, and ends none that hangs. [default: one a processor]",
)
wall_limit_option: Final = click.option(
    "--wall-limit",
    callback=parse_duration_option,
    default=f"{WALL_LIMIT:g} s",
    show_default=True,
    metavar="TIME",
    help="End a run that takes longer.",
)


def check_wall_limit(workers: int | None, wall_limit: float) -> None:
    """Reject a limit without a process to enforce it, and one that no run could keep. Raises UsageError."""
    if not wall_limit > 0.0:
        raise click.UsageError("--wall-limit must be more than 0 s")
    if workers == 0 and wall_limit != WALL_LIMIT:
        raise click.UsageError("with -j 0 nothing can end a run that hangs: leave --wall-limit out")
