"""Serves the page over a network of vehicles, on the loopback address."""

import asyncio
import socket
from collections.abc import Collection, Generator
from contextlib import contextmanager

import uvicorn

from shoal.console.access import Access
from shoal.console.application import ConsoleApplication
from shoal.console.browser_libraries import read_browser_files
from shoal.console.foxglove import ViewerAccess
from shoal.console.page_feed import PageFeed
from shoal.console.tiles import TileSets
from shoal.network import Network

LOOPBACK = "127.0.0.1"
HTTP = 80  # the port that browsers leave out
MOST_WORDS = 65536  # bytes of a message of the page
ENDING = 2  # s for open requests


class ConsoleServer:
    """The page of a network, with the map tiles of some files.

    port: where it listens; 0 takes a free one. foxglove_origins: web pages that may connect as viewers, with a token.
    troubles: a sentence for each part that the page has to do without.
    """

    def __init__(
        self,
        network: Network,
        port: int = 0,
        tiles: TileSets | None = None,
        *,
        foxglove_origins: Collection[str] = (),
    ) -> None:
        libraries, missing = read_browser_files()
        tiles = tiles or TileSets(None)
        self.troubles: list[str] = [*missing, *tiles.troubles]
        self._socket = _listening_socket(port)
        self.port: int = self._socket.getsockname()[1]
        self._access = Access()
        self._viewer_access = ViewerAccess(foxglove_origins)
        self._feed = PageFeed(network)
        names = (LOOPBACK, "localhost")
        hosts = [f"{name}:{self.port}" for name in names] + ([*names] if self.port == HTTP else [])
        application = ConsoleApplication(
            network, self._feed, self._access, tiles, libraries, hosts, self.port, self._viewer_access
        )
        self._server = _Server(
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
                log_config=None,
                timeout_graceful_shutdown=ENDING,
            )
        )

    def login_link(self) -> str:
        """An address that logs in once, within ten minutes. Its secret is behind #, which browsers do not send."""
        return f"http://{LOOPBACK}:{self.port}/#{self._access.make_link_token()}"

    def foxglove_link(self, *, operate: bool = False) -> str:
        """The address for Foxglove and Lichtblick until the console ends; with `operate` orders are offered, too."""
        return f"ws://{LOOPBACK}:{self.port}/foxglove?token={self._viewer_access.token(operate=operate)}"

    async def serve(self, stopped: asyncio.Event) -> None:
        """Serve until an event is set. Raises whatever ends the server or the frames before."""
        feed = asyncio.create_task(self._feed.run())
        server = asyncio.create_task(self._server.serve(sockets=[self._socket]))
        end = asyncio.create_task(stopped.wait())
        try:
            done, _ = await asyncio.wait((feed, server, end), return_when=asyncio.FIRST_COMPLETED)
            for task in done:
                task.result()
        finally:
            self._server.should_exit = True
            for task in (feed, end):
                task.cancel()
            await asyncio.gather(server, feed, end, return_exceptions=True)


class _Server(uvicorn.Server):
    @contextmanager
    def capture_signals(self) -> Generator[None]:
        """Leave signals to the program."""
        yield


def _listening_socket(port: int) -> socket.socket:
    """Raises OSError if the port is taken."""
    found = socket.socket()
    try:
        found.setsockopt(socket.SOL_SOCKET, socket.SO_REUSEADDR, 1)
        found.bind((LOOPBACK, port))
        found.listen(64)
    except OSError:
        found.close()
        raise
    return found
