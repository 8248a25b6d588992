"""`shoal param`: the parameters of a running vehicle."""

from typing import Any

import click

from shoal.cli.remote_command import (
    complete_parameter,
    exit_with_reason,
    json_option,
    network_options,
    print_json_line,
    run_on_vehicle,
    vehicle_argument,
)
from shoal.network import AsyncRemoteVehicle, PartialAnswer, check_parameter_name
from support.terminal_text import printable

ACTIONS = ("list", "get", "set", "save")


@click.command()
@vehicle_argument
@click.argument("action", type=click.Choice(ACTIONS))
@click.argument("words", metavar="[ENTITY[:PARAMETER][=VALUE]]...", nargs=-1, shell_complete=complete_parameter)
@network_options
@json_option
def param(vehicle: str, action: str, words: tuple[str, ...], connection: dict[str, Any], as_json: bool) -> None:
    """Show, set and save parameters of VEHICLE, by the label of the entity.

    \b
    shoal param lauv-noptilus-1 list
    shoal param lauv-noptilus-1 get "Path Control" "GPS:Rate"
    shoal param lauv-noptilus-1 set "Path Control:Corridor -- Width=3"
    shoal param lauv-noptilus-1 save "Path Control"

    A new value is gone at the next start of the vehicle unless it is saved. Exit status 1 if the vehicle
    refuses, or some entities do not answer: what is known is shown.
    """
    if not words and action != "list":
        raise click.UsageError(f"name what to {action}, such as 'Path Control:Control Frequency'")
    places = [_place(word, with_value=action == "set") for word in words]
    if action == "save" and any(parameter for _, parameter, _ in places):
        raise click.UsageError("an entity is saved as a whole: leave out the parameter")

    incomplete: list[str] = []

    async def act(there: AsyncRemoteVehicle) -> dict[str, dict[str, str]]:
        if action == "list" and not places:
            try:
                return await there.param.list()
            except PartialAnswer as error:
                incomplete.append(str(error))
                return {entity: dict(values) for entity, values in error.found.items()}
        found: dict[str, dict[str, str]] = {}
        for entity, parameter, value in places:
            if action == "save":
                await there.param.save(entity)
                found.setdefault(entity, {})
            elif action == "set":
                found.setdefault(entity, {}).update(await there.param.set(entity, {parameter: value}))
            else:
                values = await there.param.get(entity)
                if parameter:
                    check_parameter_name(entity, parameter, values)
                chosen = {parameter: values[parameter]} if parameter else values
                found.setdefault(entity, {}).update(chosen)
        return found

    found = run_on_vehicle(vehicle, connection, act)
    if as_json:
        print_json_line(found)
    else:
        _print(action, found)
    if incomplete:
        exit_with_reason(incomplete[0])


def _print(action: str, found: dict[str, dict[str, str]]) -> None:
    for entity, values in found.items():
        if action == "save":
            click.echo(f"{printable(entity)} saved")
        for name, value in sorted(values.items()):
            click.echo(printable(f"{entity}:{name} = {value}"))


def _place(word: str, *, with_value: bool) -> tuple[str, str, str]:
    """Entity, parameter and value of ENTITY:PARAMETER=VALUE. Raises UsageError."""
    place, equals, value = word.partition("=")
    entity, _, parameter = place.partition(":")
    if with_value and not (equals and parameter.strip()):
        raise click.UsageError(f"{word!r} is not ENTITY:PARAMETER=VALUE")
    if not with_value and equals:
        raise click.UsageError(f"{word!r}: only set takes a value")
    return entity.strip(), parameter.strip(), value.strip()
