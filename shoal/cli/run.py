"""`shoal run`: runs a vehicle profile and shows its status."""

import contextlib
import gc
from collections.abc import Callable
from functools import partial
from pathlib import Path
from typing import Any, NoReturn, TypeVar

import click
from click.core import ParameterSource

from runtime.kernel import parse_clock
from runtime.profile import Profile, load_profile, split_list
from runtime.snapshot import InputJournals, SnapshotError, load_file, run_with_snapshots, save_beside_log
from runtime.vehicle import Build, Vehicle, build, check_profile, find_task, join_zenoh
from shoal.cli.completion import complete_profile
from shoal.cli.options import (
    add_user_task_folders,
    check_vehicle_log_folder,
    code_option,
    config_dir_option,
    log_dir_option,
    modes_option,
    overrides_option,
    require_text,
)
from shoal.cli.shutdown import exit_process, shutdown_on_signal, traceback_without_library
from shoal.cli.status_display import StatusDisplay
from shoal.cli.systemd_notify import SystemdNotifier
from shoal.cli.time_texts import parse_duration_option, parse_period
from shoal.cli.vehicle_page import serve_page
from shoal.cli.vehicle_subprocesses import make_managed_process, resolve_process_option, supervise
from shoal.fleet import Supervisor, stop_with_parent
from shoal.simulated_motion import motion_problem, motion_warning
from support.diagnostics import COMMAND_LINE, Problem, ProfileError
from support.file_errors import describe_os_error
from support.terminal_text import printable
from tasks.transports.logging import Logging

F = TypeVar("F", bound=Callable[..., Any])
MOST_WARNINGS = 10
LINKS = ("Transports.", "Supervisors.Equipment")  # the tasks that write logs, talk to others and answer them
FIXED_BY_SNAPSHOT = ("config_dir", "profiles", "vehicle", "clock", "seed", "bus", "keep_going")
CLOSING = 30.0  # s to close a run that ends by itself
GARBAGE = 20_000  # new objects after which a run looks for garbage among them: a short pause


def run_options(function: F) -> F:
    """Add the options that `run` and `replay` share."""
    declared = [
        click.option("--clock", default="real", show_default=True, help="real, virtual, or a factor such as 10x."),
        click.option(
            "--for", "duration", callback=parse_duration_option, help="Stop after this time: 90s, 10min, 1h30min."
        ),
        click.option(
            "--seed", type=click.IntRange(0), help="Seed of all random numbers [default: the profile's, or 0]"
        ),
        click.option(
            "--bus",
            type=click.Choice(["inprocess", "zenoh"]),
            help="Bus to use instead of the profile's [default: inprocess]",
        ),
        log_dir_option,
        click.option("--keep-going/--stop-on-error", default=None, help="Restart a failing task, or end the run."),
    ]
    for option in reversed(declared):
        function = option(function)
    return function


