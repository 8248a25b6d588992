"""`shoal abort`: stops everything that running vehicles do."""

from typing import Any

import click

from shoal.cli.json_output import json_option
from shoal.cli.remote_command import complete_vehicle, network_options
from shoal.cli.vehicle_selection import Say, parse_selection, print_results, run_on_selection
from shoal.network import AsyncRemoteVehicle
from support.terminal_text import printable


@click.command()
@click.argument("vehicles", metavar="VEHICLE...", nargs=-1, required=True, shell_complete=complete_vehicle)
@network_options
@json_option
def abort(vehicles: tuple[str, ...], connection: dict[str, Any], as_json: bool) -> None:
    """Make each VEHICLE stop everything at once, and wait for confirmation.

    VEHICLE is a name, several with commas, or a pattern in quotes such as 'lauv-*'. Each is aborted as soon as it is
    found, independent of the others. If several vehicles have its name or its id, all of them abort.

    Exit status 1 if one does not confirm: assume that it still moves.
    """
    selection = parse_selection(vehicles)

    async def act(there: AsyncRemoteVehicle) -> str:
        clash = there.system.conflict_text
        if clash:
            click.echo(printable(f"{there.name}: {clash}"), err=True)
        await there.abort()
        if not selection.single_name:
            return "all of this name have aborted" if there.system.conflict_text else "has aborted"
        return f"{'all of them have' if there.system.conflict_text else f'{selection.single_name} has'} aborted"

    def show(words: str, say: Say) -> None:
        say(words)

    results = run_on_selection(selection, connection, act, takes_clash=True)
    print_results(selection, results, as_json, show, lambda _: {"aborted": True})
