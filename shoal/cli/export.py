"""`shoal export`: writes the files that other programs need of a vehicle, or a plan for them."""

from typing import ClassVar

import click

from shoal.cli import LazyGroup

COMMANDS = {
    "plan": ("shoal.cli.export_plan", "Write a plan as a file of QGroundControl, KML, GPX or GeoJSON."),
    "neptus": ("shoal.cli.export_neptus", "Write the definition and the parameters of a vehicle for Neptus."),
}


class ExportGroup(LazyGroup):
    """The commands of `shoal export`."""

    table: ClassVar[dict[str, tuple[str, str]]] = COMMANDS


@click.group(cls=ExportGroup)
def export() -> None:
    """Write the files that other programs need of a vehicle, or a plan for them."""
