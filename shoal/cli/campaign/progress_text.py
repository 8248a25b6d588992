"""The progress of a campaign while it runs, and the result of a search."""

import math
import shlex

import click

from shoal.campaigns import CampaignResults, SearchFindings, compute_findings, describe_run, scenario_test_command
from shoal.logs.inspect import format_noun_count
from support.terminal_text import printable


def progress_line(data: CampaignResults, *, is_short: bool = False) -> str:
    """Progress and results so far, in a line."""
    if (shown := compute_findings(data)) is not None:
        best = shown.best_so_far[-1] if shown.best_so_far else math.nan
        done = format_noun_count(len(data.rows), "run")
        return printable(
            f"{done}, {shown.objective.extreme_word} {shown.objective.text} {best:.4g}" if best == best else done
        )
    rate = data.pass_rate
    if not is_short:
        return str(rate)
    if not rate.runs:
        return "starting"
    return f"{rate.ratio_text} passed" + (f" ({rate.interval_text})" if rate.has_interval else "")


def uncounted_runs_text(data: CampaignResults) -> str:
    """A line about runs of the folder that are beyond a smaller number of runs; empty if there are none."""
    count = len(data.rows) - len(data.counted_rows)
    if not count or data.end != data.metadata["most"]:  # an `until` that was reached leaves out those that came later
        return ""
    others = format_noun_count(count, "more run is", "more runs are")
    verb, they = ("does", "it") if count == 1 else ("do", "they")
    words = f"{others} in {data.folder}, and {verb} not count; with --runs {max(data.rows) + 1} {they} {verb}"
    return printable(words)


def print_findings(data: CampaignResults, shown: SearchFindings) -> None:
    """Print what a search has found, and the commands for what it has written."""
    goal = shown.objective
    smaller = len(data.rows) - len(shown.trials) - 1
    more = f", {smaller} made the change smaller" if smaller else ""
    click.echo(
        printable(
            f"{data.name}: {format_noun_count(len(shown.trials), 'run')} sought "
            f"the {goal.extreme_word} {goal.text}{more}"
        )
    )
    if shown.baseline is not None:
        click.echo(f"  as it is: {goal.value(shown.baseline):.4g}")
    if shown.best is not None:
        click.echo(f"  {goal.extreme_word}: {goal.value(shown.best):.4g}, run {shown.best['run']}")
    if shown.row_to_keep is not None:
        _show_found(shown, data.metadata["units"])
    else:
        nothing = "no run fails" if goal.seeks_failure else "no run is better than the scenario as it is"
        click.echo(printable(f"  {nothing}" if shown.best is not None else f"  no run has {_wanted(shown)}"))
    if not any(math.isfinite(value) for value in shown.best_so_far) and shown.trials:
        click.echo(f"warning: no run has {_wanted(shown)} that is finite: nothing to compare", err=True)
    files = [*sorted(data.folder.glob("*.scenario.yaml")), *sorted(data.folder.glob("tuned*.ini"))]
    for file in files:
        click.echo(printable(str(file)))
    if files and goal.seeks_failure:
        click.echo(printable(scenario_test_command(data, files[0])))
    click.echo(printable(f"shoal campaign report {shlex.quote(str(data.folder))}"))


def _show_found(shown: SearchFindings, units: dict[str, str]) -> None:
    found = shown.row_to_keep
    assert found is not None
    _, *lines = describe_run(shown, found, units)
    if not shown.objective.seeks_failure:
        words = ""
    elif shown.changed_values_of_run(found):
        count = format_noun_count(len(shown.failures), "run fails", "runs fail")
        words = f"{count}; the smallest change that does is run {found['run']}"
    else:
        words = "it fails as it is: there is nothing to look for"
    for line in ([words] if words else []) + lines:
        click.echo(printable(f"    {line}" if line != words else f"  {line}"))


def _wanted(shown: SearchFindings) -> str:
    return f"{shown.objective.text}" + (" and passes" if shown.objective.only_passed else "")
