"""`shoal ls`: the vehicles on the network."""

import asyncio
import math
import time
from typing import Any

import click
from rich.console import Console
from rich.live import Live
from rich.table import Table

import imc
from imc.discovery import displayable_name
from shoal.cli.json_output import json_option, print_json_line
from shoal.cli.remote_command import exit_with_reason, network_options, run_on_network
from shoal.cli.time_texts import format_clock_time, parse_duration_option
from shoal.network import NEAR, Network, NetworkSystem
from support.positions import format_position
from support.terminal_text import printable

KINDS = (
    imc.EntityList,
    imc.EntityInfo,
    imc.EntityState,
    imc.VehicleState,
    imc.EstimatedState,
    imc.PlanControlState,
    imc.FuelLevel,
    imc.Heartbeat,
)
SHOWN = (imc.VehicleState, imc.EstimatedState, imc.EntityState)
FIRST, LONGEST = 0.2, 0.75  # s to find vehicles and receive their states
STEP, LATE = 0.02, 0.1  # s between two looks, and the most that one counts: a busy computer answers late, too
REFRESH = 0.25  # s


@click.command()
@click.option("--watch", is_flag=True, help="Keep watching; Ctrl-C ends.")
@click.option(
    "--for", "duration", callback=parse_duration_option, metavar="TIME", help="Listen or watch for this time."
)
@network_options
@json_option
def ls(watch: bool, duration: float | None, connection: dict[str, Any], as_json: bool) -> None:
    """List all vehicles on the network: state, position, battery, errors, age of the last message.

    Exit status 1 if no vehicle is found. --watch prints a line for each change if its output is no terminal, or with
    --json.
    """

    async def act(network: Network) -> None:
        network.listen(None, KINDS)
        if watch:
            await (
                _draw(network, duration)
                if Console().is_terminal and not as_json
                else _print_changes(network, duration, as_json)
            )
            return
        await _gather(network, duration)
        found = network.vehicles()
        if as_json:
            print_json_line([system_to_dict(system) for system in found])
        elif found:
            console = Console(highlight=False, markup=False, emoji=False, width=None if Console().is_terminal else 200)
            console.print(_table(found))
            for system in found:
                for text in conflict_texts(system):
                    click.echo(printable(f"{displayable_name(system.name)}: {text}"), err=True)
        if not found:
            exit_with_reason(network.search.no_vehicle_text())
        for text in network.search.link_troubles:
            click.echo(printable(text), err=True)

    run_on_network(connection, act)


async def _gather(network: Network, duration: float | None) -> None:
    """Wait a short time until every vehicle that is there has reported what is shown.

    A program that has received the announcement, and not answered, may be a vehicle on a busy computer: it has `NEAR`.
    """
    past, looked = 0.0, time.monotonic()
    longest = (
        LONGEST if network.search.discovery_timeout <= NEAR else network.search.discovery_timeout
    )  # over a radio, packets get lost and come late
    questions, known = StateQueries(network), 0
    while past < (network.search.discovery_timeout if duration is None else duration):
        await asyncio.sleep(STEP)
        elapsed, looked = time.monotonic() - looked, time.monotonic()
        past += elapsed if duration is not None else min(LATE, elapsed)
        there = network.vehicles()
        questions.send_due(there)
        before, known = known, sum(len(system.latest) for system in there)  # integers
        if duration is None:
            network.search.explain(past, there)
        if duration is not None or not there or past < FIRST or (network.search.awaits_answers and past < NEAR):
            continue
        is_complete = all(system.latest_message(kind) is not None for system in there for kind in SHOWN)
        if past > longest or (is_complete and known == before and not any(map(has_unlabeled_errors, there))):
            return


class StateQueries:
    """Requests from systems what they would send too late or not at all; each once a second at most."""

    def __init__(self, network: Network) -> None:
        self._network = network
        self._asked: dict[tuple[str, str], float] = {}

    def send_due(self, systems: list[NetworkSystem]) -> None:
        """Ask for the labels of entities with errors and, where all last messages do not come by themselves, states."""
        for system in systems:
            if has_unlabeled_errors(system) and self._is_due(system, "labels"):
                self._network.request_labels(system)
            delivers_all = any(link.delivers_all for link in system.links.values())
            if not delivers_all and system.latest_message(imc.EntityState) is None and self._is_due(system, "states"):
                self._network.send(system, imc.QueryEntityState())

    def _is_due(self, system: NetworkSystem, what: str) -> bool:
        now = time.monotonic()
        if system.id is None or now - self._asked.get((system.name, what), -math.inf) <= 1.0:
            return False
        self._asked[system.name, what] = now
        return True


def has_reported_states(system: NetworkSystem) -> bool:
    """Whether a system has reported the states of its entities; else its errors are unknown."""
    return any(system.latest_message(kind) is not None for kind in (imc.EntityState, imc.VehicleState))


