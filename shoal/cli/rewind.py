"""`shoal rewind`: goes back in a log, and on from there."""

from collections import Counter
from pathlib import Path

import click

import imc
from runtime.durations import parse_duration
from runtime.kernel.kernel import SECOND
from runtime.problem import ProfileError
from runtime.snapshot import SnapshotError
from shoal.cli.run import swim
from shoal.rerun import Instants, Rewound, outline


@click.command()
@click.argument("log", type=click.Path(exists=True, path_type=Path))
@click.option("--at", required=True, metavar="TIME", help="Seconds of the run, or 1h30min.")
@click.option("--for", "duration", metavar="TIME", help="How long to run from there [default: to the end of the log]")
@click.option("--set", "overrides", multiple=True, metavar="SECTION:OPTION=VALUE", help="Changes a value from then on.")
@click.option("--log-dir", default="log", show_default=True, type=click.Path(path_type=Path), help="Where logs go.")
def rewind(log: Path, at: str, duration: str | None, overrides: tuple[str, ...], log_dir: Path) -> None:
    """Go back to a time of LOG, of a virtual run, and on from there in a new log.

    It starts from the nearest snapshot in the log's folder, see shoal run --snapshot-every, or else from the start of
    the run. Without --set the new log has the bytes of the old one.
    """
    try:
        opened = imc.Log(log)
        rewound = Rewound(opened)
        wanted, end = parse_duration(at), rewound.end
        if wanted > end:
            click.echo(f"{log} ends at {end:.6g} s of its run: from there to {at} the vehicle just goes on", err=True)
        state = rewound.state_at(wanted)
        seconds = parse_duration(duration) if duration is not None else _rest(opened, state.time)
        vehicle = rewound.vehicle(state, log_dir, overrides=overrides)
    except (SnapshotError, ProfileError, OSError, ValueError) as error:
        raise click.ClickException(str(error)) from None
    swim(vehicle, f"{vehicle.name} from {at} of {log}", seconds, start=False)


def _rest(log: imc.Log, time: int) -> float:
    """The seconds from a time (ns) to the end of a log; its last moment is one of them where a plan ended the log."""
    about = outline(log)
    if about is None:
        return 0.0
    heads = (imc.header(packet) for _, packet in log.packets())
    at_end = Counter(head.id for head in heads if head.timestamp == about.end and head.src == about.owner)
    ended_by_plan = imc.PlanControlState.ID in at_end or at_end[imc.LoggingControl.ID] > 1
    return max(0, Instants(time).of(about.end) + ended_by_plan - time) / SECOND
