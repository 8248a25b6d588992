"""HTTP connections of the page, with limits of time for requests and for readers, and the server that has them."""

import asyncio
import hashlib
import socket
import ssl
from collections.abc import Generator
from contextlib import contextmanager
from typing import Any

import h11
import uvicorn
from uvicorn.protocols.http.h11_impl import H11Protocol
from uvicorn.server import ServerState

from shoal.console.access.page_sessions import NO_CERTIFICATE, ShownCertificate
from shoal.console.connections.page_listener import PageListener

HANDSHAKE = 10.0  # s for TLS
HEAD, BODY = 10.0, 20.0  # s for the head of a request, and for the rest
UNREAD = 30.0  # s in which a reader has to take what the system does not keep for it
CLIENT_CERTIFICATE = "client_certificate"
"""Name in the `state` of a scope: the certificate of the client, see `ShownCertificate`."""


class PageProtocol(H11Protocol):
    """A connection that is closed if a request, or the reading of an answer, takes too long.

    The client's certificate, which TLS has checked, is in the state of each scope, also of those of WebSockets.
    """

    def __init__(
        self, listener: PageListener, config: uvicorn.Config, server_state: ServerState, app_state: dict[str, Any]
    ) -> None:
        super().__init__(config, server_state, app_state)
        self._listener = listener
        self._number = -1
        self._arrives: asyncio.TimerHandle | None = None
        self._has_head = self._is_upgraded = False
        self._unread: asyncio.TimerHandle | None = None

    def connection_made(self, transport: asyncio.Transport) -> None:
        super().connection_made(transport)
        self._number = transport.get_extra_info("socket").fileno()
        self.app_state: dict[str, Any] = {**self.app_state, CLIENT_CERTIFICATE: _certificate_of(transport)}
        self._await_request(HEAD)

    def connection_lost(self, exc: Exception | None) -> None:
        self._arrives, self._unread = _cancel(self._arrives), _cancel(self._unread)
        super().connection_lost(exc)

    def data_received(self, data: bytes) -> None:
        if self._arrives is None and self.conn.their_state is h11.IDLE:
            self._await_request(HEAD)
        super().data_received(data)
        self._judge()

    def on_response_complete(self) -> None:
        super().on_response_complete()
        self._judge()

    def handle_websocket_upgrade(self, event: h11.Request) -> None:
        self._is_upgraded = True
        self._arrives = _cancel(self._arrives)
        self._listener.set_waiting(self._number, is_waiting=False)
        super().handle_websocket_upgrade(event)

    def timeout_keep_alive_handler(self) -> None:
        super().timeout_keep_alive_handler()
        self._abort_unless_read()

    def pause_writing(self) -> None:
        super().pause_writing()
        self._abort_unless_read()

    def resume_writing(self) -> None:
        super().resume_writing()
        self._unread = _cancel(self._unread)

    def _judge(self) -> None:
        """Limit the time until the request is whole, as far as it has arrived."""
        if self._is_upgraded:
            return
        state = self.conn.their_state
        if state is h11.SEND_BODY:
            if not self._has_head:
                self._has_head = True
                self._await_request(BODY)
            return
        self._has_head = False
        if state is not h11.IDLE:
            self._arrives = _cancel(self._arrives)
        elif self._arrives is None and self.conn.trailing_data[0]:  # the next one has begun to arrive
            self._await_request(HEAD)
        self._listener.set_waiting(self._number, is_waiting=state is h11.IDLE)

    def _await_request(self, seconds: float) -> None:
        _cancel(self._arrives)
        self._arrives = self.loop.call_later(seconds, self.transport.abort)

    def _abort_unless_read(self) -> None:
        if self._unread is None:
            self._unread = self.loop.call_later(UNREAD, self.transport.abort)


class PageHTTPServer(uvicorn.Server):
    """Serves at one socket, and sleeps until it is ended.

    uvicorn's own loop looks ten times a second, and only for what is not used here.
    """

    def __init__(self, config: uvicorn.Config, listener: PageListener) -> None:
        super().__init__(config)
        self._listener = listener
        self._ended = asyncio.Event()

    def end(self) -> None:
        self.should_exit = True
        self._ended.set()

    async def startup(self, sockets: list[socket.socket] | None = None) -> None:
        await self.lifespan.startup()
        config, state = self.config, self.server_state

        def protocol() -> PageProtocol:
            return PageProtocol(self._listener, config, state, self.lifespan.state)

        timeout = HANDSHAKE if config.ssl is not None else None
        make = asyncio.get_running_loop().create_server
        server = await make(
            protocol, sock=self._listener, ssl=config.ssl, backlog=config.backlog, ssl_handshake_timeout=timeout
        )
        self.servers: list[asyncio.base_events.Server] = [server]
        self.started = True

    async def main_loop(self) -> None:
        await self._ended.wait()

    @contextmanager
    def capture_signals(self) -> Generator[None]:
        """Leave signals to the program."""
        yield


def _certificate_of(transport: asyncio.Transport) -> ShownCertificate:
    """The checked certificate of a client."""
    found: ssl.SSLObject | None = transport.get_extra_info("ssl_object")
    binary = None if found is None else found.getpeercert(binary_form=True)
    if found is None or binary is None:
        return NO_CERTIFICATE
    end = (found.getpeercert() or {}).get("notAfter")
    return ShownCertificate(hashlib.sha256(binary).hexdigest(), ssl.cert_time_to_seconds(str(end)))


def _cancel(timer: asyncio.TimerHandle | None) -> None:
    if timer is not None:
        timer.cancel()
