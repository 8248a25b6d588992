"""`shoal message`: shows the fields of a message."""

from pathlib import Path

import click

import imc
from shoal.cli.tables import choose, open_console, plain_table, range_text, sentence


@click.command()
@click.argument("name")
@click.option(
    "--messages",
    "files",
    multiple=True,
    type=click.Path(exists=True, dir_okay=False, path_type=Path),
    help="Definitions of your own, as in [General] Messages.",
)
def message(name: str, files: tuple[Path, ...]) -> None:
    """Show the fields of the message NAME, which may be an id."""
    schema = imc.builtin()
    try:
        for path in files:
            schema = imc.load(path, over=schema)
    except imc.SchemaError as error:
        raise click.ClickException(str(error)) from None
    known = {name: schema[name] for name in schema.types}
    if name.isdecimal():
        found = next((cls for cls in known.values() if int(name) == cls.ID), None)
        if found is None:
            raise click.ClickException(f"no message has the id {name}")
    else:
        found = known[choose(name, known, "message")]
    console, table = open_console(), plain_table("field", "type", "unit", "range", "values")
    console.print(f"[bold]{found.__name__}[/], id {found.ID}: {sentence(found)}")
    for field in imc.fields(found):
        limits = range_text(field.minimum, field.maximum)
        values = ", ".join(f"{member.value} {member.name}" for member in field.enum) if field.enum else ""
        table.add_row(field.name, field.type, field.unit, limits, values)
    if table.row_count:
        console.print(table)
