"""`shoal test`: runs scenarios, and reports failures, reasons, and the commands that repeat them."""

import math
import shlex
import sys
import time
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, field, replace
from functools import partial
from pathlib import Path

import click
from rich.console import Console
from rich.progress import MofNCompleteColumn
from rich.text import Text

from shoal.campaigns import (
    SCENARIO_SUFFIX,
    WALL_LIMIT,
    Job,
    ProcessPool,
    ScenarioOutcome,
    ScenarioRunner,
    failure_details,
    failure_lines,
    find_scenario_files,
    junit_xml,
    other_consecutive_logs,
    outcome_to_dict,
    rerun_with_logs,
    run_jobs,
    variants_of,
    warning_lines,
)
from shoal.cli import STOPPED, WRONG_USE
from shoal.cli.json_output import json_text
from shoal.cli.options import (
    add_user_task_folders,
    check_log_folder,
    code_option,
    log_dir_option,
    parse_values,
    values_option,
    virtual_clock_option,
)
from shoal.cli.progress_bar import ProgressBar
from shoal.cli.worker_options import check_wall_limit, wall_limit_option, workers_option
from support.atomic_files import write_output
from support.file_errors import describe_os_error
from support.terminal_text import printable

FILE = click.Path(path_type=Path, dir_okay=False, allow_dash=True)


@click.command()
@click.argument("paths", nargs=-1, metavar="[PATH]...", type=click.Path(path_type=Path))
@workers_option
@click.option("--junit", "junit_file", type=FILE, metavar="FILE", help="Write the results as JUnit's XML.")
@click.option("--json", "json_file", type=FILE, metavar="FILE", help="Write the results as JSON; - prints them.")
@click.option(
    "--keep", type=click.Choice(["failed", "all", "none"]), default="failed", show_default=True, help="Logs to keep."
)
@log_dir_option
@click.option("--seed", type=click.IntRange(0), help="Seed of all random numbers. [default: that of each file]")
@values_option
@code_option
@virtual_clock_option
@wall_limit_option
def test(
    paths: tuple[Path, ...],
    workers: int | None,
    junit_file: Path | None,
    json_file: Path | None,
    keep: str,
    log_dir: Path,
    seed: int | None,
    values: tuple[str, ...],
    code: tuple[Path, ...],
    wall_limit: float,
) -> None:
    """Run scenarios on all processors: files, and all *.scenario.yaml below folders [default: the current one].

    A scenario that has failed is run again, the same way, for its log. The exit status is 0 if all have passed, 1 if
    one has failed, 2 if a file cannot be read, or there is none.
    """
    check_wall_limit(workers, wall_limit)
    try:
        files = find_scenario_files(paths or (Path(),))
    except OSError as error:
        raise click.ClickException(printable(describe_os_error(error))) from None
    if not files:
        where = ", ".join(str(path) for path in paths) or "the current folder"
        raise click.ClickException(
            printable(f"there is no *{SCENARIO_SUFFIX} in {where}; `shoal new scenario NAME` makes one")
        )
    for file in (junit_file, json_file):
        if file is not None:
            file.parent.mkdir(parents=True, exist_ok=True)
    folders = add_user_task_folders(code, map(str, files))
    if keep == "all":
        check_log_folder(log_dir)
    given = parse_values(values)
    runs = [Job(0, path, chosen, seed) for path in files for chosen in variants_of(path, given)]
    jobs = [
        replace(job, key=number, log_root=log_dir / job.name if keep == "all" else None)
        for number, job in enumerate(runs)
    ]
    repeat = _options(
        {
            "seed": () if seed is None else (seed,),
            "set": values,
            "code": code,
            "log-dir": () if log_dir == Path("log") else (log_dir,),
            "wall-limit": () if wall_limit == WALL_LIMIT else (f"{wall_limit:g} s",),
        }
    )
    console = Console(stderr=json_file == Path("-"), highlight=False, emoji=False, soft_wrap=True)
    tally = ScenarioRuns(jobs, repeat, console, is_variant_set="variant" in given)
    began = time.time()
    make = partial(ScenarioRunner, is_set=True)
    count = min(workers, len(jobs)) if workers is not None else None
    pool = ProcessPool(count, make_runner=make, wall_limit=wall_limit, code=folders)
    with pool, tally.bar:
        try:
            tally.run(pool)
            if keep == "failed" and tally.failed:
                check_log_folder(log_dir)
                tally.rerun_failed_with_logs(pool, log_dir)
        except KeyboardInterrupt:
            tally.stopped = True
        except click.BadParameter as error:  # what is known of the runs is written all the same
            click.echo(f"warning: {error.format_message()}", err=True)
    wall = time.time() - began
    tally.print_failures()
    tally.print_summary(wall)
    if junit_file is not None:
        _write(junit_file, junit_xml(tally.outcomes, tally.not_run, began, wall))
    if json_file is not None:
        runs = [
            {**outcome_to_dict(outcome), "again": tally.reproduction_command(outcome)} for outcome in tally.outcomes
        ]
        undone = [job.label for job in tally.not_run]
        _write(json_file, json_text({"runs": runs, "undone": undone, "wall": wall}).encode() + b"\n")
    sys.exit(tally.exit_status)


