"""`shoal campaign compare`: shows what a change made better and worse."""

import sys
from collections.abc import Sequence
from pathlib import Path

import click

from shoal.campaigns import CampaignComparison, RunPair, open_results
from shoal.campaigns import compare_campaigns as compare_data
from shoal.cli.campaign.campaign_errors import FOLDER, errors_as_messages
from shoal.cli.console_tables import open_console, plain_table
from shoal.logs.inspect import format_noun_count
from support.terminal_text import printable

MOST_PAIRS = 10


@click.command()
@click.argument("a", type=FOLDER)
@click.argument("b", type=FOLDER)
@click.option(
    "--fail-if",
    "limits",
    multiple=True,
    metavar="LIMIT",
    help="Exit with 1 if the mean of B - A matches: 'pass rate < -2 %', 'metrics.NAME > 0.5', 'margins.NAME < -10 %'; "
    "or its whole confidence interval, which chance alone seldom causes: 'interval of pass rate < 0'.",
)
def compare(a: Path, b: Path, limits: tuple[str, ...]) -> None:
    """Compare campaign B with A, run by run: both must have the same seeds and draws.

    Positive numbers mean that B has more than A. A percentage in a limit is of A, and in points for the pass rate.
    """
    with errors_as_messages():
        found = compare_data(open_results(a), open_results(b))
        exceeded = [words for limit in limits if (words := found.describe_exceeded_limit(limit))]
    _show(found)
    for words in exceeded:
        click.echo(f"limit exceeded: {printable(words)}", err=True)
    sys.exit(1 if exceeded else 0)


def _show(found: CampaignComparison) -> None:
    rate = found.rate_change
    click.echo(f"A: {found.rate_a}\nB: {found.rate_b}")
    if rate.has_interval:
        interval = f"{100 * rate.low:+.1f} to {100 * rate.high:+.1f} points"
        known = f" ({interval}), McNemar p = {found.p_value:.2g}"
    else:
        known = f", no interval, {found.explain_missing_interval(rate)}"
    click.echo(f"B - A: {100 * rate.mean:+.1f} points{known}")
    for count, name in ((found.only_a, "A"), (found.only_b, "B")):
        if count:
            click.echo(f"not compared: {format_noun_count(count, 'run')} that only {name} has")
    if found.unfinished:
        click.echo(f"not compared: {format_noun_count(found.unfinished, 'run')} that did not end in both")
    columns = ("", "A", "B", "B - A", "interval", "fell", "rose")
    table = plain_table(*columns, right=columns[1:])
    for change in found.changes:
        interval = f"{change.low:+.3g} to {change.high:+.3g}" if change.has_interval else ""
        means = f"{change.before:.4g}", f"{change.after:.4g}", f"{change.mean:+.3g}"
        cells = (change.name, *means, interval, str(change.fell), str(change.rose))
        table.add_row(*map(printable, cells), style="" if change.is_significant else "dim")
    open_console(markup=False).print(table)
    _list("passes in A, fails in B", found.broken)
    _list("fails in A, passes in B", found.repaired)
    if not found.broken:
        _list("lost most margin", found.worse)


def _list(title: str, pairs: Sequence[RunPair]) -> None:
    if not pairs:
        return
    click.echo(f"{title}: {len(pairs)}" + (f", the first {MOST_PAIRS}:" if len(pairs) > MOST_PAIRS else ""))
    for pair in pairs[:MOST_PAIRS]:
        why = pair.b["error"].strip().splitlines()[-1:] or [pair.b["reason"]]
        margins = f"margin {pair.a['margin']:.4g} -> {pair.b['margin']:.4g}"
        click.echo(printable(f"  run {pair.a['run']}: {margins}" + (f", {why[0]}" if why[0] else "")))