@click.command()
@click.argument("profile", required=False, shell_complete=complete_profile)
@click.option("-c", "--config-file", help="Same as PROFILE, as DUNE spells it.")
@config_dir_option
@modes_option
@click.option("-V", "--vehicle", callback=require_text, help="Name of the vehicle, instead of the profile's.")
@overrides_option
@code_option
@click.option(
    "--snapshot-every",
    callback=parse_period,
    metavar="TIME",
    help="Save a snapshot of a virtual run beside its log at this interval.",
)
@click.option(
    "--from-snapshot", type=click.Path(exists=True, dir_okay=False, path_type=Path), help="Continue from a snapshot."
)
@click.option("--process", metavar="NAME", help="Run only the sections with this Process; main for those without one.")
@click.option("--alone", is_flag=True, help="Do not start the other processes: they run on other computers.")
@click.option("--parent", type=int, hidden=True, help="End when this process, which has started it, has gone.")
@run_options
def run(
    profile: str | None,
    config_file: str | None,
    config_dir: tuple[Path, ...],
    profiles: tuple[str, ...],
    vehicle: str,
    overrides: tuple[str, ...],
    code: tuple[Path, ...],
    snapshot_every: float | None,
    from_snapshot: Path | None,
    process: str | None,
    alone: bool,
    parent: int | None,
    clock: str,
    duration: float | None,
    seed: int | None,
    bus: str | None,
    log_dir: Path,
    keep_going: bool | None,
) -> None:
    """Run the vehicle PROFILE, for example: shoal run lauv-noptilus-1 -p Simulation"""
    name = profile or config_file
    add_user_task_folders(code, [] if name is None else [name], of_log=from_snapshot is not None)
    if from_snapshot is not None:
        _reject_snapshot_options(name)
        run_from_snapshot(from_snapshot, log_dir, duration, overrides, snapshot_every)
    if name is None:
        raise click.UsageError("name a profile, for example: shoal run lauv-noptilus-1 -p Simulation")
    try:
        state_folder = log_dir.parent / "db"
        saved = None if clock.strip().lower() == "virtual" else state_folder
        loaded = load_profile(name, config_dir, vehicle=vehicle, saved=saved, overrides=overrides)
        selected = loaded.parse_modes(profiles)
        report_profile_warnings(check_profile(loaded, {}, selected, find_task), loaded.name)
        at = parse_clock(clock, loaded.start_time_ns)
        over_zenoh = (bus or loaded.bus_transport) == "zenoh" and not at.virtual
        others = loaded.processes(selected)
        part = resolve_process_option(process, others, over_zenoh)
        made = build(
            loaded,
            selected,
            clock=at,
            seed=seed,
            keep_going=keep_going,
            log_root=log_dir,
            state_folder=state_folder,
            process=part,
        )
        if (bus or loaded.bus_transport) == "zenoh":
            join_zenoh(made.vehicle, loaded)
    except ModuleNotFoundError as error:
        raise click.ClickException(f"{error}; a zenoh bus needs pip install 'shoal[zenoh]'") from None
    except (ProfileError, ConnectionError, ValueError) as error:
        raise click.ClickException(str(error)) from None
    _report_skipped(made, loaded, selected)
    serve_page(made.vehicle)
    if problem := motion_problem(made, loaded):
        made.vehicle.close()
        raise click.ClickException(str(problem))
    if text := motion_warning(made, loaded, selected):
        click.echo(printable(f"warning: {text}"), err=True)
    if saved is not None and (path := saved / f"{loaded.vehicle}-saved.ini").exists():
        click.echo(f"with the parameters saved in {path}", err=True)
    if made.vehicle.has_virtual_time and (bus or loaded.bus_transport) == "zenoh":
        click.echo(
            "note: on a zenoh bus a virtual run receives messages of others and may not be reproducible", err=True
        )
    if snapshot_every is not None and not made.vehicle.has_virtual_time:
        raise click.UsageError("only a virtual run can be saved; use --clock virtual")
    check_vehicle_log_folder(made.vehicle)
    if snapshot_every is not None:
        InputJournals(made.vehicle)
    if parent is not None:
        stop_with_parent(made.vehicle.kernel, parent, made.vehicle.stop)
    supervisor = Supervisor(
        [make_managed_process(name) for name in others] if part == "" and not alone and process is None else []
    )
    if supervisor.processes:
        supervise(made.vehicle, supervisor)
    title = f"{loaded.vehicle} ({', '.join(sorted(selected)) or 'no mode selected'})"
    try:
        run_to_end(made.vehicle, title, duration, snapshot_every=snapshot_every, supervisor=supervisor)
    finally:
        supervisor.stop()


def _reject_snapshot_options(profile: str | None) -> None:
    """Reject what a snapshot contains itself. Raises UsageError."""
    context = click.get_current_context()
    given = ["PROFILE"] if profile else []
    for option in context.command.params:
        typed = context.get_parameter_source(option.name or "") is ParameterSource.COMMANDLINE
        agrees = option.name == "clock" and context.params["clock"].strip().lower() == "virtual"
        if typed and option.name in FIXED_BY_SNAPSHOT and not agrees:
            given.append(max(option.opts, key=len))
    if given:
        raise click.UsageError(f"the snapshot has its own {', '.join(given)}; leave that out")


def run_from_snapshot(
    path: Path, log_dir: Path, duration: float | None, overrides: tuple[str, ...], snapshot_every: float | None
) -> NoReturn:
    """Continue from a snapshot, which contains the profile; `overrides` change its values."""
    from shoal.rerun import resume_snapshot  # only here, since all other runs begin sooner without it

    try:
        state = load_file(path)
        vehicle = resume_snapshot(
            state,
            log_dir,
            overrides=overrides,
            journals=snapshot_every is not None,
            definitions=path.parent / "IMC.xml.gz",
        )
    except (SnapshotError, ProfileError) as error:
        raise click.ClickException(printable(f"{path}: {error}")) from None
    check_vehicle_log_folder(vehicle)
    run_to_end(vehicle, f"{vehicle.name} from {path}", duration, start=False, snapshot_every=snapshot_every)


