"""The processes of one vehicle: which one this is, and how the main one keeps the others running."""

import os
import sys

import click

from runtime.profile import MAIN
from runtime.vehicle import Vehicle
from shoal.fleet import ManagedProcess, Supervisor

POLL_PERIOD = 0.25  # s


def resolve_process_option(process: str | None, others: list[str], over_zenoh: bool) -> str | None:
    """Name of this process of the vehicle, "" the main one; None if all tasks run in one. Raises ClickException."""
    if not over_zenoh:
        if process not in (None, MAIN):
            raise click.ClickException(f"--process {process} needs a zenoh bus and a clock that is not virtual")
        if others:
            named = ", ".join(others)
            why = "processes of their own need a zenoh bus and a clock that is not virtual"
            click.echo(f"note: tasks with Process = {named} run in this process; {why}", err=True)
        return None
    if process in (None, MAIN):
        return ""
    if process not in others:
        known = f"known: {', '.join(others)}" if others else "no enabled section has a Process"
        raise click.ClickException(f"no enabled section has Process = {process}; {known}")
    return process


def shoal_command(*words: str) -> list[str]:
    """The command `shoal` for a process of ours, which ends with this one.

    -P keeps the current folder off the search path: modules there, perhaps in a log, must not replace others.
    """
    return [sys.executable, "-P", "-m", "shoal.cli", *words, "--parent", str(os.getpid())]


def make_managed_process(name: str) -> ManagedProcess:
    """This command for another process of the vehicle."""
    return ManagedProcess(name, shoal_command(*sys.argv[1:], "--process", name))


def supervise(vehicle: Vehicle, supervisor: Supervisor) -> None:
    """Start the other processes of the vehicle, and again those that end."""

    def poll() -> None:
        for process, words in supervisor.poll():
            (vehicle.daemon.log.error if process.failures else vehicle.daemon.log.info)(
                f"process {process.name} {words}"
            )
        vehicle.kernel.after(POLL_PERIOD, poll)

    vehicle.kernel.soon(poll)
