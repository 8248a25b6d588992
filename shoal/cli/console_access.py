"""`shoal console user` and `shoal console certificate`: who may use the page from other computers."""

import sys
from pathlib import Path
from typing import Final

import click

from shoal.cli.optional_extra import require_extra
from support.terminal_text import printable

FOLDER_HELP = "Folder with users and certificate [default: shoal/console in the configuration folder]."
ROLES = ("watch", "operate", "maintain")
folder_option: Final = click.option("--folder", type=click.Path(file_okay=False, path_type=Path), help=FOLDER_HELP)


@click.command()
@click.argument("name", required=False)
@click.option("--role", type=click.Choice(ROLES), help="watch: see; operate: command, too; maintain: set parameters.")
@click.option("--remove", is_flag=True, help="Remove the user; its sessions end.")
@folder_option
def user(name: str | None, role: str | None, remove: bool, folder: Path | None) -> None:
    """Add a user of the page, or change role and password, or list the users.

    Asks for the password, or reads it from a pipe.
    """
    with require_extra("console"):
        from shoal.console import Role, Users, access_folder

    try:
        users = Users(folder or access_folder())
        path = printable(str(users.path))
        if name is None:
            if role or remove:
                raise click.UsageError("name a user")
            for each, found in sorted(users.roles().items()):
                click.echo(f"{each}  {found.word}")
            return
        if remove:
            users.remove(name)
            click.echo(f"{name} is removed from {path}")
            return
        if role is None:
            raise click.UsageError(f"name a role: --role {', '.join(ROLES)}")
        users.add(name, Role[role.upper()], _password())
    except ValueError as error:
        raise click.ClickException(printable(str(error))) from None
    click.echo(f"{name} may {role}: {path}")


@click.command()
@click.argument("names", nargs=-1)
@click.option("--client", metavar="NAME", help="Make the certificate with which this user logs in, without a password.")
@click.option("--role", type=click.Choice(ROLES), help="The role of this user.")
@click.option("--force", is_flag=True, help="Replace the certificate that is there.")
@folder_option
def certificate(names: tuple[str, ...], client: str | None, role: str | None, force: bool, folder: Path | None) -> None:
    """Make a certificate for the page, for NAMES and addresses of this computer (by default those that it has now).

    Prints the SHA-256 to compare in the browser, which warns of a certificate that nobody else has signed. With
    --client it makes one for a user instead, as a file to import into the browser, and prints the password of the file.
    """
    if client is not None or role is not None:
        _make_client_certificate(names, client, role, force=force, folder=folder)
        return
    with require_extra("console"):
        from shoal.console import CERTIFICATE, access_folder, make_certificate, own_names

    place = folder or access_folder()
    path = place / CERTIFICATE
    if path.exists() and not force:
        raise click.ClickException(f"{printable(str(path))} is there: --force replaces it")
    named = list(names) or own_names()
    try:
        found = make_certificate(place, named)
    except ValueError as error:
        raise click.ClickException(printable(str(error))) from None
    click.echo(f"{printable(str(path))}: for {printable(', '.join(named))}\nSHA-256 {found}")


def _make_client_certificate(
    names: tuple[str, ...], client: str | None, role: str | None, *, force: bool, folder: Path | None
) -> None:
    if names:
        raise click.UsageError("a certificate with --client is for a user, not for names of a computer")
    if client is None or role is None:
        raise click.UsageError(f"name a user and a role: --client NAME --role {', '.join(ROLES)}")
    with require_extra("console"):
        from shoal.console import Role, access_folder, make_client_certificate

    try:
        made = make_client_certificate(folder or access_folder(), client, Role[role.upper()], replaces=force)
    except ValueError as error:
        raise click.ClickException(printable(str(error))) from None
    click.echo(
        f"{client} may {role}: import {printable(str(made.path))} into the browser; its password: {made.password}"
    )
    if made.is_first:
        click.echo("The page asks browsers for certificates from its next start on")


def _password() -> str:
    if not sys.stdin.isatty():
        return sys.stdin.readline().rstrip("\n")
    return click.prompt("Password", hide_input=True, confirmation_prompt=True)