def run_to_end(
    vehicle: Vehicle,
    title: str,
    duration: float | None,
    *,
    start: bool = True,
    snapshot_every: float | None = None,
    supervisor: Supervisor | None = None,
) -> NoReturn:
    """Run a vehicle to its end, for `duration` (s) or until a signal, show its status, and exit with its exit status.

    A first signal ends the run in order, within a second even if a task hangs; a later one ends it immediately.

    `start` is False if it continues from a snapshot. A snapshot is saved beside its log every `snapshot_every` (s); one
    that the disk rejects is reported and left out. So is a process of `supervisor` that never started.
    """
    status, host = StatusDisplay(vehicle, title, duration), SystemdNotifier(vehicle)
    missing, incomplete = list[OSError](), False
    with shutdown_on_signal(vehicle) as watchdog:
        try:
            with status:
                if start:
                    vehicle.start()
                gc.freeze()  # all of this stays: a search for garbage in it would be a long pause
                gc.set_threshold(GARBAGE)
                if not vehicle.has_virtual_time:  # a virtual run is the same without it, and may be saved
                    vehicle.kernel.soon(host.notify_ready)
                try:
                    if snapshot_every is None:
                        vehicle.run(duration)
                    else:
                        keep = partial(save_beside_log, vehicle)
                        missing = run_with_snapshots(vehicle, duration, snapshot_every, keep)
                finally:
                    if not vehicle.has_virtual_time:
                        watchdog.set_stop_deadline(CLOSING)
                    host.notify_stopping()
                    vehicle.close()
                    gc.unfreeze()
        except Exception as error:
            vehicle.exit_status = 1
            with contextlib.suppress(OSError):
                of_state = isinstance(error, SnapshotError) or not (start or isinstance(error, OSError))
                click.echo(
                    f"Error: {printable(str(error))}" if of_state else traceback_without_library(error), err=True
                )
    absent = supervisor.never_started if supervisor is not None else []
    with contextlib.suppress(OSError):
        click.echo(status.run_summary())
        incomplete = report_lost_logs(vehicle)
        if missing:
            report_missing_snapshots(missing)
        for child in absent:
            click.echo(f"process {child.name} could not be started", err=True)
    exit_process(watchdog, vehicle.exit_status or int(incomplete or bool(missing) or bool(absent)))


def report_lost_logs(vehicle: Vehicle) -> bool:
    """Print what the loggers of a vehicle that has ended could not write; returns whether there is any."""
    lost = [task.lost for task in vehicle.tasks if isinstance(task, Logging) and task.lost]
    for words in lost:
        click.echo(f"the log is not complete: {words}", err=True)
    return bool(lost)


def report_missing_snapshots(snapshots: list[OSError]) -> None:
    """Print how many snapshots could not be saved, and why."""
    plural = "s" * (len(snapshots) != 1)
    click.echo(f"{len(snapshots)} snapshot{plural} not saved: {describe_os_error(snapshots[0])}", err=True)


def report_profile_warnings(problems: list[Problem], profile: str) -> None:
    """Print the warnings about a profile. Raises ProfileError for its errors, as `shoal check` reports them."""
    if errors := [problem for problem in problems if problem.severity == "error"]:
        raise ProfileError(errors)
    warnings = [problem for problem in problems if problem.severity == "warning"]
    for problem in warnings[:MOST_WARNINGS]:
        click.echo(problem, err=True)
    if (more := len(warnings) - MOST_WARNINGS) > 0:
        click.echo(f"{more} more warning{'s' * (more > 1)}: shoal check {profile}", err=True)


def _report_skipped(made: Build, profile: Profile, selected: frozenset[str]) -> None:
    """Print which sections are left out. Raises ClickException if no task is left, or nothing but logs and links."""
    for reason, sections in made.skipped.items():
        click.echo(f"skipped: {', '.join(sections)} ({reason})", err=True)
    own = [task.name for task in made.vehicle.tasks[1:]]  # the first one is the daemon
    others = {name: section for name, section in profile.config.sections.items() if not name.startswith(LINKS)}
    enabled = {mode for section in others.values() for mode in split_list(section.value("Enabled"))}
    useful = [mode for mode in profile.selectable_modes if mode in enabled and mode not in selected]
    bridges = made.vehicle.bus.has_transports or not useful  # a profile may have only links, or link a zenoh bus
    asked = [option.origin for name in own if (option := profile.config.option(name, "Enabled"))]
    if own and (bridges or COMMAND_LINE in asked or any(name in others for name in own)):
        return
    made.vehicle.close()
    hint = f"; its tasks are enabled in {', '.join(useful)}: select one with -p" if useful else ""
    where = f"in mode {', '.join(sorted(selected))}" if selected else "without a mode"
    besides = f" besides {', '.join(own)}" if own else ""
    raise click.ClickException(f"{profile.name} has nothing to run {where}{besides}{hint}")
