"""`shoal param`: the parameters of running vehicles."""

from collections.abc import Callable
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import click

from shoal.cli.json_output import json_option
from shoal.cli.parameter_files import describe, dump, load
from shoal.cli.remote_command import complete_parameter, network_options
from shoal.cli.vehicle_selection import Say, VehicleSelection, print_results, run_on_selection, vehicles_argument
from shoal.network import AsyncRemoteVehicle, PartialAnswer, check_parameter_name
from support.terminal_text import printable

ACTIONS = ("list", "get", "set", "save", "describe", "dump", "load")
ALONE = ("list", "describe", "dump")  # of all entities, if none is named


@dataclass
class FoundParameters:
    """Values by entity and name, and what is missing of them in words."""

    values: dict[str, dict[str, str]] = field(default_factory=dict[str, dict[str, str]])
    missing: str = ""


@click.command()
@vehicles_argument
@click.argument("action", type=click.Choice(ACTIONS))
@click.argument("words", metavar="[ENTITY[:PARAMETER][=VALUE] | FILE]...", nargs=-1, shell_complete=complete_parameter)
@click.option("-o", "--output", metavar="FILE", help="dump: write to this .ini or .yaml.")
@network_options
@json_option
def param(
    vehicle: VehicleSelection,
    action: str,
    words: tuple[str, ...],
    output: str | None,
    connection: dict[str, Any],
    as_json: bool,
) -> None:
    """Show, set and save parameters of VEHICLE, by the label of the entity.

    \b
    shoal param lauv-noptilus-1 list
    shoal param lauv-noptilus-1 get "Path Control" "GPS:Rate"
    shoal param lauv-noptilus-1 set "Path Control:Corridor -- Width=3"
    shoal param lauv-noptilus-1 save "Path Control"
    shoal param lauv-noptilus-1 describe "Path Control:Corridor -- Width"
    shoal param lauv-noptilus-1 dump -o today.ini
    shoal param lauv-noptilus-1,lauv-noptilus-2 load today.ini

    VEHICLE is a name, several with commas, or a pattern in quotes such as 'lauv-*'.
    load checks the whole file before it sends anything, and reads back what it has set.
    A new value is gone at the next start of the vehicle unless it is saved. Exit status 1 if a vehicle
    rejects, or some entities do not answer: the others are shown.
    """
    if output is not None and action != "dump":
        raise click.UsageError(f"--output is for dump, not for {action}")
    if not words and action not in ALONE:
        example = "a file" if action == "load" else "'Path Control:Control Frequency'"
        raise click.UsageError(f"name what to {action}, such as {example}")
    if action == "dump":
        if words:
            raise click.UsageError("a dump has all entities; name the file with --output")
        dump(vehicle, output, connection, as_json)
    elif action == "load":
        file, *others = words
        if others:
            raise click.UsageError("load takes one file")
        load(vehicle, Path(file), connection, as_json)
    elif action == "describe":
        describe(vehicle, [parse_place(word, with_value=False)[:2] for word in words], connection, as_json)
    else:
        _values(vehicle, action, words, connection, as_json)


def _values(
    vehicle: VehicleSelection, action: str, words: tuple[str, ...], connection: dict[str, Any], as_json: bool
) -> None:
    """list, get, set and save."""
    places = [parse_place(word, with_value=action == "set") for word in words]
    if action == "save" and any(parameter for _, parameter, _ in places):
        raise click.UsageError("an entity is saved as a whole: leave out the parameter")

    async def act(there: AsyncRemoteVehicle) -> FoundParameters:
        found = FoundParameters()
        if action == "list" and not places:
            try:
                return FoundParameters(await there.param.list())
            except PartialAnswer as error:
                return FoundParameters({entity: dict(values) for entity, values in error.found.items()}, str(error))
        for entity, parameter, value in places:
            known = found.values.setdefault(entity, {})
            if action == "save":
                await there.param.save(entity)
            elif action == "set":
                known.update(await there.param.set(entity, {parameter: value}))
            else:
                values = await there.param.get(entity)
                if parameter:
                    check_parameter_name(entity, parameter, values)
                known.update({parameter: values[parameter]} if parameter else values)
        return found

    results = run_on_selection(vehicle, connection, act)
    print_results(vehicle, results, as_json, _printer(action), lambda found: found.values, _is_whole)


def _is_whole(found: FoundParameters) -> bool:
    if found.missing:
        click.echo(f"Error: {printable(found.missing)}", err=True)
    return not found.missing


def _printer(action: str) -> Callable[[FoundParameters, Say], None]:
    def show(found: FoundParameters, say: Say) -> None:
        for entity, values in found.values.items():
            if action == "save":
                say(f"{printable(entity)} saved")
            for name, value in sorted(values.items()):
                say(printable(f"{entity}:{name} = {value}"))

    return show


def parse_place(word: str, *, with_value: bool) -> tuple[str, str, str]:
    """Entity, parameter and value of ENTITY:PARAMETER=VALUE. Raises UsageError."""
    place, equals, value = word.partition("=")
    entity, _, parameter = place.partition(":")
    if with_value and not (equals and parameter.strip()):
        raise click.UsageError(f"{word!r} is not ENTITY:PARAMETER=VALUE")
    if not with_value and equals:
        raise click.UsageError(f"{word!r}: only set takes a value")
    return entity.strip(), parameter.strip(), value.strip()
