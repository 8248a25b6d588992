"""The page of a network in this process, to which a test brings what it wants."""

import asyncio
import http.client
import json
import ssl
import threading
from collections.abc import Iterator
from contextlib import contextmanager
from typing import Any

from websockets.sync.client import ClientConnection, connect

from shoal.console import ConsoleServer
from shoal.network import Network
from tests.shoal.console.foxglove.packet_radio import Radio


class ServedPage:
    """A page, and somebody who asks it."""

    def __init__(self, server: ConsoleServer) -> None:
        self.server = server
        self.host = f"127.0.0.1:{server.port}"
        self.cookie = ""
        self.tls: ssl.SSLContext | None = None

    def request(self, method: str, path: str, body: Any = None, **headers: str) -> tuple[int, bytes, dict[str, str]]:
        if self.tls is None:
            connection = http.client.HTTPConnection("127.0.0.1", self.server.port, timeout=10)
        else:
            connection = http.client.HTTPSConnection("127.0.0.1", self.server.port, timeout=10, context=self.tls)
        scheme = self.server.security.scheme
        sent = {"Host": self.host, "Origin": f"{scheme}://{self.host}", "Cookie": self.cookie, **headers}
        connection.request(method, path, None if body is None else json.dumps(body), sent)
        answer = connection.getresponse()
        content = answer.read()
        connection.close()
        return answer.status, content, {name.lower(): value for name, value in answer.getheaders()}

    def frames(self) -> ClientConnection:
        return connect(
            f"ws://{self.host}/frames",
            origin=f"http://{self.host}",
            additional_headers={"Cookie": self.cookie},
            ping_interval=None,
            max_queue=None,  # else frames that nobody reads keep it from closing
        )

    def another(self, **words: object) -> "ServedPage":
        """The page in another browser, where a user has logged in."""
        found = ServedPage(self.server)
        found.log_in(**words)
        return found

    def log_in(self, **words: object) -> None:
        """Log in with the link, or with user and password."""
        token = self.server.login_link().partition("#")[2]
        status, content, headers = self.request("POST", "/api/login", words or {"token": token})
        assert status == 200, content
        self.cookie = headers["set-cookie"].partition(";")[0]


@contextmanager
def served_page(*links: Any, **options: Any) -> Iterator[ServedPage]:
    """`options` are those of ConsoleServer; without links the network has a Radio."""
    begun, found = threading.Event(), []

    async def serve() -> None:
        async with Network(links or [Radio()]) as network:
            stopped, server = asyncio.Event(), ConsoleServer(network, **options)
            found.extend((asyncio.get_running_loop(), stopped, ServedPage(server)))
            begun.set()
            await server.serve(stopped)

    thread = threading.Thread(target=lambda: asyncio.run(serve()))
    thread.start()
    assert begun.wait(20.0)
    loop, stopped, page = found
    try:
        yield page
    finally:
        loop.call_soon_threadsafe(stopped.set)
        thread.join(20.0)
