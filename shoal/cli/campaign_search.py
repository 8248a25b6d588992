"""What a campaign tells while it runs, and what a search has found."""

import math
import shlex

import click

from shoal.campaigns import DataSet, Findings, findings_of, test_command, told
from shoal.logs.inspect import format_count
from support.text import printable


def state_of(data: DataSet, *, is_short: bool = False) -> str:
    """What is known by now, in a line."""
    if (shown := findings_of(data)) is not None:
        best = shown.course[-1] if shown.course else math.nan
        done = format_count(len(data.rows), "run")
        return printable(f"{done}, {shown.goal.kind} {shown.goal.text} {best:.4g}" if best == best else done)
    rate = data.rate
    if not is_short:
        return str(rate)
    return f"{rate.share:.1%} ± {rate.half_width:.1%} passed" if rate.runs else "starting"


def left_out(data: DataSet) -> str:
    """A line about runs of the folder that are beyond a smaller number of runs; empty if there are none."""
    count = len(data.rows) - len(data.counted)
    if not count or data.end != data.about["most"]:  # an `until` that was reached leaves out those that came later
        return ""
    others = format_count(count, "more run is", "more runs are")
    verb, they = ("does", "it") if count == 1 else ("do", "they")
    words = f"{others} in {data.folder}, and {verb} not count; with --runs {max(data.rows) + 1} {they} {verb}"
    return printable(words)


def show_findings(data: DataSet, shown: Findings) -> None:
    """Tell what a search has found, and the commands for what it has written."""
    goal = shown.goal
    smaller = len(data.rows) - len(shown.trials) - 1
    more = f", {smaller} made the change smaller" if smaller else ""
    click.echo(
        printable(f"{data.name}: {format_count(len(shown.trials), 'run')} sought the {goal.kind} {goal.text}{more}")
    )
    if shown.as_it_is is not None:
        click.echo(f"  as it is: {goal.value(shown.as_it_is):.4g}")
    if shown.best is not None:
        click.echo(f"  {goal.kind}: {goal.value(shown.best):.4g}, run {shown.best['run']}")
    if shown.found is not None:
        _show_found(shown, data.about["units"])
    else:
        nothing = "no run fails" if goal.breaks else "no run is better than the scenario as it is"
        click.echo(printable(f"  {nothing}" if shown.best is not None else f"  no run has {_wanted(shown)}"))
    if not any(math.isfinite(value) for value in shown.course) and shown.trials:
        click.echo(f"warning: no run has {_wanted(shown)} that is finite: the search had nothing to go by", err=True)
    files = [*sorted(data.folder.glob("*.scenario.yaml")), *sorted(data.folder.glob("tuned*.ini"))]
    for file in files:
        click.echo(printable(str(file)))
    if files and goal.breaks:
        click.echo(printable(test_command(data, files[0])))
    click.echo(printable(f"shoal campaign report {shlex.quote(str(data.folder))}"))


def _show_found(shown: Findings, units: dict[str, str]) -> None:
    found = shown.found
    assert found is not None
    _, *lines = told(shown, found, units)
    if not shown.goal.breaks:
        words = ""
    elif shown.changes(found):
        count = format_count(len(shown.broken), "run fails", "runs fail")
        words = f"{count}; the smallest change that does is run {found['run']}"
    else:
        words = "it fails as it is: there is nothing to look for"
    for line in ([words] if words else []) + lines:
        click.echo(printable(f"    {line}" if line != words else f"  {line}"))


def _wanted(shown: Findings) -> str:
    return f"{shown.goal.text}" + (" and passes" if shown.goal.only_passed else "")
