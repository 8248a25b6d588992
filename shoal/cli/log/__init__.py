"""`shoal log`: shows, cuts, merges, compares, repairs, exports and renders logs."""

from typing import ClassVar

import click

from shoal.cli import LazyGroup

COMMANDS = {
    "info": ("shoal.cli.log.info", "Show what is in a log: systems, times, messages, rates, damage."),
    "ls": ("shoal.cli.log.ls", "List the logs below a folder."),
    "fetch": ("shoal.cli.log.fetch", "Copy logs of a running vehicle."),
    "cut": ("shoal.cli.log.cut", "Copy a part of a log to a new one: by time, message, system or entity."),
    "merge": ("shoal.cli.log.merge", "Merge several logs into one, ordered by time."),
    "diff": ("shoal.cli.log.diff", "Show where two logs differ."),
    "report": ("shoal.cli.log.report", "Draw a log as one HTML page: track, depth, states, errors, plans."),
    "doctor": ("shoal.cli.log.doctor", "Find what is wrong with a log, and repair it."),
    "export": ("shoal.cli.log.export", "Write a log as MCAP, NetCDF, Parquet, CSV, LLF or a data set."),
    "render": ("shoal.cli.log.render", "Take pictures and labels of a simulated run after the fact."),
    "import": ("shoal.cli.log.import_log", "Convert an MCAP, .tlog, .BIN or .ulg file to a log."),
}


class LogGroup(LazyGroup):
    """The commands of `shoal log`."""

    table: ClassVar[dict[str, tuple[str, str]]] = COMMANDS


@click.group(cls=LogGroup)
def log() -> None:
    """Show, fetch, cut, merge, compare, repair, export and render logs."""
