"""`shoal map`: charts for the map of the page in the browser."""

import math
from pathlib import Path

import click

from shoal.cli import CommandGroup, WrongUse
from shoal.cli.optional_extra import require_extra
from support.atomic_files import write_output
from support.file_errors import describe_os_error
from support.file_names import file_name_part
from support.terminal_text import printable
from world.charts import ChartWindow

FOLDER = Path("charts")


class _Place(click.ParamType[tuple[float, float]]):
    """Latitude and longitude in degrees, such as 41.185,-8.706; in radians inside."""

    name = "LAT,LON"

    def convert(
        self, value: str | tuple[float, float], param: click.Parameter | None, ctx: click.Context | None
    ) -> tuple[float, float]:
        if not isinstance(value, str):
            return value
        try:
            lat, lon = (float(word) for word in value.split(","))
        except ValueError:
            self.fail(f"{value!r} is not a latitude and longitude, such as 41.185,-8.706", param, ctx)
        if not (abs(lat) <= 90.0 and abs(lon) <= 180.0):
            self.fail(f"{value!r} is not a place on Earth", param, ctx)
        return math.radians(lat), math.radians(lon)


@click.group(cls=CommandGroup)
def map() -> None:
    """Import charts for the map in the browser."""


@map.command(name="import")
@click.argument("charts", type=click.Path(exists=True, dir_okay=False, path_type=Path), nargs=-1, required=True)
@click.option(
    "--into",
    "folder",
    type=click.Path(file_okay=False, path_type=Path),
    default=FOLDER,
    show_default=True,
    help="Folder for the overlays: that of --tiles of `shoal console`, and of Map Tiles of a vehicle.",
)
@click.option("--around", type=_Place(), help="Place around which GeoTIFF, NetCDF, grids and soundings are read.")
@click.option(
    "--radius",
    type=click.FloatRange(1.0, 50_000.0),
    default=2000.0,
    show_default=True,
    help="Distance from --around to read, in m.",
)
def import_(charts: tuple[Path, ...], folder: Path, around: tuple[float, float] | None, radius: float) -> None:
    """Import CHARTS as overlays of the map: S-57 (.000), GeoJSON, KML, GPX; contours of GeoTIFF and other depths.

    Each becomes a GeoJSON file with the name of the chart, which the page draws, also beside tiles.
    """
    with require_extra("charts,console"):
        from shoal.console import OVERLAY_SUFFIX, ChartImportError, import_chart

        window = None if around is None else ChartWindow(*around, radius)
        targets = [folder / f"{file_name_part(path.stem) or 'chart'}{OVERLAY_SUFFIX}" for path in charts]
        if twice := next((target for target in targets if targets.count(target) > 1), None):
            raise WrongUse(printable(f"more than one chart becomes {twice}: rename one of them"))
        for path, target in zip(charts, targets, strict=True):
            try:
                found = import_chart(path, window)
                folder.mkdir(parents=True, exist_ok=True)
                if target.exists() and target.resolve() == path.resolve():
                    raise ChartImportError(f"{path}: is the overlay itself")
                write_output(target, found.text)
            except ChartImportError as error:
                raise WrongUse(printable(str(error))) from None
            except OSError as error:
                raise WrongUse(describe_os_error(error, target)) from None
            count = len(found.features)
            click.echo(f"{printable(str(target))}: {count} feature{'' if count == 1 else 's'}")
            for remark in found.remarks:
                click.echo(f"  {remark}", err=True)
