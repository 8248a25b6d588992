"""`shoal export plan`: writes a plan as a file of another program."""

from pathlib import Path

import click

from shoal.missions import PLAN_SUFFIXES, PlanFileError, load_plan, plan_file_text
from support.atomic_files import new_file
from support.file_errors import describe_os_error
from support.terminal_text import printable


@click.command()
@click.argument("plan", type=click.Path(path_type=Path, dir_okay=False))
@click.argument("output", type=click.Path(path_type=Path, dir_okay=False))
@click.option("--force", is_flag=True, help="Replace OUTPUT if it exists.")
def plan(plan: Path, output: Path, force: bool) -> None:
    """Write PLAN as OUTPUT: .yaml, .json, .plan and .waypoints of QGroundControl, .kml, .gpx or .geojson.

    What a format cannot say is reported; a route (KML, GPX, GeoJSON) has places and depths only.
    """
    if output.suffix.lower() not in PLAN_SUFFIXES:
        raise click.UsageError(f"{output}: use one of {', '.join(PLAN_SUFFIXES)}")

    def remark(words: str) -> None:
        click.echo(printable(words), err=True)

    try:
        text, remarks = plan_file_text(load_plan(plan, remark=remark), output)
        for words in remarks:
            remark(words)
        with new_file(output, force) as part:
            part.write_text(text, encoding="utf-8")
    except PlanFileError as error:
        raise click.ClickException(printable(str(error))) from None
    except OSError as error:
        raise click.ClickException(describe_os_error(error, plan)) from None
    click.echo(printable(f"wrote {output}"))
