"""Shared by the commands for running vehicles: options, the way to a vehicle, completion, exit status."""

import asyncio
import contextlib
import functools
import io
from collections.abc import Callable, Coroutine, Mapping
from pathlib import Path
from typing import Any, Final, NoReturn, TypeVar, cast

import click
from click.shell_completion import CompletionItem

import imc
from shoal.cli.completion import completion_items
from shoal.cli.recent_vehicles import recent_vehicles, remember_vehicles
from shoal.network import AsyncRemoteVehicle, Network, NetworkError, connect, make_network
from support.terminal_text import printable

F = TypeVar("F", bound=Callable[..., Any])
T = TypeVar("T")
LOOK = 0.6  # s to look for vehicles for a completion
INTERRUPTED = 130  # exit status after Ctrl-C
PATIENCE = 1.5  # s to look for one vehicle, for what it completes


def network_options(function: F) -> F:
    """Adds --connect and --zenoh-config, which become one argument `connection`: the keywords of `connect`."""

    @click.option(
        "--connect",
        "endpoints",
        multiple=True,
        metavar="ENDPOINT",
        help="Endpoint to look at, such as tcp/10.0.0.7:7447 [default: SHOAL_CONNECT, else this computer].",
    )
    @click.option(
        "--zenoh-config",
        type=click.Path(exists=True, dir_okay=False, path_type=Path),
        help="zenoh's own configuration, for TLS and passwords.",
    )
    @functools.wraps(function)
    def inner(*args: Any, endpoints: tuple[str, ...], zenoh_config: Path | None, **kwargs: Any) -> Any:
        return function(*args, connection={"endpoints": endpoints, "zenoh_config": zenoh_config}, **kwargs)

    return cast(F, inner)


def exit_with_reason(reason: object) -> NoReturn:
    """End with a sentence and the exit status of the answer *no*."""
    click.echo(f"Error: {printable(str(reason))}", err=True)
    raise click.exceptions.Exit(1)


def _echo_note(text: str) -> None:
    click.echo(text, err=True)


def run_on_network(connection: Mapping[str, Any], act: Callable[[Network], Coroutine[Any, Any, T]]) -> T:
    """Run `act` with all networks."""

    async def run() -> T:
        async with make_network(**connection, report=_echo_note) as network:
            try:
                return await act(network)
            finally:
                remember_vehicles(system.name for system in network.vehicles())

    return _finish(run())


def run_on_vehicle(
    name: str, connection: Mapping[str, Any], act: Callable[[AsyncRemoteVehicle], Coroutine[Any, Any, T]]
) -> T:
    """Run `act` with a vehicle; a rejection by the vehicle or the network ends the command with status 1."""

    async def run() -> T:
        async with connect(name, **connection, report=_echo_note) as vehicle:
            remember_vehicles([vehicle.name])
            return await act(vehicle)

    return _finish(run())


def _finish(task: Coroutine[Any, Any, T]) -> T:
    try:
        return asyncio.run(task)
    except NetworkError as error:
        exit_with_reason(error)
    except (imc.EncodeError, ValueError) as error:
        raise click.UsageError(printable(str(error))) from None
    except KeyboardInterrupt:
        raise click.exceptions.Exit(INTERRUPTED) from None


def complete_vehicle(context: click.Context, _: click.Parameter, incomplete: str) -> list[CompletionItem]:
    """The names of vehicles that were found in the last days, else of those on the network; the last of several."""

    async def look(network: Network) -> list[str]:
        await asyncio.sleep(LOOK)
        return [system.name for system in network.vehicles()]

    before, comma, last = incomplete.rpartition(",")
    found = completion_items(recent_vehicles(), last)
    if not found:
        found = completion_items(_quietly(lambda: run_on_network(_network_options_of(context), look)), last)
    return [CompletionItem(f"{before}{comma}{item.value}") for item in found]


def complete_plan(context: click.Context, _: click.Parameter, incomplete: str) -> list[CompletionItem]:
    """The plans of the vehicle, and plan files."""

    async def look(vehicle: AsyncRemoteVehicle) -> list[str]:
        return [plan.name for plan in await vehicle.plan.list()]

    items = completion_items(_complete_from_vehicle(context, look), incomplete)
    return [CompletionItem(incomplete, type="file"), *items]  # bash forgets what comes before it


def complete_entity(context: click.Context, _: click.Parameter, incomplete: str) -> list[CompletionItem]:
    """The entities of the vehicle."""

    async def look(vehicle: AsyncRemoteVehicle) -> list[str]:
        return sorted(await vehicle.param.entity_ids())

    return completion_items(_complete_from_vehicle(context, look), incomplete)


def complete_parameter(context: click.Context, _: click.Parameter, incomplete: str) -> list[CompletionItem]:
    """Entities, and after the colon the parameters of one."""
    entity, colon, _rest = incomplete.partition(":")

    async def look(vehicle: AsyncRemoteVehicle) -> list[str]:
        if not colon:
            return sorted(await vehicle.param.entity_ids())
        return [f"{entity}:{parameter}" for parameter in await vehicle.param.get(entity)]

    return completion_items(_complete_from_vehicle(context, look), incomplete)


def _complete_from_vehicle(
    context: click.Context, look: Callable[[AsyncRemoteVehicle], Coroutine[Any, Any, list[str]]]
) -> list[str]:
    """Completions that `look` finds with the vehicle that was written before."""
    given = context.params.get("vehicle")
    names = getattr(given, "names", (given,))  # of several vehicles the first
    arguments = [*names, *context.args]  # behind an option without its value, click assigns none
    name, connection = next(filter(None, arguments), ""), {**_network_options_of(context), "timeout": PATIENCE}
    return _quietly(lambda: run_on_vehicle(name, connection, look))


def _network_options_of(context: click.Context) -> dict[str, Any]:
    return {key: context.params.get(key) or empty for key, empty in (("endpoints", ()), ("zenoh_config", None))}


def _quietly(look: Callable[[], list[str]]) -> list[str]:
    """Look without messages on failures: they would stand between the words that a shell completes."""
    try:
        with contextlib.redirect_stderr(io.StringIO()):
            return look()
    except (click.ClickException, click.exceptions.Exit):
        return []


vehicle_argument: Final = click.argument("vehicle", shell_complete=complete_vehicle)
