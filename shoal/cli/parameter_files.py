"""Commands of `shoal param` for all parameters at once: `describe`, `dump` and `load`."""

from collections import Counter
from dataclasses import asdict
from pathlib import Path
from typing import Any

import click

from shoal.cli.console_tables import format_range
from shoal.cli.remote_command import run_on_network
from shoal.cli.vehicle_selection import (
    Say,
    VehicleResult,
    VehicleSelection,
    act_on_selection,
    no_match_text,
    print_results,
    run_on_selection,
)
from shoal.network import (
    AsyncRemoteVehicle,
    FileSection,
    Network,
    NetworkError,
    ParameterDescription,
    ParameterFileError,
    ParameterOutcome,
    PlannedChange,
    UnfitParameters,
    VehicleParameters,
    check_parameter_name,
    check_parameters,
    describe_parameters,
    dump_parameters,
    load_parameters,
    parameter_file_text,
    read_parameter_file,
)
from support.atomic_files import write_file
from support.file_names import file_name_of
from support.terminal_text import printable

NAME = "{vehicle}"  # in the name of a file
WIDTH = 14  # of the word before each parameter


def describe(
    vehicles: VehicleSelection, places: list[tuple[str, str]], connection: dict[str, Any], as_json: bool
) -> None:
    """Print type, unit, range, default, scope and visibility of parameters by entity and name; without, of all."""

    async def act(there: AsyncRemoteVehicle) -> list[ParameterDescription]:
        if not places:
            found = await describe_parameters(there, await there.param.entity_ids())
            return [one for values in found.values() for one in values.values()]
        for entity in dict.fromkeys(entity for entity, _ in places):
            await there.param.get(entity)  # names what is there instead
        found = await describe_parameters(there, [entity for entity, _ in places])
        chosen: list[ParameterDescription] = []
        for entity, name in places:
            values = found.get(entity, {})
            if name:
                check_parameter_name(entity, name, values)
            chosen += [values[name]] if name else values.values()
        return chosen

    results = run_on_selection(vehicles, connection, act)
    print_results(vehicles, results, as_json, _show_descriptions, lambda found: [asdict(one) for one in found])


def dump(vehicles: VehicleSelection, output: str | None, connection: dict[str, Any], as_json: bool) -> None:
    """Write the parameters of all entities to a file for each vehicle, or print them."""
    if output is not None and not vehicles.single_name and NAME not in output:
        raise click.UsageError(f"each vehicle needs a file of its own: write {NAME} in its name")
    suffix = Path(output).suffix.lower() if output is not None else ".ini"
    if suffix not in (".ini", ".yaml", ".yml"):
        raise click.UsageError(f"{output}: a file of parameters ends with .ini or .yaml")
    results = run_on_selection(vehicles, connection, dump_parameters)

    def show(found: VehicleParameters, say: Say) -> None:
        text = parameter_file_text(found, suffix)
        if output is None:
            say(text.rstrip("\n"))
            return
        path = Path(output.replace(NAME, file_name_of(found.vehicle)))
        write_file(path, text.encode(errors="surrogateescape"))
        count = sum(map(len, found.values.values()))  # integers
        say(printable(f"{count} parameters of {len(found.values)} entities written to {path}"))

    def is_whole(found: VehicleParameters) -> bool:
        if found.unknown:
            entities = ", ".join(found.unknown)
            words = f"{found.vehicle}: not whole: no answer from {len(found.unknown)} entities ({entities})"
            click.echo(f"Error: {printable(words)}", err=True)
        return not found.unknown

    if output is not None:
        as_json = False
    try:
        print_results(vehicles, results, as_json, show, asdict, is_whole)
    except ParameterFileError as error:
        raise click.ClickException(printable(str(error))) from None


def load(vehicles: VehicleSelection, path: Path, connection: dict[str, Any], as_json: bool) -> None:
    """Set the parameters of a file on each vehicle, after all of them were found to fit, and read them back."""
    try:
        sections = read_parameter_file(path)
    except ParameterFileError as error:
        raise click.ClickException("\n".join(map(printable, str(error).split("\n")))) from None

    async def work(network: Network) -> list[VehicleResult[list[ParameterOutcome]]]:
        checked = await act_on_selection(network, vehicles, lambda there: _check(there, sections))
        if not checked:
            raise NetworkError(no_match_text(network, vehicles))
        plans = {one.name: one.value for one in checked if isinstance(one.value, list)}
        if len(plans) < len(checked):
            return [_refused(one) for one in checked]
        found = VehicleSelection(tuple(plans), ())

        async def act(there: AsyncRemoteVehicle) -> list[ParameterOutcome]:
            return await load_parameters(there, plans[there.name])

        return await act_on_selection(network, found, act)

    results = run_on_network(connection, work)
    print_results(vehicles, results, as_json, _show_outcomes, lambda found: [one._asdict() for one in found], _all_set)


async def _check(there: AsyncRemoteVehicle, sections: list[FileSection]) -> list[PlannedChange] | str:
    """List the changes, or the reason why nothing may be sent; print a line for each reason."""
    try:
        return await check_parameters(there, sections)
    except UnfitParameters as error:
        lines = str(error).split("\n")
        for line in lines:
            click.echo(f"{printable(there.name)}: {printable(line)}", err=True)
        return f"{len(lines)} of the values in the file do not fit"


def _refused(one: VehicleResult[list[PlannedChange] | str]) -> VehicleResult[list[ParameterOutcome]]:
    reason = one.error or (one.value if isinstance(one.value, str) else "another vehicle has rejected the file")
    return VehicleResult(one.name, error=f"{one.name}: nothing was sent: {reason}")


def _show_outcomes(found: list[ParameterOutcome], say: Say) -> None:
    for one in found:
        if one.outcome != "unchanged":
            why = f"  ({one.reason})" if one.reason else ""
            say(printable(f"{one.outcome:{WIDTH}}{one.entity}:{one.name} = {one.wanted}  (was {one.before}){why}"))
    counts = Counter(one.outcome for one in found)
    say(", ".join(f"{counts[word]} {word}" for word in ("set", "unchanged", "rejected", "no answer")))


def _all_set(found: list[ParameterOutcome]) -> bool:
    return all(one.outcome in ("set", "unchanged") for one in found)


def _show_descriptions(found: list[ParameterDescription], say: Say) -> None:
    for one in found:
        say(printable(f"{one.entity}:{one.name} = {one.value}" + (f" {one.unit}" if one.unit not in ("", "1") else "")))
        facts = {
            "type": one.type,
            "unit": one.unit,
            "range": format_range(one.minimum, one.maximum),
            "one of": ", ".join(one.choices),
            "items": " to ".join(map(str, dict.fromkeys(one.size))) if one.size else "",
            "default": one.default,
            "scope": one.scope,
            "visibility": one.visibility,
            "editable": {True: "yes", False: "no, only before the start", None: ""}[one.editable],
            "meaning": one.description,
        }
        for name, text in facts.items():
            if text:
                say(printable(f"    {name:12}{text}"))
        if one.source != "vehicle":
            known = "this is what Shoal's task of this name declares" if one.source else "nothing more is known"
            say(f"    the vehicle gives no types and ranges; {known}")
