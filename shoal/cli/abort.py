"""`shoal abort`: stops everything that a running vehicle does."""

from typing import Any

import click

from shoal.cli.remote_command import json_option, network_options, print_json_line, run_on_namesakes, vehicle_argument
from shoal.network import AsyncRemoteVehicle


@click.command()
@vehicle_argument
@network_options
@json_option
def abort(vehicle: str, connection: dict[str, Any], as_json: bool) -> None:
    """Have VEHICLE stop everything at once, and wait until it says that it has.

    If several vehicles have this name or its id, all of them abort.

    Exit status 1 if it does not confirm it: then act as if it went on.
    """

    async def act(there: AsyncRemoteVehicle) -> str:
        await there.abort()
        return "all of them have" if there.system.conflict_text else f"{vehicle} has"

    who = run_on_namesakes(vehicle, connection, act)
    if as_json:
        print_json_line({"aborted": True})
    else:
        click.echo(f"{who} aborted")
