"""`shoal console`: the page in the browser for all vehicles that are reached."""

import asyncio
import signal
from pathlib import Path
from typing import Any

import click

import imc
from shoal.cli.messages_option import messages_option
from shoal.cli.optional_extra import require_extra
from shoal.cli.remote_command import network_options, run_on_network
from shoal.network import Network
from support.file_errors import describe_os_error
from support.terminal_text import printable

PORT = 8080
STOPPING = [getattr(signal, name) for name in ("SIGINT", "SIGTERM", "SIGHUP") if hasattr(signal, name)]


@click.command()
@click.option("--port", type=click.IntRange(0, 65535), default=PORT, show_default=True, help="0 takes a free one.")
@click.option(
    "--tiles",
    type=click.Path(exists=True, file_okay=False, path_type=Path),
    metavar="FOLDER",
    help="Map tiles: a folder with .mbtiles and .pmtiles files.",
)
@click.option("--open", "opens", is_flag=True, help="Open the page in the browser of this computer.")
@click.option(
    "--foxglove",
    type=click.Choice(("watch", "operate")),
    help="Print the address for Foxglove and Lichtblick: to watch only, or also to send orders and set parameters.",
)
@click.option(
    "--foxglove-origin",
    "origins",
    multiple=True,
    metavar="URL",
    help="A web page that may connect as Foxglove does, such as https://app.foxglove.dev; may be given again.",
)
@messages_option
@network_options
def console(
    port: int,
    tiles: Path | None,
    opens: bool,
    foxglove: str | None,
    origins: tuple[str, ...],
    schema: imc.Schema,
    connection: dict[str, Any],
) -> None:
    """Show all vehicles on the network in the browser: map, states, log book, plots, plans, parameters, Abort.

    Prints a link that logs in once. The page is served to this computer only. Ctrl-C ends.
    """
    with require_extra("console"):
        from shoal.console import ConsoleServer, TileSets  # a web server: not installed everywhere

    maps = TileSets(tiles)

    async def act(network: Network) -> None:
        try:
            server = ConsoleServer(network, port, maps, foxglove_origins=origins)
        except OSError as error:
            reason = describe_os_error(error, f"port {port}")
            raise click.ClickException(f"{reason}; --port 0 takes a free one") from None
        for trouble in server.troubles:
            click.echo(printable(trouble), err=True)
        stopped = asyncio.Event()
        for number in STOPPING:
            asyncio.get_running_loop().add_signal_handler(number, stopped.set)
        link = server.login_link()
        click.echo(f"open {link}")
        if foxglove is not None:
            click.echo(f"Foxglove: open connection {server.foxglove_link(operate=foxglove == 'operate')}")
        if opens:
            click.launch(link)
        await server.serve(stopped)

    run_on_network({**connection, "messages": schema}, act)
