"""Links by streams of bytes: TCP in both directions, and serial lines."""

import socket
from collections import deque
from collections.abc import Callable

from mavlink import SERIAL, Dialect, LinkUrl, StreamSplitter
from mavlink.vehicle.telemetry import STREAMS
from runtime.devices import Address, Device, DeviceLog, RawChunks, SerialPort, TcpConnection, TcpServerAddress
from tasks.transports.mavlink_links.base_link import Link, LinkHost, Peer, peer_name

LEAST_ROOM, MOST_ROOM = 2048, 16384  # bytes that may wait; between these, as many as the line carries in a second
SYSTEM_ROOM = 16384  # bytes that the system keeps for a slow peer
FLUSH_PERIOD = 0.02  # s
LONGEST_RUBBISH = 1 << 16  # bytes without a message, after which a connection is ended
AT_ONCE = 8  # connections taken at a time
PAUSE = 0.02  # s after so many


class NullLog:
    """The log book of a connection that an unknown peer has made: its link reports what matters."""

    def info(self, text: str) -> None: ...
    def warning(self, text: str) -> None: ...
    def error(self, text: str) -> None: ...


class ClientAddress:
    """A TCP connection that a station has made, in the place of an address that can be opened."""

    starts_midway = datagrams = False
    bytes_per_second: float = 1e6
    max_read_rate: float = TcpServerAddress.max_read_rate
    unresolved_host = ""

    def __init__(self, opened: socket.socket, name: str):
        self.name = name
        self.connection: TcpConnection = TcpConnection(opened, waiting=SYSTEM_ROOM)

    def open(self, number: str) -> TcpConnection:
        return self.connection


class StreamConnection:
    """A stream of bytes to and from one peer of a link.

    Frames that it does not take wait, about as many as it carries in a second. Beyond that, the oldest telemetry is
    dropped: newer comes anyway, while an answer does not. `on_change` is called with "" when it is open, and with the
    reason when it is not.
    """

    def __init__(
        self,
        link: Link,
        host: LinkHost,
        peer: Peer,
        address: Address,
        on_change: Callable[[str], object],
        log: DeviceLog | None = None,
    ):
        self.rubbish = 0  # bytes since the last good message
        self._link, self._host, self._peer = link, host, peer
        self._on_change = on_change
        self._telemetry = telemetry_message_ids(host.endpoint.dialect)
        self._splitter = StreamSplitter(host.endpoint.dialect)
        self._arrived = -1  # bytes, at the last look for an incomplete frame
        self._queue: deque[bytes] = deque()
        self._size, self._flushing = 0, False
        self._room = min(MOST_ROOM, max(LEAST_ROOM, round(link.url.bytes_per_second)))
        self._device = Device(host, address, RawChunks(), self._receive, trouble=self._change, log=log)
        self._device.open()

    @property
    def is_open(self) -> bool:
        return self._device.is_open

    @property
    def takes_more(self) -> bool:
        """Whether nothing waits."""
        return not self._flushing

    def send(self, frame: bytes) -> None:
        if not self._device.is_open:
            return
        self._queue.append(frame)
        self._size += len(frame)
        if not self._flushing:
            self._flush()
        while self._size > self._room:
            old = next((i for i, each in enumerate(self._queue) if each[7:10] in self._telemetry), 0)
            self._size -= len(self._queue[old])
            del self._queue[old]
            self._link.counts["unsent"] += 1

    def expire_incomplete_frame(self) -> None:
        """Give up a frame that was not continued since the last call."""
        arrived = self._splitter.passed + self._splitter.bytes_waiting
        if self._splitter.bytes_waiting and arrived == self._arrived:
            messages, damages = self._splitter.take_remaining_messages()
            self._link.counts["malformed"] += damages
            self._link.handle_messages(self._peer, messages, self._link.sessions[self._peer].bucket)
        self._arrived = arrived

    def close(self) -> None:
        self._device.close()
        self._queue.clear()
        self._size = 0

    def _change(self, trouble: str) -> None:
        if trouble:
            self._queue.clear()
            self._size = 0
            self._splitter = StreamSplitter(self._host.endpoint.dialect)
        self._on_change(trouble)

    def _receive(self, data: bytes) -> None:
        good = self._link.receive(self._peer, data, self._splitter)
        if good is not None:
            self.rubbish: int = 0 if good else self.rubbish + len(data)

    def _flush(self) -> None:
        self._flushing = False
        while self._queue and not self._device.unsent_bytes and self._device.is_open:
            frame = self._queue.popleft()
            self._size -= len(frame)
            self._device.write(frame)
        if self._queue:
            self._flushing = True
            self._host.after(FLUSH_PERIOD, self._flush)


def telemetry_message_ids(dialect: Dialect) -> frozenset[bytes]:
    """The ids, as in a frame, of the messages that come again by themselves."""
    names = (name for name, stream in STREAMS.items() if stream.rate)
    return frozenset(dialect.by_name[name].id.to_bytes(3, "little") for name in names)


