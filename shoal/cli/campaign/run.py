"""`shoal campaign STUDY`: does the runs of a study."""

import math
import shlex
import statistics
import sys
import time
from importlib import import_module
from pathlib import Path

import click
from rich.progress import MofNCompleteColumn

from shoal.campaigns import (
    LOGS,
    WHOLE_CAMPAIGN,
    CampaignResults,
    Shard,
    compute_findings,
    has_results,
    is_finished,
    load_study,
    open_results,
    parse_shard,
    rerun_command,
    run_study,
    shard_folder,
    to_dask_address,
)
from shoal.cli import STOPPED
from shoal.cli.campaign.campaign_errors import FILE, FOLDER, errors_as_messages, last_line
from shoal.cli.campaign.progress_text import print_findings, progress_line, uncounted_runs_text
from shoal.cli.optional_extra import require_extra
from shoal.cli.options import (
    add_user_task_folders,
    check_log_folder,
    code_option,
    parse_values,
    values_option,
)
from shoal.cli.progress_bar import ProgressBar
from shoal.cli.worker_options import check_wall_limit, wall_limit_option, workers_option
from shoal.logs.inspect import format_duration, format_noun_count
from support.terminal_text import printable

REPORT_PERIOD = 30.0  # s between lines in a pipe
MOST_NAMES = 12


def _parse_shard(_: click.Context, __: click.Parameter, text: str | None) -> Shard:
    try:
        return parse_shard(text) if text is not None else WHOLE_CAMPAIGN
    except ValueError as error:
        raise click.BadParameter(printable(str(error))) from None


@click.command()
@click.argument("study", type=FILE)
@click.option("-o", "--out", type=FOLDER, help="Folder of the data set. [default: campaigns/NAME]")
@workers_option
@click.option("--on", metavar="ADDRESS", help="Use a cluster of Dask, such as dask://scheduler:8786.")
@click.option("--runs", type=click.IntRange(1), help="Number of runs, instead of that in the study.")
@click.option("--logs", type=click.Choice(LOGS), help="Logs to keep, instead of those in the study.")
@values_option
@code_option
@wall_limit_option
@click.option(
    "--shard",
    callback=_parse_shard,
    metavar="K/N",
    help="Only each N-th run, from the K-th on, in the folder shard-K-of-N of the data set; see `merge`.",
)
def run(
    study: Path,
    out: Path | None,
    workers: int | None,
    on: str | None,
    runs: int | None,
    logs: str | None,
    values: tuple[str, ...],
    code: tuple[Path, ...],
    wall_limit: float,
    shard: Shard,
) -> None:
    """Run the missing runs of a study.

    It can be interrupted at any time: the same command resumes, and repeats unfinished runs. With --set all runs have
    this value; the draws of the other values stay the same, so that `shoal campaign compare` has pairs.
    """
    check_wall_limit(workers, wall_limit)
    if on:
        check_cluster_options(on, workers)
    with errors_as_messages():
        add_user_task_folders(code, [str(study)])
        plan = load_study(study, fixed=parse_values(values), runs=runs, logs=logs)
        for text in plan.search.deprecations if plan.search else ():
            click.echo(f"warning: {printable(text)}", err=True)
        folder = shard_folder(out or Path("campaigns") / plan.name, shard)
        if plan.logs != "none":
            check_log_folder(folder)
        smaller = plan.search.max_shrink_runs if plan.search and plan.search.objective.seeks_failure else 0
        display = _ProgressDisplay(len(shard.runs(plan.stopping_rule.max_runs)) + smaller)
        try:
            with display.bar:
                data = run_study(
                    plan,
                    folder,
                    workers=workers,
                    wall_limit=wall_limit,
                    shard=shard,
                    on=on or "",
                    on_progress=display.show,
                    on_notice=display.note,
                )
        except KeyboardInterrupt:
            done = progress_line(open_results(folder)) if has_results(folder) else "no run yet"
            click.echo(f"stopped: {done}; the same command continues", err=True)
            sys.exit(STOPPED)
    if data.damaged_lines:
        lines = format_noun_count(data.damaged_lines, "damaged line")
        click.echo(f"warning: the journal had {lines}; what was lost is done again", err=True)
    if (shown := compute_findings(data)) is not None:
        print_findings(data, shown)
    else:
        _sum_up(data)


def check_cluster_options(on: str, workers: int | None) -> None:
    """Reject what is no address, and -j, since a cluster has its own workers. Raises UsageError."""
    if workers is not None:
        raise click.UsageError("-j is for this computer; a cluster has as many workers as it has: leave it out")
    try:
        to_dask_address(on)
    except ValueError as error:
        raise click.BadParameter(printable(str(error)), param_hint="--on") from None
    with require_extra("cluster"):
        import_module("distributed")


class _ProgressDisplay:
    """A progress bar with the pass rate on a terminal; a line now and then in a pipe."""

    def __init__(self, most: int):
        self.bar = ProgressBar("starting", most, amount=MofNCompleteColumn())
        self._reported_at = time.monotonic()
        self._is_first = True

    def note(self, words: str) -> None:
        self.bar.print(f"note: {printable(words)}")

    def show(self, data: CampaignResults) -> None:
        now = time.monotonic()
        if self._is_first and data.rows:
            done = format_noun_count(len(data.rows), "run was", "runs were")
            self.bar.print(f"{done} done before")
        self._is_first = False
        if self.bar.is_live:
            self.bar.show(len(data.counted_rows), progress_line(data, is_short=True))
        elif now - self._reported_at > REPORT_PERIOD:
            self._reported_at = now
            click.echo(progress_line(data), err=True)


def _sum_up(data: CampaignResults) -> None:
    rows = data.counted_rows
    click.echo(f"{printable(data.name)}: {data.pass_rate}")
    if others := uncounted_runs_text(data):
        click.echo(f"  {others}")
    simulated, cpu = (math.fsum(row[name] for row in rows) for name in ("seconds", "cpu"))
    if cpu:
        pace = f"{len(rows) * 3600.0 / cpu:.0f} runs per hour of CPU"
        click.echo(f"  {format_duration(simulated)} simulated in {format_duration(cpu)} of CPU: {pace}")
    ended = [row for row in rows if is_finished(row)]
    if errors := [row for row in ended if row["error"]]:
        first = errors[0]
        click.echo(f"{len(errors)} ended out of order, the first is run {first['run']}: {last_line(first['error'])}")
    if cut_short := len(rows) - len(ended):
        click.echo(f"{cut_short} did not end; the same command repeats them")
    names = dict.fromkeys(name for row in rows for name in row if name.startswith(("metrics.", "margins.")))
    for name in sorted(names)[:MOST_NAMES]:
        found = sorted(value for row in rows if math.isfinite(value := row.get(name, math.nan)))
        if found:
            middle = statistics.median(found)
            click.echo(f"  {printable(name)}: median {middle:.4g}, from {found[0]:.4g} to {found[-1]:.4g}")
    if not ended:
        return
    worst = min(ended, key=lambda row: (not row["error"], row["passed"], row["margin"]))
    why = last_line(worst["error"]) or worst["reason"] or f"least margin {worst['margin']:.4g}"
    click.echo(f"worst is run {worst['run']}: {printable(why)}")
    place = shlex.quote(str(data.folder))
    click.echo(printable(f"shoal campaign report {place}"))
    click.echo(printable(rerun_command(data, worst["run"])))
