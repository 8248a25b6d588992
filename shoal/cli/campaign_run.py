"""`shoal campaign STUDY`, `shoal campaign rerun`: does the runs of a study, or one of them again."""

import math
import shlex
import statistics
import sys
import time
from collections.abc import Generator
from contextlib import contextmanager
from importlib import import_module
from pathlib import Path

import click
from rich.console import Console
from rich.progress import BarColumn, MofNCompleteColumn, Progress, TextColumn, TimeRemainingColumn

from shoal.campaigns import (
    LOGS,
    WHOLE,
    DataSet,
    Rerun,
    Shard,
    StudyRunner,
    carry_out,
    cluster_address,
    findings_of,
    is_data_set,
    is_finished,
    load_study,
    open_data_set,
    parse_shard,
    rerun_command,
    shard_folder,
)
from shoal.campaigns import rerun as rerun_run
from shoal.cli import STOPPED
from shoal.cli.campaign_search import left_out, show_findings, state_of
from shoal.cli.log_export import extra
from shoal.cli.options import (
    check_log_folder,
    code_option,
    parse_values,
    use_code,
    values_option,
)
from shoal.cli.pool_options import check_wall_limit, wall_limit_option, workers_option
from shoal.logs.look import number, span
from support.file_errors import describe_os_error
from support.text import printable

TELL_PERIOD = 30.0  # s between lines in a pipe
FILE = click.Path(path_type=Path, dir_okay=False)
FOLDER = click.Path(path_type=Path, file_okay=False)
MOST_NAMES = 12


@contextmanager
def refusals() -> Generator[None]:
    """Turns what is wrong with files, values and data sets into one line."""
    with extra("campaigns"):
        try:
            yield
        except ValueError as error:
            raise click.ClickException(printable(str(error))) from None
        except OSError as error:
            raise click.ClickException(printable(describe_os_error(error))) from None


def _parse_shard(_: click.Context, __: click.Parameter, text: str | None) -> Shard:
    try:
        return parse_shard(text) if text is not None else WHOLE
    except ValueError as error:
        raise click.BadParameter(printable(str(error))) from None


