"""`shoal console`: the page in the browser for all vehicles that are reached, or for a log."""

import asyncio
import signal
from pathlib import Path
from typing import Any

import click

import imc
from imc.discovery import check_address
from shoal.cli.console_access import FOLDER_HELP, certificate, user
from shoal.cli.default_command_group import DefaultCommandGroup
from shoal.cli.log.log_input import (
    LOG,
    errors_as_messages,
    logs_of_argument,
    progress_bar,
    run_selection_options,
)
from shoal.cli.messages_option import messages_option
from shoal.cli.optional_extra import require_extra
from shoal.cli.options import log_dir_option
from shoal.cli.remote_command import network_options, run_on_network
from shoal.logs.log_states import LogStates
from shoal.network import Network
from support.file_errors import describe_os_error
from support.terminal_text import printable
from tasks.transports.console import PORTS_TRIED
from tasks.transports.imc_links.port_search import listening_socket

PORT = 8080
STOPPING = [getattr(signal, name) for name in ("SIGINT", "SIGTERM", "SIGHUP") if hasattr(signal, name)]


@click.group(cls=DefaultCommandGroup, default="page")
def console() -> None:
    """Show all vehicles on the network in the browser, and manage its users and certificates."""


console.add_command(user)
console.add_command(certificate)


@console.command()
@click.argument("log", type=LOG, required=False)
@run_selection_options(optional=("log",))
@click.option(
    "--port",
    type=click.IntRange(0, 65535),
    help="Port of the page; 0 takes a free one. [default: 8080, or if it is taken one of the next four, else any]",
)
@click.option(
    "--tiles",
    type=click.Path(exists=True, file_okay=False, path_type=Path),
    metavar="FOLDER",
    help="Map tiles: a folder with .mbtiles and .pmtiles files, and overlays of `shoal map import`.",
)
@click.option(
    "--panels",
    type=click.Path(exists=True, dir_okay=False, path_type=Path),
    metavar="FILE",
    help="Panels of your own: a YAML file of values, plots and buttons that send a message.",
)
@click.option(
    "--address",
    default="127.0.0.1",
    show_default=True,
    help="IPv4 address to serve the page at; any but 127.0.0.1 needs users and a certificate.",
)
@click.option("--folder", type=click.Path(file_okay=False, path_type=Path), help=FOLDER_HELP)
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
@log_dir_option
@messages_option
@network_options
def page(
    log: Path | None,
    port: int | None,
    tiles: Path | None,
    panels: Path | None,
    address: str,
    folder: Path | None,
    opens: bool,
    foxglove: str | None,
    origins: tuple[str, ...],
    log_dir: Path,
    schema: imc.Schema,
    connection: dict[str, Any],
) -> None:
    """Show all vehicles on the network in the browser: map, states, log book, plots, plans, parameters, Abort.

    With LOG, a folder or a Data.lsf of Shoal or DUNE, it plays this instead: play, pause, speed, seek. A virtual run
    can be resumed from any time of it, into a new log below --log-dir.

    Prints a link that logs in once. Without --address the page is served to this computer only. Ctrl-C ends.
    """
    with require_extra("console"):  # a web server: not installed everywhere
        from shoal.console import (
            ConsoleServer,
            LogLink,
            PageSecurityError,
            PanelFileError,
            TileSets,
            access_folder,
            read_page_security,
            read_panels,
        )

    maps = TileSets(tiles)
    try:
        check_address(address)
        security = read_page_security(address, folder or access_folder())
    except ValueError as error:
        raise (click.ClickException if isinstance(error, PageSecurityError) else click.UsageError)(str(error)) from None
    try:
        own_panels = read_panels(panels, schema) if panels is not None else ()
    except (PanelFileError, OSError) as error:
        text = describe_os_error(error) if isinstance(error, OSError) else str(error)
        raise click.ClickException(printable(text)) from None
    player: LogLink | None = None
    if log is not None:
        with errors_as_messages(), progress_bar(log) as show:
            player = LogLink(LogStates(log, show), logs_of_argument(log))
        if player.notice:
            click.echo(player.notice, err=True)

    async def act(network: Network) -> None:
        try:
            listener = listening_socket(address, PORT, PORTS_TRIED) if port is None else None
            server = ConsoleServer(
                network,
                port or 0,
                maps,
                player,
                log_dir,
                security=security,
                foxglove_origins=origins,
                listener=listener,
                panels=own_panels,
            )
        except OSError as error:
            reason = describe_os_error(error, f"port {port}")
            raise click.ClickException(f"{reason}; --port 0 takes a free one") from None
        await maps.overlays.read()
        for trouble in (*server.troubles, *maps.overlays.troubles):
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

    async def replay(player: LogLink) -> None:
        async with Network([player], messages=player.states.schema) as network:
            await act(network)

    if player is None:
        run_on_network({**connection, "messages": schema}, act)
    else:
        asyncio.run(replay(player))