def has_unlabeled_errors(system: NetworkSystem) -> bool:
    return any(label.isdecimal() for label in system.errors)


async def _draw(network: Network, duration: float | None) -> None:
    """A table that follows."""
    began = time.monotonic()
    console = Console(highlight=False, markup=False, emoji=False)
    with Live(_table([]), console=console, refresh_per_second=10) as live:
        questions = StateQueries(network)
        while duration is None or time.monotonic() - began < duration:
            questions.send_due(network.vehicles())
            live.update(_table(network.vehicles()))
            await network.wait_for_change(REFRESH)


async def _print_changes(network: Network, duration: float | None, as_json: bool) -> None:
    """A line when a vehicle appears, changes its state or its troubles, or is gone."""
    before: dict[str, str] = {}
    began = time.monotonic()
    questions = StateQueries(network)
    while duration is None or time.monotonic() - began < duration:
        questions.send_due(network.vehicles())
        now = {system.name: "; ".join([format_state(system), *conflict_texts(system)]) for system in network.vehicles()}
        for name in sorted({*before, *now}):
            if before.get(name) == now.get(name):
                continue
            event = "appeared" if name not in before else "gone" if name not in now else "changed"
            if as_json:
                print_json_line({"time": time.time(), "event": event, **system_to_dict(network.systems[name])})
            else:
                click.echo(
                    printable(f"{format_clock_time(time.time())} {displayable_name(name)} {now.get(name) or event}")
                )
        before = now
        await network.wait_for_change(REFRESH)


def system_to_dict(system: NetworkSystem) -> dict[str, object]:
    """State of a vehicle; angles in rad, depth in m, battery in %, age in s."""
    vehicle, state = system.latest_message(imc.VehicleState), system.latest_message(imc.EstimatedState)
    plan, fuel = system.latest_message(imc.PlanControlState), system.latest_message(imc.FuelLevel)
    lat, lon = imc.coordinates.absolute_position(state)[:2] if state is not None else (math.nan, math.nan)
    return {
        "name": system.name,
        "id": system.id,
        "mode": _name(imc.VehicleState.OpMode, vehicle.op_mode) if vehicle is not None else None,
        "plan": plan.plan_id if plan is not None else None,
        "plan_state": _name(imc.PlanControlState.State, plan.state) if plan is not None else None,
        "progress": plan.plan_progress if plan is not None and plan.plan_progress >= 0.0 else None,
        "lat": lat,
        "lon": lon,
        "depth": state.depth if state is not None else None,
        "battery": fuel.value if fuel is not None else None,
        "errors": list(system.errors) if has_reported_states(system) else None,
        "age": system.age,
        "network": sorted(system.links),
        "places": system.addresses,
        "other_ids": sorted(system.others),
        "clash": system.conflict_text or None,
    }


def format_state(system: NetworkSystem) -> str:
    """Mode and plan."""
    vehicle, plan = system.latest_message(imc.VehicleState), system.latest_message(imc.PlanControlState)
    if system.contact_timeout:
        return f"data within {system.contact_timeout:.0f} s"
    mode = _name(imc.VehicleState.OpMode, vehicle.op_mode) if vehicle is not None else "here"
    if plan is None or plan.state not in (
        imc.PlanControlState.State.EXECUTING,
        imc.PlanControlState.State.INITIALIZING,
    ):
        return mode
    return f"{mode} {displayable_name(plan.plan_id)}"


def conflict_texts(system: NetworkSystem) -> list[str]:
    """Conflicts for the operator: two vehicles of one name or id."""
    return [f"{system.conflict_text}; end all but one"] if system.conflict_text else []


def _table(systems: list[NetworkSystem]) -> Table:
    table = Table(box=None, header_style="dim", pad_edge=False)
    for column in ("vehicle", "id", "state", "position", "depth", "battery", "errors", "age", "by"):
        table.add_column(
            column, no_wrap=column != "errors", justify="right" if column in ("depth", "battery") else "left"
        )
    for system in systems:
        values, state = system_to_dict(system), system.latest_message(imc.EstimatedState)
        plan = system.latest_message(imc.PlanControlState)
        progress = f" {plan.plan_progress:.0f} %" if values["progress"] is not None and plan is not None else ""
        fuel = system.latest_message(imc.FuelLevel)
        table.add_row(
            displayable_name(system.name) + ("!" if system.conflict_text else ""),
            "" if system.id is None else f"0x{system.id:04X}",
            format_state(system) + progress,
            "" if state is None else format_position(*imc.coordinates.absolute_position(state)[:2]),
            "" if state is None else f"{state.depth:.1f} m",
            "" if fuel is None else f"{fuel.value:.0f} %",
            printable(",".join(system.errors)) if has_reported_states(system) else "?",
            f"{system.age:.1f} s",
            ", ".join(sorted(system.links)),
        )
    return table


def _name(names: Any, value: int) -> str:
    return names(value).name if value in set(names) else str(value)
