"""Serves the page over a network of vehicles."""

import asyncio
import socket
import ssl
import time
from collections.abc import Callable, Collection
from pathlib import Path
from typing import Any

import uvicorn

import imc
from shoal.console.access.authority import Authority, Journal
from shoal.console.access.page_security import PageSecurity
from shoal.console.access.page_sessions import Access
from shoal.console.access.users import User
from shoal.console.application import ConsoleApplication
from shoal.console.browser_libraries import read_browser_files
from shoal.console.cameras.camera_answers import CameraAnswers
from shoal.console.cameras.live_pictures import LivePictures
from shoal.console.cameras.logged_pictures import LoggedPictures
from shoal.console.charts.depth_contours import ContourAnswers
from shoal.console.charts.map_routes import MapRoutes
from shoal.console.charts.tiles import TileSets
from shoal.console.connections.page_listener import PageListener
from shoal.console.connections.page_protocol import PageHTTPServer
from shoal.console.foxglove import ViewerAccess
from shoal.console.health.dive_check_routes import DiveCheckRoutes
from shoal.console.health.message_rates import MessageCounter, RateRoutes
from shoal.console.logs.log_feed import LogFeed
from shoal.console.logs.log_library import LogLibrary
from shoal.console.logs.log_link import CONFIGURATION, LogLink
from shoal.console.logs.log_routes import LogRoutes
from shoal.console.logs.replay_answers import ReplayAnswers
from shoal.console.page_feed import PageFeed
from shoal.console.page_part import PagePart
from shoal.console.panels.user_panels import UserPanel
from shoal.console.parameters.profile_settings import ProfileSettings
from shoal.console.plans.forecast_routes import ForecastRoutes
from shoal.console.plans.plan_files import PlanFiles
from shoal.console.plans.plan_flights import PlanFlights
from shoal.network import Network, NetworkSystem

DEFAULT_PORTS = {"http": 80, "https": 443}  # which browsers leave out
CONTEXT = "Console"
"""The context of the log book's entries about users of the page."""
MOST_WORDS = 65536  # bytes of a message of the page
ENDING = 2  # s for open requests


