"""`shoal mission`: flies a plan on a virtual clock and reports the result."""

import math
import shlex
import sys
import time
from dataclasses import asdict
from functools import partial
from pathlib import Path

import click
from rich.console import Console
from rich.table import Table

import imc
from autonomy.plans import PlanEstimate, format_percent
from runtime.profile import Profile
from runtime.vehicle import check_profile, find_task
from shoal.cli.completion import complete_profile
from shoal.cli.json_output import print_json
from shoal.cli.options import (
    add_user_task_folders,
    check_vehicle_log_folder,
    code_option,
    config_dir_option,
    log_dir_option,
    overrides_option,
    virtual_clock_option,
)
from shoal.cli.progress_bar import ProgressBar
from shoal.cli.run import report_lost_logs, report_missing_snapshots, report_profile_warnings
from shoal.cli.shutdown import exit_process, shutdown_on_signal, traceback_without_library
from shoal.cli.time_texts import parse_period
from shoal.missions import (
    ManeuverReport,
    Mission,
    PlanFileError,
    Report,
    load_plan,
    locate_reason,
    motion_warning,
    prepare,
    profile_context,
)
from support.diagnostics import ProfileError
from support.durations import parse_duration
from support.file_errors import describe_os_error
from support.terminal_text import printable

REFRESH = 0.1  # s between updates
CANNOT_FLY = 2  # exit status if a file or the profile is wrong


@click.command()
@click.argument("profile", shell_complete=complete_profile)
@click.argument("plan", type=click.Path(path_type=Path, dir_okay=False))
@config_dir_option
@click.option("-p", "--profiles", multiple=True, help="Modes to select [default: Simulation, or else Kinematic].")
@overrides_option
@code_option
@virtual_clock_option
@click.option("--for", "limit", default="24h", show_default=True, help="Time limit, in vehicle time.")
@click.option("--seed", type=click.IntRange(0), help="Seed of all random numbers [default: the profile's, or 0]")
@click.option("--calibrate", is_flag=True, help="Calibrate before the plan starts.")
@click.option(
    "--snapshot-every", callback=parse_period, metavar="TIME", help="Save a snapshot beside the log at this interval."
)
@log_dir_option
@click.option("--json", "as_json", is_flag=True, help="Print the report as JSON.")
def mission(
    profile: str,
    plan: Path,
    config_dir: tuple[Path, ...],
    profiles: tuple[str, ...],
    overrides: tuple[str, ...],
    code: tuple[Path, ...],
    limit: str,
    seed: int | None,
    calibrate: bool,
    snapshot_every: float | None,
    log_dir: Path,
    as_json: bool,
) -> None:
    """Fly PLAN with the vehicle PROFILE, for example: shoal mission lauv-noptilus-1 plan.yaml

    PLAN is YAML or JSON of Shoal, .plan or .waypoints of QGroundControl, KML, GPX or GeoJSON.

    The exit status is 0 if the plan was completed, 1 if the vehicle rejected or did not complete it or its log is not
    complete, 2 if a file or the profile is wrong.
    """
    add_user_task_folders(code, [profile])
    try:
        longest = parse_duration(limit)
        state_folder = log_dir.parent / "db"
        made = prepare(
            profile,
            profiles,
            config_dir=config_dir,
            overrides=overrides,
            seed=seed,
            log_root=log_dir,
            state_folder=state_folder,
        )
        if isinstance(flown := made.vehicle.profile, Profile):
            selected = flown.parse_modes(flown.value("General", "Selected"))
            report_profile_warnings(check_profile(flown, {}, selected, find_task), profile)
            if text := motion_warning(made, flown, selected):
                click.echo(printable(f"warning: {text}"), err=True)
        flown = made.vehicle.profile
        context = profile_context(flown) if isinstance(flown, Profile) else None
        specification = load_plan(plan, context, remark=partial(click.echo, err=True))
        check_vehicle_log_folder(made.vehicle)
    except OSError as error:
        click.echo(f"Error: {describe_os_error(error, plan)}", err=True)
        sys.exit(CANNOT_FLY)
    except (PlanFileError, ProfileError, ValueError) as error:
        click.echo(f"Error: {error}", err=True)
        sys.exit(CANNOT_FLY)
    display = _ProgressDisplay(specification.plan_id)
    flight = Mission(made.vehicle, specification, calibrate=calibrate, watch=display.show, estimated=_print_estimate)
    with display.bar, shutdown_on_signal(made.vehicle) as watchdog:
        try:
            report = flight.fly(longest, snapshot_every=snapshot_every)
        except Exception as error:
            report = Report("FAILURE", f"{type(error).__name__}: {error}")
            click.echo(traceback_without_library(error), err=True)
    if watchdog.breaks_handlers and not report.completed:
        report.outcome, report.reason = "FAILURE", "stopped by a signal"
    incomplete = report_lost_logs(made.vehicle) or bool(flight.unsaved)
    if flight.unsaved:
        report_missing_snapshots(flight.unsaved)
    if as_json:
        print_json(_report_to_dict(report))
    else:
        if not report.legs:
            report.reason = locate_reason(plan, report.reason)
        _print(specification.plan_id, report)
    exit_process(watchdog, int(incomplete or not report.completed))


