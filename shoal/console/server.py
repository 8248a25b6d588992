"""Serves the page over a network of vehicles, on the loopback address."""

import asyncio
import socket
from collections.abc import AsyncGenerator, Generator
from contextlib import asynccontextmanager, contextmanager
from pathlib import Path

import uvicorn

from shoal.console.access import Access
from shoal.console.application import ConsoleApplication
from shoal.console.browser_libraries import read_browser_files
from shoal.console.page_feed import PageFeed
from shoal.console.tiles import TileSets
from shoal.network import Network

LOOPBACK = "127.0.0.1"
MOST_CONNECTIONS = 64
MOST_WORDS = 65536  # bytes of a message of the page
ENDING = 2  # s for open requests


class ConsoleServer:
    """The page of a network. `tile_folder` has MBTiles and PMTiles files.

    port: where it listens; 0 takes a free one. troubles: a sentence for each part that the page has to do without.
    """

    def __init__(self, network: Network, port: int = 0, tile_folder: Path | None = None) -> None:
        libraries, missing = read_browser_files()
        tiles = TileSets(tile_folder)
        self.troubles: list[str] = [*missing, *tiles.troubles]
        self._socket = _listening_socket(port)
        self.port: int = self._socket.getsockname()[1]
        self._access = Access()
        self._feed = PageFeed(network)
        hosts = {f"{name}:{self.port}" for name in (LOOPBACK, "localhost")}
        application = ConsoleApplication(network, self._feed, self._access, tiles, libraries, hosts)
        self._server = _Server(
            uvicorn.Config(
                application.asgi,
                loop="none",
                http="h11",
                ws="websockets-sansio",
                ws_max_size=MOST_WORDS,
                ws_max_queue=4,
                limit_concurrency=MOST_CONNECTIONS,
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

    @asynccontextmanager
    async def running(self) -> AsyncGenerator[None]:
        """Serve until the end of the block."""
        feed = asyncio.create_task(self._feed.run())
        server = asyncio.create_task(self._server.serve(sockets=[self._socket]))
        try:
            yield
        finally:
            self._server.should_exit = True
            feed.cancel()
            await asyncio.gather(server, feed, return_exceptions=True)


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
