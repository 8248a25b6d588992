"""`shoal campaign merge`: makes one data set of those of several computers."""

import shlex
import sys
from collections.abc import Sequence
from itertools import pairwise
from pathlib import Path

import click

from shoal.campaigns import merge_results, missing_paths, open_results, resume_command
from shoal.cli.campaign.campaign_errors import FOLDER, errors_as_messages
from shoal.logs.inspect import format_noun_count
from support.terminal_text import printable
from support.text_length import list_first

MOST_GAPS = 12


@click.command()
@click.argument("shards", metavar="SHARD...", nargs=-1, required=True, type=FOLDER)
@click.option("-o", "--out", type=FOLDER, required=True, help="Folder of the merged data set.")
def merge(shards: tuple[Path, ...], out: Path) -> None:
    """Merge data sets with runs of one study, such as those of `shoal campaign STUDY --shard 3/16`.

    A run that is in several counts once, and must be the same in all. The exit status is 1 if runs are missing or
    unfinished; `shoal campaign STUDY -o OUT` runs these.
    """
    with errors_as_messages():
        found = merge_results([open_results(folder) for folder in shards], out)
    data = found.data
    click.echo(f"{printable(data.name)}: {data.pass_rate}")
    if found.duplicates:
        click.echo(f"{format_noun_count(found.duplicates, 'row was', 'rows were')} there before, and equal")
    undone = {"missing": found.missing, "not ended": found.unfinished}
    for what, runs in undone.items():
        if runs:
            click.echo(f"{what}: {len(runs)} of {found.most} runs: {_spans(runs)}", err=True)
    if any(undone.values()):
        click.echo(printable(f"{resume_command(data, found.most)} does them"), err=True)
        for path in missing_paths(data):
            click.echo(printable(f"note: {path} is not on this computer: write where it is here"), err=True)
        sys.exit(1)
    click.echo(printable(f"shoal campaign report {shlex.quote(str(out))}"))


def _spans(runs: Sequence[int]) -> str:
    """Numbers as spans, such as 0 to 4, 7, 9 to 12."""
    starts = [runs[0], *(b for a, b in pairwise(runs) if b != a + 1)]
    ends = [*(a for a, b in pairwise(runs) if b != a + 1), runs[-1]]
    spans = [str(a) if a == b else f"{a} to {b}" for a, b in zip(starts, ends, strict=True)]
    return list_first(spans, MOST_GAPS)
