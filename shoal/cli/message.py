"""`shoal message`: shows the fields of a message."""

import click

import imc
from shoal.cli.console_tables import first_sentence, format_range, open_console, plain_table, resolve_name
from shoal.cli.messages_option import messages_option


@click.command()
@click.argument("name")
@messages_option
def message(name: str, schema: imc.Schema) -> None:
    """Show the fields of the message NAME, which may be an id."""
    known = {name: schema[name] for name in schema.types}
    if name.isdecimal():
        found = next((cls for cls in known.values() if int(name) == cls.ID), None)
        if found is None:
            raise click.ClickException(f"no message has the id {name}")
    else:
        found = known[resolve_name(name, known, "message")]
    console, table = open_console(), plain_table("field", "type", "unit", "range", "values")
    console.print(f"[bold]{found.__name__}[/], id {found.ID}: {first_sentence(found)}")
    for field in imc.fields(found):
        limits = format_range(field.minimum, field.maximum)
        values = ", ".join(f"{member.value} {member.name}" for member in field.enum) if field.enum else ""
        table.add_row(field.name, field.type, field.unit, limits, values)
    if table.row_count:
        console.print(table)