@dataclass
class ScenarioRuns:
    """Results of jobs so far, and their display. `options` are those of the command that repeats one,
    `is_variant_set` if these choose the variant."""

    jobs: Sequence[Job]
    options: Sequence[str]
    console: Console
    outcomes: list[ScenarioOutcome] = field(default_factory=list[ScenarioOutcome])
    stopped: bool = False
    is_variant_set: bool = False

    def __post_init__(self) -> None:
        shown = self.console if self.console.is_terminal else Console(stderr=True)
        self.bar: ProgressBar = ProgressBar("running", len(self.jobs), amount=MofNCompleteColumn(), console=shown)

    @property
    def failed(self) -> list[ScenarioOutcome]:
        return [outcome for outcome in self.outcomes if not outcome.result.passed]

    @property
    def not_run(self) -> list[Job]:
        done = {outcome.job.key for outcome in self.outcomes}
        return [job for job in self.jobs if job.key not in done]

    @property
    def exit_status(self) -> int:
        if self.stopped:
            return STOPPED
        return WRONG_USE if any(outcome.is_unreadable for outcome in self.outcomes) else int(bool(self.failed))

    def run(self, pool: ProcessPool) -> None:
        """Run all, and print a line for each."""
        for outcome in run_jobs(pool, self.jobs):
            self.outcomes.append(outcome)
            self._line(outcome)
            failures = f", {len(self.failed)} failed" if self.failed else ""
            self.bar.show(len(self.outcomes), f"running{failures}")

    def rerun_failed_with_logs(self, pool: ProcessPool, log_dir: Path) -> None:
        """Run those that failed again, with a log."""
        failed = self.failed
        self.bar.show(0, "again, for the logs", len(failed))
        places = {outcome.job.key: place for place, outcome in enumerate(self.outcomes)}
        for done, outcome in enumerate(rerun_with_logs(pool, failed, log_dir), 1):
            self.outcomes[places[outcome.job.key]] = outcome
            self.bar.show(done)

    def reproduction_command(self, outcome: ScenarioOutcome) -> str:
        """The command that does it again."""
        job = outcome.job
        chosen = ["--set", f"variant={job.variant}"] if job.variant and not self.is_variant_set else []
        return shlex.join(["shoal", "test", str(job.path), *chosen, *self.options])

    def print_failures(self) -> None:
        """Print all about those that failed, in the order of the files, and all warnings."""
        self.outcomes.sort(key=lambda outcome: int(outcome.job.key))
        for outcome in self.outcomes:
            result = outcome.result
            warnings = [f"warning: {warning}" for warning in warning_lines(outcome)]
            if outcome.is_unreadable or (not warnings and result.passed):  # the mistakes of a file were reported
                continue
            self._print(f"\n{outcome.job.label}", "bold")
            for line in failure_details(result):
                self._print(f"  {line}", "red")
            for line in warnings:
                self._print(f"  {line}", "yellow")
            if not result.passed:
                for vehicle, folder in result.logs.items():
                    self._print(f"  log of {vehicle}: {folder}")
                    for other in other_consecutive_logs(folder):
                        self._print(f"    of the same run: {other}")
                self._print(f"  again: {self.reproduction_command(outcome)}")

    def print_summary(self, wall: float) -> None:
        """Print how many there were of each kind."""
        wrong = [outcome for outcome in self.outcomes if outcome.is_unreadable]
        counts = {
            "passed": len(self.outcomes) - len(self.failed),
            "failed": len(self.failed) - len(wrong),
            "not readable": len(wrong),
            "not run": len(self.not_run),
        }
        summary = ", ".join(f"{count} {word}" for word, count in counts.items() if count)
        seconds = math.fsum(outcome.result.seconds for outcome in self.outcomes)
        style = "bold red" if self.failed or self.stopped else "bold green"
        self._print(f"{summary} in {wall:.1f} s; {seconds:.0f} s simulated" + "; stopped" * self.stopped, style)

    def _line(self, outcome: ScenarioOutcome) -> None:
        result = outcome.result
        words = "; ".join(failure_lines(result))
        if result.passed:
            tightest = min(result.verdicts, key=lambda verdict: verdict.margin, default=None)
            known = tightest is not None and math.isfinite(tightest.margin)
            words = f"margin {tightest.margin:.4g} of {tightest.name}" if tightest is not None and known else ""
        word, style = ("passed", "green") if result.passed else ("FAILED", "red")
        text = f"  {outcome.job.label}  {outcome.wall_time:.1f} s{'  ' * bool(words)}{words}"
        self.console.print(Text.assemble((word, style), printable(text)))

    def _print(self, text: str, style: str = "") -> None:
        lead = "\n" * text.startswith("\n")
        self.console.print(lead + printable(text.removeprefix("\n")), style=style or None, markup=False)


def _options(given: Mapping[str, Iterable[object]]) -> list[str]:
    """The options of a command line, by name with their values."""
    return [word for name, values in given.items() for value in values for word in (f"--{name}", str(value))]


def _write(path: Path, content: bytes) -> None:
    if path == Path("-"):
        click.echo(content, nl=False)
    else:
        write_output(path, content)
