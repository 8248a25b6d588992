"""`shoal plan`: the plans of running vehicles."""

import json
import math
from contextlib import nullcontext, suppress
from dataclasses import asdict
from datetime import UTC, datetime
from functools import partial
from pathlib import Path
from typing import Any

import click

import imc
from shoal.cli.json_output import json_option
from shoal.cli.remote_command import INTERRUPTED, complete_plan, network_options
from shoal.cli.vehicle_selection import (
    Say,
    VehicleSelection,
    prefixed,
    print_results,
    run_on_selection,
    vehicles_argument,
)
from shoal.network import AsyncRemoteVehicle, NoAnswer, PlanEstimate, PlanOutcome, Refused, VehicleLost, format_percent
from support.atomic_files import write_output
from support.terminal_text import printable

ACTIONS = ("list", "put", "get", "delete", "start", "stop", "status")
ALONE = ("list", "stop", "status")
STEP = 10.0  # %; progress between two lines without a terminal


@click.command()
@vehicles_argument
@click.argument("action", type=click.Choice(ACTIONS))
@click.argument("plan", required=False, shell_complete=complete_plan)
@click.option("--no-wait", is_flag=True, help="start: do not wait for the end of the plan.")
@click.option("--calibrate", is_flag=True, help="start: calibrate first.")
@click.option("-o", "--output", type=click.Path(dir_okay=False, path_type=Path), help="get: write to this file.")
@network_options
@json_option
def plan(
    vehicle: VehicleSelection,
    action: str,
    plan: str | None,
    no_wait: bool,
    calibrate: bool,
    output: Path | None,
    connection: dict[str, Any],
    as_json: bool,
) -> None:
    """List, transfer, start and stop plans of VEHICLE; PLAN is a file or the name of a stored plan.

    \b
    shoal plan lauv-noptilus-1 put survey.yaml
    shoal plan lauv-noptilus-1 start survey

    VEHICLE is a name, several with commas, or a pattern in quotes such as 'lauv-*'.
    A file is YAML or JSON of Shoal, .plan or .waypoints of QGroundControl, KML, GPX or GeoJSON; `get -o` writes them.

    start shows the progress and ends with the plan: exit status 0 if it was completed, 1 if the vehicle rejected it or
    it failed. Ctrl-C ends only this command; the plan continues.
    """
    if (plan is None) != (action in ALONE):
        raise click.UsageError(f"{action} takes no plan" if plan else f"name the plan to {action}")
    for option, given, of in (
        ("--no-wait", no_wait, "start"),
        ("--calibrate", calibrate, "start"),
        ("--output", output, "get"),
    ):
        if given and action != of:
            raise click.UsageError(f"{option} is for {of}, not for {action}")
    chosen = _load(plan) if plan and action in ("put", "start") else plan or ""
    if action == "put" and isinstance(chosen, str):
        raise click.UsageError(f"{plan}: there is no such file")
    if output is not None and not vehicle.single_name:
        raise click.UsageError("--output is for the plan of one vehicle")

    async def act(there: AsyncRemoteVehicle) -> Any:
        what = _convert(chosen, there) if isinstance(chosen, Path) else chosen
        if action == "list":
            return await there.plan.list()
        if action == "status":
            return await there.plan.status()
        if action == "stop":
            return await there.plan.stop()
        if action == "get":
            return await there.plan.get(str(what))
        if action == "delete":
            return await there.plan.delete(str(what))
        if isinstance(what, str):
            return await start(there, what)
        try:
            return await (put(there, what) if action == "put" else start(there, what))
        except Refused as error:
            from shoal.missions import locate_reason

            reason = str(error).removeprefix(f"{what.plan_id}: ")
            located = locate_reason(Path(plan or ""), reason)
            raise Refused(located if located != reason else str(error)) from None

    async def put(there: AsyncRemoteVehicle, what: imc.PlanSpecification) -> PlanEstimate:
        await there.plan.put(what)
        with suppress(NoAnswer, VehicleLost):  # it is stored all the same
            return await there.plan.estimate(what.plan_id)
        return PlanEstimate()

    async def start(there: AsyncRemoteVehicle, what: str | imc.PlanSpecification) -> Any:
        name = what if isinstance(what, str) else what.plan_id
        say = None if vehicle.single_name else prefixed(there.name, err=True)
        estimates: list[PlanEstimate] = []

        def keep(estimate: PlanEstimate) -> None:
            estimates.append(estimate)
            if not as_json:
                (say or partial(click.echo, err=True))(estimate.describe())

        begin = partial(there.plan.start, what, calibrate=calibrate, estimated=keep)
        if no_wait or as_json:
            return await begin(wait=not no_wait) or estimates[-1]
        display = PlanProgressDisplay(name, say)
        with display.bar or nullcontext():
            return await begin(progress=display) or estimates[-1]

    try:
        results = run_on_selection(vehicle, connection, act)
    except click.exceptions.Exit as ending:
        if ending.exit_code == INTERRUPTED and action == "start":
            click.echo(f"\na plan that has started continues; `shoal plan {vehicle} stop` stops it", err=True)
        raise
    name = chosen.stem if isinstance(chosen, Path) else chosen if isinstance(chosen, str) else chosen.plan_id
    print_results(
        vehicle,
        results,
        as_json and output is None,
        lambda found, say: _show(action, name, found, output, as_json, say),
        lambda found: _to_json(action, found),
        lambda found: not isinstance(found, PlanOutcome) or found.completed,
    )