class StreamLink(Link):
    """A TCP server that the vehicle connects to, or a serial line."""

    def __init__(self, url: LinkUrl, number: int, host: LinkHost):
        super().__init__(url, number, host)
        self._peer: Peer = (url.text,)
        self._connection: StreamConnection | None = None

    def _open(self) -> None:
        url = self.url
        if url.scheme == SERIAL:
            address = SerialPort(url.host, url.baud)
        else:
            address = TcpServerAddress(url.host, url.port, waiting=SYSTEM_ROOM)
        address.name = url.text
        self._connection = StreamConnection(self, self._host, self._peer, address, self._on_change)

    def close(self) -> None:
        self.is_open = False
        if self._connection is not None:
            self._connection.close()

    def reaches(self, peer: Peer) -> bool:
        return self._connection is not None and self._connection.is_open

    def takes_more(self, peer: Peer) -> bool:
        return self._connection is not None and self._connection.takes_more

    def has_session_capacity(self) -> bool:
        return True

    def send(self, frame: bytes, peer: Peer) -> None:
        if self._connection is not None:
            self._connection.send(frame)

    def maintain_link(self) -> None:
        super().maintain_link()
        if self._connection is not None and self.sessions:
            self._connection.expire_incomplete_frame()

    def _on_change(self, trouble: str) -> None:
        self.trouble.reason = trouble
        if trouble:
            self.end_session(self._peer)
        else:
            self.open_session(self._peer)


class TcpListenerLink(Link):
    """Takes TCP connections of stations; each is a session until it ends, also if its station only listens."""

    def __init__(self, url: LinkUrl, number: int, host: LinkHost):
        super().__init__(url, number, host)
        self._socket: socket.socket | None = None
        self._connections: dict[Peer, tuple[StreamConnection, ClientAddress]] = {}

    def _open(self) -> None:
        made = socket.socket(socket.AF_INET6 if ":" in self.url.host else socket.AF_INET, socket.SOCK_STREAM)
        try:
            made.setblocking(False)
            made.setsockopt(socket.SOL_SOCKET, socket.SO_REUSEADDR, 1)  # connections of an earlier run may linger
            if made.family == socket.AF_INET6:
                made.setsockopt(socket.IPPROTO_IPV6, socket.IPV6_V6ONLY, 1)
            self.listen(lambda port: made.bind((self.url.host, port)))
            made.listen()
        except OSError:
            made.close()
            raise
        self._socket = made
        self.trouble.end()
        self._host.watch(made, self._take_connections)

    def close(self) -> None:
        self.is_open = False
        for peer in list(self._connections):
            self.end_session(peer)
        if self._socket is not None:
            self._host.unwatch(self._socket)
            self._socket.close()
            self._socket = None

    def send(self, frame: bytes, peer: Peer) -> None:
        if peer in self._connections:
            self._connections[peer][0].send(frame)

    def maintain_link(self) -> None:
        super().maintain_link()
        for peer, (wire, _) in list(self._connections.items()):
            if peer in self.sessions:
                wire.expire_incomplete_frame()

    def receive(self, peer: Peer, data: bytes, splitter: StreamSplitter | None = None) -> int | None:
        good = super().receive(peer, data, splitter)
        if not good and peer in self._connections and self._connections[peer][0].rubbish > LONGEST_RUBBISH:
            self.counts["cut off"] += 1
            self.warn_once(f"rubbish {peer[0]}", f"has ended a connection with {peer[0]}, which sends no MAVLink")
            self.end_session(peer)
        return good

    def reaches(self, peer: Peer) -> bool:
        return peer in self._connections

    def takes_more(self, peer: Peer) -> bool:
        return peer in self._connections and self._connections[peer][0].takes_more

    def has_session_capacity(self) -> bool:
        return True  # connected peers keep their place

    def end_session(self, peer: Peer) -> None:
        super().end_session(peer)
        wire, address = self._connections.pop(peer, (None, None))
        if wire is not None and address is not None:
            wire.close()
            address.connection.close()

    def _take_connections(self) -> None:
        """Take some connections; if there are more, or none can be taken, continue after a pause."""
        for _ in range(AT_ONCE):
            if self._socket is None:
                return
            try:
                opened, peer = self._socket.accept()
            except BlockingIOError:
                return
            except OSError as error:  # it has gone already, or there are no file descriptors left
                self.counts["not accepted"] += 1
                self.warn_once("accept", f"cannot take a connection: {error.strerror}")
                break
            self._accept(opened, peer)
        if self._socket is not None:
            self._host.unwatch(self._socket)
            self._host.after(PAUSE * self._host.clock_speed, self._resume)

    def _resume(self) -> None:
        if self._socket is not None:
            self._host.watch(self._socket, self._take_connections)

    def _accept(self, opened: socket.socket, peer: Peer) -> None:
        full = len(self._connections) >= self._host.maximum_peers
        if full and not (self.sessions and self.make_room()):
            opened.close()
            self.reject(peer)
            return
        try:
            address = ClientAddress(opened, peer_name(peer))
        except OSError:
            opened.close()
            return
        wire = StreamConnection(
            self, self._host, peer, address, lambda trouble: self._on_change(peer, trouble), NullLog()
        )
        self._connections[peer] = wire, address

    def _on_change(self, peer: Peer, trouble: str) -> None:
        if trouble:
            self.end_session(peer)
        else:
            self.open_session(peer)
