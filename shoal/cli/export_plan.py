"""`shoal export plan`: writes a plan as a file of another program."""

from collections.abc import Sequence
from pathlib import Path

import click

from shoal.missions import PLAN_SUFFIXES, PlanFileError, load_plan, plan_file_text
from support.atomic_files import new_file
from support.file_errors import describe_os_error
from support.terminal_text import printable
from support.text_length import list_first

MOST_NAMES = 5


@click.command()
@click.argument("plan", type=click.Path(path_type=Path, dir_okay=False))
@click.argument("output", type=click.Path(path_type=Path, dir_okay=False))
@click.option("--force", is_flag=True, help="Replace OUTPUT if it exists.")
def plan(plan: Path, output: Path, force: bool) -> None:
    """Write PLAN as OUTPUT: .yaml, .json, .plan and .waypoints of QGroundControl, .kml, .gpx or .geojson.

    Content that a format lacks is reported; a route (KML, GPX, GeoJSON) has places and depths only. Exit status 1 if
    OUTPUT has less than half of the maneuvers.
    """
    if output.suffix.lower() not in PLAN_SUFFIXES:
        raise click.UsageError(f"{output}: use one of {', '.join(PLAN_SUFFIXES)}")

    def remark(words: str) -> None:
        click.echo(printable(words), err=True)

    try:
        loaded = load_plan(plan, remark=remark)
        made = plan_file_text(loaded, output)
        for words in made.remarks:
            remark(words)
        with new_file(output, force) as part:
            part.write_text(made.text, encoding="utf-8")
    except PlanFileError as error:
        raise click.ClickException(printable(str(error))) from None
    except OSError as error:
        raise click.ClickException(describe_os_error(error, plan)) from None
    click.echo(printable(f"wrote {output}"))
    report_missing_maneuvers(made.missing, len(loaded.maneuvers))


def report_missing_maneuvers(missing: Sequence[str], total: int) -> None:
    """Print which maneuvers of a plan a file lacks; exit status 1 if these are more than half."""
    if not missing:
        return
    named = list_first(missing, MOST_NAMES)
    click.echo(printable(f"skipped: {len(missing)} of {total} maneuvers: {named}"), err=True)
    if 2 * len(missing) > total:
        click.echo("Error: less than half of the maneuvers was written", err=True)
        raise click.exceptions.Exit(1)