def _load(plan: str) -> str | imc.PlanSpecification | Path:
    """The plan in a file, the path of a mission that depends on the vehicle, else the name of a plan.

    Raises ClickException for a wrong file.
    """
    from shoal.missions import MISSION_SUFFIXES, PLAN_SUFFIXES, PlanFileError, load_plan  # slow, and rarely needed

    path = Path(plan)
    suffix = path.suffix.lower()
    if not path.is_file() and suffix not in PLAN_SUFFIXES:
        return plan
    try:
        return path if suffix in MISSION_SUFFIXES and path.is_file() else load_plan(path)
    except PlanFileError as error:
        raise click.ClickException(str(error)) from None


def _convert(path: Path, there: AsyncRemoteVehicle) -> imc.PlanSpecification:
    """The plan in a mission file for this vehicle. Raises PlanFileError."""
    from shoal.missions import announced_context, load_plan

    context = announced_context(there.system.latest_message(imc.Announce))
    return load_plan(path, context, remark=lambda words: click.echo(printable(words), err=True))


def _to_json(action: str, found: Any) -> object:
    if isinstance(found, PlanOutcome):
        outcome = {"plan": found.plan, "completed": found.completed, "reason": found.reason, "seconds": found.seconds}
        return {**outcome, **_estimate_to_dict(found.estimate), "energy_used": found.energy_used}
    if isinstance(found, PlanEstimate):
        return {"done": True, **_estimate_to_dict(found), "rejected": found.rejected or None}
    if isinstance(found, imc.PlanControlState):
        return plan_state_to_dict(found)
    if isinstance(found, imc.PlanSpecification):
        return json.loads(found.to_json())
    return [asdict(plan) for plan in found] if action == "list" else {"done": True}


def _estimate_to_dict(estimate: PlanEstimate) -> dict[str, float | None]:
    return {
        "estimated_seconds": estimate.seconds,
        "estimated_energy": estimate.energy,
        "battery": estimate.battery,
    }


