"""Options of the commands that run scenarios in worker processes."""

from typing import Final

import click

from shoal.campaigns import WALL_LIMIT
from shoal.cli.time_texts import parse_duration_option

workers_option: Final = click.option(
    "-j",
    "--workers",
    type=click.IntRange(0),
    help="Worker processes; with 0, this process runs all, without a time limit. [default: number of processors]",
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
        raise click.UsageError("-j 0 has no time limit: leave --wall-limit out")
