"""Links by UDP: the vehicle waits for ground stations, calls one, or calls all of a network."""

import socket

from mavlink import LONGEST_DATAGRAM, LinkUrl
from mavlink.vehicle import Session
from runtime.devices import resolve_host
from tasks.transports.mavlink_links.base_link import Link, LinkHost, Peer

AT_ONCE = 32
LOOK_UP_PERIOD = 5.0  # s between two attempts to find the address of a name
AGAIN_PERIOD = 30.0  # s after which the address of a station that does not answer is looked up again


class UdpLink(Link):
    """A UDP socket: udpin, udpout or udpbcast.

    udpbcast calls a whole network until a station answers, and then only those that have; with the last one it begins
    to call again.
    """

    def __init__(self, url: LinkUrl, number: int, host: LinkHost):
        super().__init__(url, number, host)
        self._socket: socket.socket | None = None
        self._called: Peer | None = None  # stations that the vehicle calls
        self._looking, self._look_due = False, 0.0

    def _open(self) -> None:
        if not self.url.has_hostname:
            self._open_at(self.url.host)

    def close(self) -> None:
        self.is_open = False
        if self._socket is not None:
            self._host.unwatch(self._socket)
            self._socket.close()
            self._socket = None

    def maintain_link(self) -> None:
        super().maintain_link()
        silent = not any(session.contact for session in self.sessions.values())
        if self.url.has_hostname and silent and not self._looking and self._host.now >= self._look_due:
            self._looking = True
            self._host.offload(resolve_host, self.url.host, then=self._found)

    def send(self, frame: bytes, peer: Peer) -> None:
        if self._socket is None:
            return
        try:
            if self.url.scheme == "udpout":
                self._socket.send(frame)
            else:
                self._socket.sendto(frame, peer)
        except ConnectionRefusedError:
            pass  # no ground station yet
        except OSError:
            self.counts["unsent"] += 1

    def has_session_capacity(self) -> bool:
        return len(self.sessions) - (self._called in self.sessions) < self._host.maximum_peers

    def keeps_session(self, peer: Peer) -> bool:
        return peer == self._called

    def open_session(self, peer: Peer) -> Session | None:
        found = super().open_session(peer)
        if found is not None and self.url.scheme == "udpbcast" and peer != self._called and self._called is not None:
            self.end_session(self._called)  # its sequence numbers would mix with those of the station's own session
        return found

    def forget_silent(self, timeout: float) -> None:
        super().forget_silent(timeout)
        if self._called is not None and not self.sessions:
            self.open_session(self._called)

    def _open_at(self, host: str) -> None:
        """Open the socket. Raises OSError."""
        made = socket.socket(socket.AF_INET6 if ":" in host else socket.AF_INET, socket.SOCK_DGRAM)
        place = (host, self.url.port)
        try:
            made.setblocking(False)
            if self.url.scheme == "udpin":
                if made.family == socket.AF_INET6:
                    made.setsockopt(socket.IPPROTO_IPV6, socket.IPV6_V6ONLY, 1)
                self.listen(lambda port: made.bind((host, port)))
            elif self.url.scheme == "udpout":
                made.connect(place)
                self._called = made.getpeername()
            else:
                made.setsockopt(socket.SOL_SOCKET, socket.SO_BROADCAST, 1)
                made.bind(("", 0))
                self._called = place
        except OSError:
            made.close()
            raise
        self._socket = made
        self.trouble.end()
        self._host.watch(made, self._read)
        if self._called is not None:
            self.open_session(self._called)

    def _found(self, address: str | OSError) -> None:
        """Call the address of a name, which may have changed."""
        self._looking = False
        self._look_due = self._host.now + AGAIN_PERIOD * self._host.clock_speed
        try:
            if isinstance(address, OSError):
                raise address
            if self._socket is None or self._called is None or self._called[0] != address:
                self.close()
                if self._called is not None:
                    self.end_session(self._called)
                self._open_at(address)
                self.is_open: bool = True
        except OSError as error:
            self._look_due = self._host.now + LOOK_UP_PERIOD * self._host.clock_speed
            if self._socket is None:
                self.log_failure(error)

    def _read(self) -> None:
        """Take what has arrived, AT_ONCE datagrams at most."""
        for _ in range(AT_ONCE):
            if self._socket is None:
                return
            try:
                data, source = self._socket.recvfrom(LONGEST_DATAGRAM)
            except BlockingIOError:
                return
            except OSError:
                continue  # an earlier frame was refused: nothing listens there
            self.receive(source, data)