class ConsoleServer:
    """The page of a network, with the map tiles of some files.

    port: where it listens; 0 takes a free one. player: plays a log as this network. log_root: for the logs of runs that
    are resumed from it. foxglove_origins: web pages that may connect as viewers, with a token. troubles: a sentence for
    each part that the page has to do without. `security` has its address, users and certificate; without, it is served
    to this computer only. `listener` is a socket that listens already; it is taken over. `journal(vehicle, text)`
    writes into the log book of a vehicle: by default by a LogBookEntry. `refusal(user)` is why a vehicle takes no
    orders of a user. `on_viewer()` is called when a page or a viewer is opened. `settings` are those of the profile of
    the vehicle in this process, and `counter` counts its messages; by default those that arrive are counted. The page
    lists the logs below `log_root`, or those that are played. `allows_forecasts` is whether the pages may have
    forecasts made, which take half a core. `panels` are those of the user.
    """

    def __init__(
        self,
        network: Network,
        port: int = 0,
        tiles: TileSets | None = None,
        player: LogLink | None = None,
        log_root: Path = Path("log"),
        *,
        foxglove_origins: Collection[str] = (),
        security: PageSecurity | None = None,
        listener: socket.socket | None = None,
        journal: Journal | None = None,
        refusal: Callable[[User], str] = lambda _: "",
        on_viewer: Callable[[], object] = lambda: None,
        settings: ProfileSettings | None = None,
        counter: MessageCounter | None = None,
        allows_forecasts: bool = True,
        panels: tuple[UserPanel, ...] = (),
    ) -> None:
        libraries, missing = read_browser_files()
        tiles = tiles or TileSets(None)
        self.security: PageSecurity = security or PageSecurity()
        self.troubles: list[str] = [*missing, *tiles.troubles, *filter(None, [self.security.notice])]
        self._network = network
        self._socket = PageListener(listener or _listening_socket(self.security.address, port))
        self.port: int = self._socket.getsockname()[1]
        self._access = Access(users=self.security.users)
        authority = Authority(journal or self._note, refusal)
        self._viewer_access = ViewerAccess(foxglove_origins)
        self._player = player
        if player is None:
            self._feed: PageFeed = PageFeed(network, authority.leases.view, on_viewer, authority.aborter)
        else:
            self._feed = LogFeed(network, player)
        self._parts: list[PagePart] = [
            LogRoutes(LogLibrary(log_root, () if player is None else player.logs)),
            RateRoutes(network, counter, player),
            MapRoutes(network, tiles, plays_log=player is not None),
        ]
        if player is None:
            self._parts += _live_parts(network, settings, self._feed.followed_for, allows_forecasts=allows_forecasts)
        else:
            self._parts += _log_parts(network, player, log_root)
        names, scheme = self.security.hosts, self.security.scheme
        hosts = [f"{name}:{self.port}" for name in names] + ([*names] if self.port == DEFAULT_PORTS[scheme] else [])
        application = ConsoleApplication(
            network,
            self._feed,
            self._access,
            authority,
            tiles,
            libraries,
            hosts,
            self.port,
            self._parts,
            self._viewer_access,
            player,
            settings,
            panels,
        )
        self._server = PageHTTPServer(
            uvicorn.Config(
                application.asgi,
                loop="none",
                http="h11",
                ws="websockets-sansio",
                ws_max_size=MOST_WORDS,
                ws_max_queue=4,
                lifespan="off",
                access_log=False,
                server_header=False,
                proxy_headers=False,  # else a program here may claim any address, and guess without a limit
                date_header=False,
                log_config=None,
                timeout_graceful_shutdown=ENDING,
                ssl_certfile=self.security.certificate,
                ssl_keyfile=self.security.key,
                ssl_ca_certs=self.security.client_authority,
                ssl_cert_reqs=ssl.CERT_OPTIONAL if self.security.client_authority else ssl.CERT_NONE,
            ),
            self._socket,
        )

    @property
    def is_watched(self) -> bool:
        """Whether somebody looks."""
        return self._feed.is_watched

    @property
    def rejected_connections(self) -> int:
        """Connections that were too many."""
        return self._socket.rejected

    def login_link(self) -> str:
        """An address that logs in once, within ten minutes. Its secret is behind #, which browsers do not send.

        Where others reach the page, users log in with passwords only: the address has no secret.
        """
        address = f"{self.security.scheme}://{self.security.hosts[0]}:{self.port}/"
        return address if self.security.is_open else f"{address}#{self._access.make_link_token()}"

    def _note(self, vehicle: str, text: str) -> None:
        """Let a vehicle log what a user does, and show it to the pages."""
        self._feed.note(vehicle, CONTEXT, text)
        system = self._network.systems.get(vehicle)
        if system is not None and system.id is not None:
            kind = imc.LogBookEntry.Type.INFO
            self._network.send(system, imc.LogBookEntry(type=kind, htime=time.time(), context=CONTEXT, text=text))

    def foxglove_link(self, *, operate: bool = False) -> str:
        """The address for Foxglove and Lichtblick until the console ends; with `operate` orders are offered, too."""
        scheme = "wss" if self.security.scheme == "https" else "ws"
        return f"{scheme}://{self.security.hosts[0]}:{self.port}/foxglove?token={self._viewer_access.token(operate=operate)}"

    async def serve(self, stopped: asyncio.Event) -> None:
        """Serve until an event is set. Raises whatever ends the server or the frames before."""
        loops: list[asyncio.Task[Any]] = [asyncio.create_task(self._feed.run())]
        if self._player is not None:
            loops.append(asyncio.create_task(self._player.run()))
        server = asyncio.create_task(self._server.serve())
        end = asyncio.create_task(stopped.wait())
        try:
            done, _ = await asyncio.wait((*loops, server, end), return_when=asyncio.FIRST_COMPLETED)
            for task in done:
                task.result()
        finally:
            for part in self._parts:
                part.close()
            self._server.end()
            loops.append(end)
            for task in loops:
                task.cancel()
            await asyncio.gather(server, *loops, return_exceptions=True)


def _live_parts(
    network: Network,
    settings: ProfileSettings | None,
    followed_for: Callable[[NetworkSystem], float],
    *,
    allows_forecasts: bool,
) -> list[PagePart]:
    """The views of vehicles that are there now."""
    systems = network.systems
    return [
        CameraAnswers(network, LivePictures(network)),
        ContourAnswers(lambda name: name if name in systems else None),
        DiveCheckRoutes(network, followed_for=followed_for),
        PlanFiles(network),
        PlanFlights(network),
        ForecastRoutes(network, settings, is_allowed=allows_forecasts),
    ]


def _log_parts(network: Network, player: LogLink, log_root: Path) -> list[PagePart]:
    """The views of the vehicles in a log."""
    systems, configuration = network.systems, player.states.path.parent / CONFIGURATION
    return [
        CameraAnswers(network, LoggedPictures(network, player)),
        ContourAnswers(lambda name: configuration if name in systems else None),
        DiveCheckRoutes(network, lambda: player.now, is_live=False),
        ReplayAnswers(player, log_root),
    ]


def _listening_socket(address: str, port: int) -> socket.socket:
    """Raises OSError if the port is taken."""
    found = socket.socket()
    try:
        found.setsockopt(socket.SOL_SOCKET, socket.SO_REUSEADDR, 1)
        found.bind((address, port))
        found.listen(64)
    except OSError:
        found.close()
        raise
    return found
