"""`--messages`: definitions of a user's own messages, for the commands that show or send them."""

from pathlib import Path
from typing import Final

import click

import imc


def _over_builtin(_: click.Context, __: click.Parameter, files: tuple[Path, ...]) -> imc.Schema:
    """Click callback: the built-in messages with those of some files."""
    schema = imc.builtin()
    try:
        for path in files:
            schema = imc.load(path, over=schema)
    except imc.SchemaError as error:
        raise click.BadParameter(str(error)) from None
    return schema


messages_option: Final = click.option(
    "--messages",
    "schema",
    multiple=True,
    type=click.Path(exists=True, dir_okay=False, path_type=Path),
    callback=_over_builtin,
    help="Definitions of your own, as in [General] Messages.",
)