class _ProgressDisplay:
    """A progress bar on a terminal; on stderr, so that the report can be piped."""

    def __init__(self, title: str):
        self.bar = ProgressBar(title, 100.0)
        self._title = title
        self._next = 0.0

    def show(self, state: imc.PlanControlState) -> None:
        if time.monotonic() >= self._next:
            self._next = time.monotonic() + REFRESH
            self.bar.show(max(0.0, state.plan_progress), f"{self._title} {state.man_id}")


def _report_to_dict(report: Report) -> dict[str, object]:
    summary: dict[str, object] = {
        "outcome": report.outcome,
        "reason": report.reason,
        "seconds": report.seconds,
        "distance": report.distance,
        "cross_track": report.cross_track,
        "depth_error": report.depth_error,
        "deepest": report.deepest,
    }
    summary |= {
        "estimated_seconds": report.estimated_seconds,
        "estimated_energy": report.estimated_energy,
        "battery_before": report.battery_before,
        "battery_after": report.battery_after,
        "log": None if report.log is None else str(report.log),
    }
    return {**summary, "legs": [asdict(leg) for leg in report.legs]}


def _print_estimate(report: Report) -> None:
    """Print, before the flight, what the plan takes."""
    estimate = PlanEstimate(report.estimated_seconds, report.estimated_energy, report.battery_before)
    click.echo(estimate.describe(), err=True)


def _print(title: str, report: Report) -> None:
    console = Console(highlight=False, emoji=False, soft_wrap=True)
    console.print(f"{title}: {report.outcome}, {report.reason}", markup=False)
    if report.legs:
        _print_legs(console, report)
        used = report.battery_before - report.battery_after
        estimate = format_percent(report.estimated_energy)
        console.print(f"energy: {format_percent(used)} of the battery used, estimated {estimate}")
    if report.log is not None:
        console.print(f"log: {report.log}, drawn by: shoal log report {shlex.quote(str(report.log))}", markup=False)


def _print_legs(console: Console, report: Report) -> None:
    table = Table(box=None, pad_edge=False)
    table.add_column("maneuver")
    for name in ("time", "distance", "cross-track", "depth error"):
        table.add_column(name, justify="right")
    total = ManeuverReport("all", 0.0, report.seconds, report.distance, report.cross_track, report.depth_error)
    for leg in (*report.legs, total):
        table.add_row(
            leg.name,
            f"{leg.seconds:.1f} s",
            f"{leg.distance:.1f} m",
            _meters(leg.cross_track),
            _meters(leg.depth_error),
        )
    console.print(table)


def _meters(value: float) -> str:
    return "-" if math.isnan(value) else f"{value:.2f} m"
