"""IMC over TCP with one server."""

import errno
import os
import select
import socket

from imc.discovery import LOOPBACK, check_address
from runtime import State, param
from runtime.task import ParameterError
from support.backoff import Backoff
from support.log_limit import Trouble
from tasks.transports.imc_links.sockets import network_silence, network_time, schedule_network_timer
from tasks.transports.imc_links.stream_links import PacketStream, StreamLinkTask

LOOK = 0.05  # s between two looks whether a connection is made
PATIENCE = 5.0  # s for it
FIRST_PAUSE, LONGEST_PAUSE = 1.0, 30.0  # s between two attempts
SILENCE = 10.0  # s without a packet after which a server is silent; IMC programs send Heartbeat every 1 s


class Client(StreamLinkTask):
    """Connects to a server, and exchanges IMC packets with it; connects again, ever more slowly, while that fails."""

    server_address: str = param(
        LOOPBACK, "", "IPv4 address of the server.", name="Server - Address", editable=False, usable=check_address
    )
    server_port: int = param(
        7001, "1", "Port of the server.", name="Server - Port", minimum=1, maximum=65535, editable=False
    )

    def configure(self) -> None:
        try:
            check_address(self.server_address)
        except ValueError as error:
            raise ParameterError("Server - Address", str(error)) from None
        super().configure()

    def start(self) -> None:
        self.pending: socket.socket | None = None
        self.backoff: Backoff = Backoff(FIRST_PAUSE, LONGEST_PAUSE)
        self.trouble: Trouble = Trouble()
        super().start()
        self.schedule_connection(0.0)

    def stop(self) -> None:
        super().stop()
        if self.pending is not None:
            self.pending.close()
            self.pending = None

    def schedule_connection(self, pause: float) -> None:
        schedule_network_timer(self, pause, self.begin_connecting)

    def begin_connecting(self) -> None:
        """Begin to connect, without waiting for it."""
        self.pending = socket.socket(socket.AF_INET, socket.SOCK_STREAM)
        self.pending.setblocking(False)
        failed = self.pending.connect_ex((self.server_address, self.server_port))
        if failed in (0, errno.EINPROGRESS):
            self.check_connected(network_time(self) + PATIENCE)
        else:
            self.retry_later(os.strerror(failed))

    def check_connected(self, deadline: float) -> None:
        """See whether the connection is made."""
        assert self.pending is not None
        if not select.select([], [self.pending], [], 0)[1]:
            if network_time(self) >= deadline:
                self.retry_later(f"no answer for {PATIENCE:g} s")
            else:
                schedule_network_timer(self, LOOK, self.check_connected, deadline)
            return
        if failed := self.pending.getsockopt(socket.SOL_SOCKET, socket.SO_ERROR):
            self.retry_later(os.strerror(failed))
            return
        name = f"{self.server_address}:{self.server_port}"
        opened, self.pending = self.pending, None
        self.trouble.end()
        self.log.info(f"connected with {name}")
        stream = PacketStream(opened, self.server_address, name, network_time(self), self.maximum_rate)
        self.add_stream(stream)
        self.greet(stream)

    def retry_later(self, why: str) -> None:
        """Try again later; the same reason is logged once."""
        if self.pending is not None:
            self.pending.close()
            self.pending = None
        reason = f"not connected with {self.server_address}:{self.server_port}: {why}"
        self.trouble.report(reason, self.log.warning)
        self.schedule_connection(self.backoff.fail())

    def on_closed(self, stream: PacketStream, why: str) -> None:
        if stream.taken:
            self.backoff.reset()
        self.retry_later(why)

    def report(self) -> None:
        """A server that is silent, or sends what is no packet, is reported and kept: it may read all the same."""
        stream = self.streams[0] if self.streams else None
        if stream is None:
            self.set_entity_state(State.FAULT, self.trouble.reason or "connecting")
            return
        if network_silence(self, stream.received_at) < SILENCE:
            self.trouble.end()
            self.set_entity_state(State.NORMAL, self.statistics_text())
            return
        reason = f"{stream.name} has sent no packet for {SILENCE:g} s"
        self.trouble.report(reason, self.log.warning)
        self.set_entity_state(State.FAULT, f"{reason}; {self.statistics_text()}")