def _show(action: str, name: str, found: Any, output: Path | None, as_json: bool, say: Say) -> None:
    if isinstance(found, PlanOutcome):
        say(printable(f"{found.plan}: {found.reason}, after {found.seconds:.0f} s"))
        unknown = math.isnan(found.energy_used)
        say(f"energy: {'unknown' if unknown else f'{format_percent(found.energy_used)} of the battery used'}")
    elif isinstance(found, imc.PlanControlState):
        say(format_plan_state(found))
    elif isinstance(found, imc.PlanSpecification):
        _show_plan(found, output, as_json, say)
    elif action == "list":
        for stored in found:
            when = datetime.fromtimestamp(stored.changed, UTC).strftime("%Y-%m-%d %H:%M:%S")
            say(printable(f"{stored.name:24} {stored.size:6} B  {when}  by {stored.by}"))
    else:
        words = {"put": f"stored as {name}", "delete": "deleted", "start": "started", "stop": "stopped"}
        say(printable(words[action]))
        if isinstance(found, PlanEstimate) and action == "put":
            say(found.describe())
            if found.rejected:
                say(printable(f"it would not start now: {found.rejected}"))


def _show_plan(plan: imc.PlanSpecification, output: Path | None, as_json: bool, say: Say) -> None:
    from shoal.cli.export_plan import report_missing_maneuvers
    from shoal.missions import PlanFileError, plan_file_text

    remarks, missing = list[str](), list[str]()
    try:
        text = plan.to_json() + "\n"
        if not as_json:
            text, remarks, missing = plan_file_text(plan, output or Path())
    except PlanFileError as error:
        raise click.ClickException(f"{error}; use --json") from None
    for words in remarks:
        click.echo(printable(words), err=True)
    if output is None:
        say(text.removesuffix("\n"))
    else:
        write_output(output, text.encode())
    report_missing_maneuvers(missing, len(plan.maneuvers))


def plan_state_to_dict(state: imc.PlanControlState) -> dict[str, object]:
    """The state of the plan engine; progress in %, times in s, None if unknown."""
    states, outcomes = imc.PlanControlState.State, imc.PlanControlState.LastOutcome
    return {
        "state": states(state.state).name if state.state in set(states) else str(state.state),
        "plan": state.plan_id,
        "maneuver": state.man_id,
        "progress": state.plan_progress if state.plan_progress >= 0.0 else None,
        "eta": state.plan_eta if state.plan_eta >= 0 else None,
        "last_outcome": outcomes(state.last_outcome).name if state.last_outcome in set(outcomes) else None,
    }


def format_plan_state(state: imc.PlanControlState) -> str:
    """The state of the plan engine on one line."""
    values = plan_state_to_dict(state)
    words = [str(values["state"])]
    if state.state in (imc.PlanControlState.State.EXECUTING, imc.PlanControlState.State.INITIALIZING):
        words += [state.plan_id, state.man_id]
        words += [f"{state.plan_progress:.0f} %"] if values["progress"] is not None else []
        words += [f"{state.plan_eta} s left"] if values["eta"] is not None else []
    elif state.plan_id:
        words += [f"last: {state.plan_id}, {values['last_outcome']}"]
    return printable("  ".join(word for word in words if word))


class PlanProgressDisplay:
    """Shows reports of a plan: on a terminal by a bar, else by a line for each maneuver and each STEP.

    `say` prints a line of one of several vehicles, which then have no bar.
    """

    def __init__(self, plan: str, say: Say | None = None) -> None:
        self._plan = plan
        self._last: tuple[object, ...] = ()
        from rich.progress import TextColumn

        from shoal.cli.progress_bar import ProgressBar

        bar = ProgressBar(plan, 100.0, amount=TextColumn(""))
        self.bar: ProgressBar | None = bar if bar.is_live and say is None else None
        self._say = say or partial(click.echo, err=True)

    def __call__(self, state: imc.PlanControlState) -> None:
        phases = imc.PlanControlState.State
        if state.state not in (phases.EXECUTING, phases.INITIALIZING) or state.plan_id != self._plan:
            return
        if self.bar is not None:
            self.bar.show(max(0.0, state.plan_progress), format_plan_state(state))
            return
        now = state.state, state.man_id, int(max(state.plan_progress, 0.0) // STEP)
        if now != self._last:
            self._last = now
            self._say(format_plan_state(state))
