"""Vehicles that a command is for: one, several with commas between them, or all whose names match a pattern."""

import asyncio
import time
from collections.abc import Callable, Coroutine, Iterable, Mapping
from dataclasses import dataclass
from fnmatch import fnmatchcase
from typing import Any, Final, Generic, NamedTuple, TypeVar, cast

import click

from shoal.cli.json_output import print_json_line
from shoal.cli.remote_command import complete_vehicle, run_on_network
from shoal.network import AsyncRemoteVehicle, Network, NetworkError
from support.terminal_text import printable

T = TypeVar("T")
WILD = frozenset("*?[")
Say = Callable[[str], None]


class VehicleSelection(NamedTuple):
    """Names of vehicles, and patterns of names: * for any text, ? for a letter, [ab] for one of some letters."""

    names: tuple[str, ...]
    patterns: tuple[str, ...]

    @property
    def single_name(self) -> str:
        """The name, if one vehicle is named; else empty."""
        return self.names[0] if len(self.names) == 1 and not self.patterns else ""

    def matches(self, name: str) -> bool:
        """Whether a vehicle that was not named is meant."""
        return name not in self.names and any(fnmatchcase(name, pattern) for pattern in self.patterns)

    def __str__(self) -> str:
        return ", ".join((*self.names, *self.patterns))


@dataclass
class VehicleResult(Generic[T]):
    """Result of an action on one vehicle: `value`, or `error` as text."""

    name: str
    value: T | None = None
    error: str = ""


def parse_selection(words: Iterable[str]) -> VehicleSelection:
    """The selection that some arguments mean. Raises UsageError if one names nothing."""
    names = [name.strip() for word in words for name in word.split(",")]
    if not all(names):
        raise click.UsageError("the name of a vehicle is empty")
    known = dict.fromkeys("_".join(name.split()) for name in names)
    wild = tuple(name for name in known if WILD & set(name))
    return VehicleSelection(tuple(name for name in known if name not in wild), wild)


def _parse_argument(_: click.Context, __: click.Parameter, given: str | tuple[str, ...]) -> VehicleSelection:
    """Click callback."""
    return parse_selection((given,) if isinstance(given, str) else given)


vehicles_argument: Final = click.argument("vehicle", callback=_parse_argument, shell_complete=complete_vehicle)
"""One word for one or more vehicles."""


async def act_on_selection(
    network: Network,
    selection: VehicleSelection,
    act: Callable[[AsyncRemoteVehicle], Coroutine[Any, Any, T]],
    *,
    takes_clash: bool = False,
    on_error: Callable[[VehicleResult[T]], object] = lambda _: None,
) -> list[VehicleResult[T]]:
    """Act on all selected vehicles at once, each as soon as it is found; the results in the order of their names.

    Vehicles that match a pattern are looked for as long as `shoal ls` does. `takes_clash` as in `Network.find_system`.
    `on_error` gets a result with an error at once, while the others continue.
    """
    tasks: dict[str, asyncio.Task[VehicleResult[T]]] = {}

    def begin(name: str) -> None:
        tasks[name] = asyncio.create_task(run(name))

    async def run(name: str) -> VehicleResult[T]:
        try:
            system = await network.find_system(name, takes_clash=takes_clash)
            return VehicleResult(name, await act(AsyncRemoteVehicle(network, system)))
        except NetworkError as error:
            result = VehicleResult[T](name, error=str(error))
            on_error(result)
            return result

    try:
        for name in selection.names:
            begin(name)
        await _match(network, selection, begin)
        order = [*selection.names, *sorted(tasks.keys() - set(selection.names))]
        return await asyncio.gather(*(tasks[name] for name in order))
    finally:
        for task in tasks.values():
            task.cancel()


def run_on_selection(
    selection: VehicleSelection,
    connection: Mapping[str, Any],
    act: Callable[[AsyncRemoteVehicle], Coroutine[Any, Any, T]],
    *,
    takes_clash: bool = False,
    on_error: Callable[[VehicleResult[T]], object] = lambda _: None,
) -> list[VehicleResult[T]]:
    """The same with all networks. Ends with status 1 if no vehicle matches a pattern, or the only one named fails."""

    async def work(network: Network) -> list[VehicleResult[T]]:
        def report(result: VehicleResult[T]) -> None:
            if not selection.single_name:
                on_error(result)

        found = await act_on_selection(network, selection, act, takes_clash=takes_clash, on_error=report)
        if not found:
            raise NetworkError(no_match_text(network, selection))
        if selection.single_name and found[0].error:
            raise NetworkError(found[0].error)
        return found

    return run_on_network(connection, work)


def no_match_text(network: Network, selection: VehicleSelection) -> str:
    """The error that no vehicle matches, with those that are there."""
    there = ", ".join(system.name for system in network.vehicles())
    return f"no vehicle matches {selection}; there are {there}" if there else network.search.no_vehicle_text()


def print_results(
    selection: VehicleSelection,
    results: list[VehicleResult[T]],
    as_json: bool,
    show: Callable[[T, Say], object],
    to_json: Callable[[T], object],
    is_good: Callable[[T], bool] = lambda _: True,
) -> None:
    """Print the result of each vehicle; several begin each line with their names, or have a line of JSON each.

    Ends the command with status 1 if one failed.
    """
    single, failed = bool(selection.single_name), False
    for result in results:
        name, value = result.name, result.value
        if result.error:
            failed = True
            if as_json:
                print_json_line({"vehicle": name, "result": None, "error": result.error})
            print_error(result)
            continue
        good = cast(T, value)
        failed |= not is_good(good)
        if as_json:
            print_json_line(to_json(good) if single else {"vehicle": name, "result": to_json(good), "error": None})
        else:
            show(good, click.echo if single else prefixed(name))
    if failed:
        raise click.exceptions.Exit(1)


def print_error(result: VehicleResult[Any]) -> None:
    """Print why an action on one vehicle failed."""
    words = result.error if result.error.startswith(result.name) else f"{result.name}: {result.error}"
    click.echo(f"Error: {printable(words)}", err=True)


def prefixed(name: str, *, err: bool = False) -> Say:
    """Prints lines that begin with the name of a vehicle."""

    def say(text: str) -> None:
        for line in text.splitlines():
            click.echo(f"{printable(name)}: {line}", err=err)

    return say


async def _match(network: Network, selection: VehicleSelection, found: Callable[[str], object]) -> None:
    """Call `found` with the name of each vehicle that matches a pattern, as it appears."""
    began = time.monotonic()
    seen: set[str] = set()
    while selection.patterns and (past := time.monotonic() - began) < network.search.discovery_timeout:
        there = [system for system in network.vehicles() if selection.matches(system.name)]
        for system in there:
            if system.name not in seen and system.id is not None:
                seen.add(system.name)
                found(system.name)
        network.search.explain(past, there)
        await network.wait_for_change(0.05)
