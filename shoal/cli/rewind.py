"""`shoal rewind`: resumes a virtual run from a given time in its log."""

from collections import Counter
from pathlib import Path

import click

import imc
from runtime.kernel import SECOND
from runtime.snapshot import SnapshotError
from shoal.cli.log.log_input import last_option
from shoal.cli.options import (
    add_user_task_folders,
    check_vehicle_log_folder,
    code_of_log_option,
    log_dir_option,
    virtual_clock_option,
)
from shoal.cli.run import run_to_end
from shoal.rerun import RewoundRun, TimestampResolver, summarize_log
from support.diagnostics import ProfileError
from support.durations import parse_duration


@click.command()
@click.argument("log", type=click.Path(exists=True, path_type=Path), required=False)
@last_option
@click.option("--at", required=True, metavar="TIME", help="Time since the start of the run: 90 or 1h30min.")
@click.option("--for", "duration", metavar="TIME", help="Duration of the run [default: to the end of the log]")
@click.option(
    "--set", "overrides", multiple=True, metavar="SECTION:OPTION=VALUE", help="Change an option from then on."
)
@code_of_log_option
@virtual_clock_option
@log_dir_option
def rewind(
    log: Path, at: str, duration: str | None, overrides: tuple[str, ...], code: tuple[Path, ...], log_dir: Path
) -> None:
    """Resume a virtual run from a given time in its LOG, and write a new log.

    It starts from the nearest earlier snapshot of the run, see shoal run --snapshot-every, or else from its beginning.
    Without --set, the new log repeats the bytes of the old one.
    """
    add_user_task_folders(code, of_log=True)
    try:
        opened = imc.Log(log)
        rewound = RewoundRun(opened)
        wanted, end = parse_duration(at), rewound.end
        if wanted > end:
            text = f"{log} ends at {end:.6g} s of its run"
            if duration is None:
                raise click.ClickException(f"{text}, before {at}; give with --for how long to run past this end")
            click.echo(f"{text}; the vehicle runs past this end to {at}", err=True)
        state = rewound.state_at(wanted)
        seconds = parse_duration(duration) if duration is not None else _rest(opened, state.time)
        vehicle = rewound.vehicle(state, log_dir, overrides=overrides)
    except (SnapshotError, ProfileError, ValueError) as error:
        raise click.ClickException(str(error)) from None
    check_vehicle_log_folder(vehicle)
    run_to_end(vehicle, f"{vehicle.name} from {at} of {log}", seconds, start=False)


def _rest(log: imc.Log, time: int) -> float:
    """Seconds from a time (ns) to the end of a log, including its last moment if a plan ended the log."""
    about = summarize_log(log)
    if about is None:
        return 0.0
    heads = (imc.header(packet) for _, packet in log.packets())
    at_end = Counter(head.id for head in heads if head.timestamp == about.end and head.src == about.owner)
    ended_by_plan = imc.PlanControlState.ID in at_end or at_end[imc.LoggingControl.ID] > 1
    return max(0, TimestampResolver(time).resolve(about.end) + ended_by_plan - time) / SECOND