@click.command()
@click.argument("study", type=FILE)
@click.option("-o", "--out", type=FOLDER, help="Folder of the data set. [default: campaigns/NAME]")
@workers_option
@click.option("--on", metavar="ADDRESS", help="Do the runs on a cluster of Dask, such as dask://scheduler:8786.")
@click.option("--runs", type=click.IntRange(1), help="How many runs, instead of what the study says.")
@click.option("--logs", type=click.Choice(LOGS), help="Logs to keep, instead of what the study says.")
@values_option
@code_option
@wall_limit_option
@click.option(
    "--shard",
    callback=_parse_shard,
    metavar="K/N",
    help="Do each N-th run only, from the K-th on, in the folder shard-K-of-N of the data set; see `merge`.",
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
    """Do the runs of a study that its data set does not have yet, until there are enough.

    Ended at any moment, the same command goes on where it was, and does those runs again that did not end. With --set
    all runs have this value; the draws of the others stay what they are, so that `shoal campaign compare` has pairs.
    """
    check_wall_limit(workers, wall_limit)
    if on:
        check_cluster(on, workers)
    with refusals():
        use_code(code, [str(study)])
        plan = load_study(study, fixed=parse_values(values), runs=runs, logs=logs)
        folder = shard_folder(out or Path("campaigns") / plan.name, shard)
        if plan.logs != "none":
            check_log_folder(folder)
        smaller = plan.search.shrink if plan.search and plan.search.goal.breaks else 0
        bar = _Bar(len(shard.runs(plan.ending.most)) + smaller)
        try:
            with bar.progress:
                data = carry_out(
                    plan,
                    folder,
                    workers=workers,
                    wall_limit=wall_limit,
                    shard=shard,
                    on=on or "",
                    tell=bar.tell,
                    note=bar.note,
                )
        except KeyboardInterrupt:
            done = state_of(open_data_set(folder)) if is_data_set(folder) else "no run yet"
            click.echo(f"stopped: {done}; the same command goes on", err=True)
            sys.exit(STOPPED)
    if data.damaged:
        lines = number(data.damaged, "damaged line")
        click.echo(f"warning: the journal had {lines}; what was lost is done again", err=True)
    if (shown := findings_of(data)) is not None:
        show_findings(data, shown)
    else:
        _sum_up(data)


@click.command()
@click.argument("folder", type=FOLDER)
@click.option("--run", "number", type=click.IntRange(0), required=True, help="Its number.")
@click.option("--log-dir", type=FOLDER, help="Keep its log in this folder.")
@click.option("--study", type=FILE, help="The study's file, if it is not where it was.")
@values_option
@code_option
def rerun(
    folder: Path,
    number: int,
    log_dir: Path | None,
    study: Path | None,
    values: tuple[str, ...],
    code: tuple[Path, ...],
) -> None:
    """Do one run of the campaign in FOLDER again.

    It must go as it did: the fingerprint, and the hash of the log if both runs have one, are checked, and the exit
    status is 1 if they differ. With --set it is another run, shown beside the first.
    """
    with refusals():
        data = open_data_set(folder)
        use_code(code, [str(study or data.about["file"])])
        if log_dir is not None:
            check_log_folder(log_dir)
        again = rerun_run(data, number, StudyRunner(), changes=parse_values(values), log_root=log_dir, file=study)
    _show(again, number, bool(values))
    sys.exit(1 if again.differences else 0)


def check_cluster(on: str, workers: int | None) -> None:
    """Refuse what is no address, and -j, since a cluster has its own workers. Raises UsageError."""
    if workers is not None:
        raise click.UsageError("-j is for this computer; a cluster has as many workers as it has: leave it out")
    try:
        cluster_address(on)
    except ValueError as error:
        raise click.BadParameter(printable(str(error)), param_hint="--on") from None
    with extra("cluster"):
        import_module("distributed")


class _Bar:
    """A progress bar with the pass rate on a terminal; a line now and then in a pipe."""

    def __init__(self, most: int):
        console = Console(stderr=True)
        columns = (TextColumn("{task.description}"), BarColumn(), MofNCompleteColumn(), TimeRemainingColumn())
        self.progress = Progress(*columns, console=console, transient=True, disable=not console.is_terminal)
        self._task = self.progress.add_task("starting", total=most)
        self._is_live = console.is_terminal
        self._told = time.monotonic()
        self._is_first = True

    def note(self, words: str) -> None:
        self.progress.console.print(f"note: {printable(words)}", markup=False, highlight=False, soft_wrap=True)

    def tell(self, data: DataSet) -> None:
        now = time.monotonic()
        if self._is_first and data.rows:
            done = number(len(data.rows), "run was", "runs were")
            self.progress.console.print(f"{done} done before", highlight=False)
        self._is_first = False
        if self._is_live:
            words = state_of(data, is_short=True)
            self.progress.update(self._task, completed=len(data.counted), description=words)
        elif now - self._told > TELL_PERIOD:
            self._told = now
            click.echo(state_of(data), err=True)


def _sum_up(data: DataSet) -> None:
    rows = data.counted
    click.echo(f"{printable(data.name)}: {data.rate}")
    if others := left_out(data):
        click.echo(f"  {others}")
    simulated, cpu = (math.fsum(row[name] for row in rows) for name in ("seconds", "cpu"))
    if cpu:
        pace = f"{len(rows) * 3600.0 / cpu:.0f} runs per hour of CPU"
        click.echo(f"  {span(simulated)} simulated in {span(cpu)} of CPU: {pace}")
    if errors := [row for row in rows if row["error"]]:
        first = errors[0]
        click.echo(f"{len(errors)} ended out of order, the first is run {first['run']}: {_last(first['error'])}")
    if cut_short := len([row for row in rows if not is_finished(row)]):
        click.echo(f"{cut_short} did not come to an end; the same command does them again")
    names = dict.fromkeys(name for row in rows for name in row if name.startswith(("metrics.", "margins.")))
    for name in sorted(names)[:MOST_NAMES]:
        found = sorted(value for row in rows if math.isfinite(value := row.get(name, math.nan)))
        if found:
            middle = statistics.median(found)
            click.echo(f"  {printable(name)}: median {middle:.4g}, from {found[0]:.4g} to {found[-1]:.4g}")
    if not rows:
        return
    worst = min(rows, key=lambda row: (not row["error"], row["passed"], row["margin"]))
    why = _last(worst["error"]) or worst["reason"] or f"least margin {worst['margin']:.4g}"
    click.echo(f"worst is run {worst['run']}: {printable(why)}")
    place = shlex.quote(str(data.folder))
    click.echo(printable(f"shoal campaign report {place}"))
    click.echo(printable(rerun_command(data, worst["run"])))


def _last(error: str) -> str:
    lines = error.strip().splitlines()
    return printable(lines[-1]) if lines else ""


def _show(again: Rerun, number: int, is_other: bool) -> None:
    """The run as it was, and as it is now if that is another one."""
    row, result = again.row, again.result
    verdict = "passed" if result.passed else "failed"
    click.echo(f"run {number}, seed {row['seed']}: {verdict}" + (f", {_last(result.error)}" if result.error else ""))
    for name, value in again.values.items():
        was = again.drawn.get(name, value)
        click.echo(printable(f"  {name} = {value}" + (f" (was {was})" if was != value else "")))
    before = {name: value for name, value in row.items() if name.startswith(("metrics.", "margins."))}
    now = {f"metrics.{name}": value for name, value in result.metrics.items()}
    now |= {f"margins.{found.name}": found.margin for found in result.verdicts}
    for name, value in now.items():
        was = f" (was {before[name]:.6g})" if is_other and name in before else ""
        click.echo(f"  {printable(name)}: {value:.6g}{was}")
    for vehicle, log in result.logs.items():
        click.echo(f"  log of {printable(vehicle)}: {printable(str(log))}")
    for difference in again.differences:
        click.echo(f"not as it was: {printable(difference)}", err=True)
    if not is_other and not again.differences:
        hashes = " and log" if any(f"hashes.{vehicle}" in row for vehicle in result.hashes) else ""
        click.echo(f"as it was: fingerprint{hashes} {row['fingerprint'][:16]}")
