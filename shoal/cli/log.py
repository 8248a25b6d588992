"""`shoal log`: looks at logs, cuts, merges, compares, repairs and exports them."""

from typing import ClassVar

import click

from shoal.cli import LazyGroup

COMMANDS = {
    "info": ("shoal.cli.log_info", "Say what is in a log: who, when, what, how often, and what is damaged."),
    "ls": ("shoal.cli.log_info", "List the logs below a folder."),
    "cut": ("shoal.cli.log_change", "Write a part of a log to a new one: by time, message, system, entity."),
    "merge": ("shoal.cli.log_change", "Write several logs to one, in order of time."),
    "diff": ("shoal.cli.log_diff", "Say in plain words where two logs part."),
    "report": ("shoal.cli.log_report", "Draw a log as one HTML page: track, depth, states, errors, plans."),
    "doctor": ("shoal.cli.log_doctor", "Look for what is wrong with a log, and repair it."),
    "export": ("shoal.cli.log_export", "Write a log as MCAP, NetCDF, Parquet, CSV or LLF."),
    "import": ("shoal.cli.log_export", "Make a log of an MCAP or .tlog file."),
}


class LogGroup(LazyGroup):
    """The commands of `shoal log`."""

    table: ClassVar[dict[str, tuple[str, str]]] = COMMANDS


@click.group(cls=LogGroup)
def log() -> None:
    """Look at logs, cut, merge, compare and repair them."""
