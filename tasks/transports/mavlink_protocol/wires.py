"""Links by streams of bytes: TCP in both directions, and serial lines."""

import socket
from collections import deque
from collections.abc import Callable

from mavlink import Dialect, StreamSplitter
from runtime.devices import Address, Device, DeviceLog, RawChunks, SerialPort, TcpConnection, TcpServer
from tasks.transports.mavlink_protocol.links import Host, Link, Peer, name_of
from tasks.transports.mavlink_protocol.routes import SERIAL, Route
from tasks.transports.mavlink_protocol.streams import STREAMS

LEAST_ROOM, MOST_ROOM = 2048, 16384  # bytes that may wait; between these, as many as the line carries in a second
SYSTEM_ROOM = 16384  # bytes that the system keeps for a slow peer
FLUSH_PERIOD = 0.02  # s
LONGEST_RUBBISH = 1 << 16  # bytes without a message, after which a connection is ended
AT_ONCE = 8  # connections taken at a time
PAUSE = 0.02  # s after so many


class Quiet:
    """The log book of a connection that a stranger has made: its link tells what is worth telling."""

    def info(self, text: str) -> None: ...
    def warning(self, text: str) -> None: ...
    def error(self, text: str) -> None: ...


class Accepted:
    """A TCP connection that a station has made, in the place of an address that can be opened."""

    starts_midway = datagrams = False
    speed = 1e6
    max_rate = TcpServer.max_rate
    host = ""

    def __init__(self, opened: socket.socket, name: str):
        self.name = name
        self.connection = TcpConnection(opened, waiting=SYSTEM_ROOM)

    def open(self, number: str) -> TcpConnection:
        return self.connection


class Wire:
    """A stream of bytes to and from one peer of a link.

    Frames that it does not take wait, about as many as it carries in a second. Beyond that, the oldest telemetry is
    dropped: newer comes anyway, while an answer does not. `tell` is called with "" when it is open, and with the reason
    when it is not.
    """

    def __init__(
        self,
        link: Link,
        host: Host,
        peer: Peer,
        address: Address,
        tell: Callable[[str], object],
        log: DeviceLog | None = None,
    ):
        self.rubbish = 0  # bytes since the last good message
        self._link, self._host, self._peer = link, host, peer
        self._tell = tell
        self._telemetry = telemetry(host.autopilot.dialect)
        self._splitter = StreamSplitter(host.autopilot.dialect)
        self._passed = -1
        self._queue: deque[bytes] = deque()
        self._size, self._flushing = 0, False
        self._room = min(MOST_ROOM, max(LEAST_ROOM, round(link.route.speed)))
        self._device = Device(host, address, RawChunks(), self._receive, trouble=self._change, log=log)
        self._device.open()

    @property
    def is_open(self) -> bool:
        return self._device.is_open

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

    def look_after(self) -> None:
        """Give up a frame that was not continued since the last call."""
        if self._splitter.waiting and self._splitter.passed == self._passed:
            messages, damages = self._splitter.flush()
            self._link.counts["malformed"] += damages
            self._link.accept(self._peer, messages, self._link.sessions[self._peer].admit)
        self._passed = self._splitter.passed

    def close(self) -> None:
        self._device.close()
        self._queue.clear()
        self._size = 0

    def _change(self, trouble: str) -> None:
        if trouble:
            self._queue.clear()
            self._size = 0
            self._splitter = StreamSplitter(self._host.autopilot.dialect)
        self._tell(trouble)

    def _receive(self, data: bytes) -> None:
        good = self._link.receive(self._peer, data, self._splitter)
        if good is not None:
            self.rubbish = 0 if good else self.rubbish + len(data)

    def _flush(self) -> None:
        self._flushing = False
        while self._queue and not self._device.waiting and self._device.is_open:
            frame = self._queue.popleft()
            self._size -= len(frame)
            self._device.write(frame)
        if self._queue:
            self._flushing = True
            self._host.after(FLUSH_PERIOD, self._flush)


def telemetry(dialect: Dialect) -> frozenset[bytes]:
    """The ids, as in a frame, of the messages that come again by themselves."""
    names = (name for name, stream in STREAMS.items() if stream.rate)
    return frozenset(dialect.by_name[name].id.to_bytes(3, "little") for name in names)


class WireLink(Link):
    """A TCP server that the vehicle connects to, or a serial line."""

    def __init__(self, route: Route, number: int, host: Host):
        super().__init__(route, number, host)
        self._peer: Peer = (route.text,)
        self._wire: Wire | None = None

    def open_here(self) -> None:
        route = self.route
        if route.scheme == SERIAL:
            address = SerialPort(route.host, route.baud)
        else:
            address = TcpServer(route.host, route.port, waiting=SYSTEM_ROOM)
        address.name = route.text
        self._wire = Wire(self, self._host, self._peer, address, self._tell)

    def close(self) -> None:
        self.is_open = False
        if self._wire is not None:
            self._wire.close()

    def reaches(self, peer: Peer) -> bool:
        return self._wire is not None and self._wire.is_open

    def has_room(self) -> bool:
        return True

    def send(self, frame: bytes, peer: Peer) -> None:
        if self._wire is not None:
            self._wire.send(frame)

    def look_after(self) -> None:
        super().look_after()
        if self._wire is not None and self.sessions:
            self._wire.look_after()

    def _tell(self, trouble: str) -> None:
        self.trouble = trouble
        if trouble:
            self.part(self._peer)
        else:
            self.session(self._peer)


class ListenerLink(Link):
    """Takes TCP connections of stations; each is a session until it ends, also if its station only listens."""

    def __init__(self, route: Route, number: int, host: Host):
        super().__init__(route, number, host)
        self._socket: socket.socket | None = None
        self._wires: dict[Peer, tuple[Wire, Accepted]] = {}

    def open_here(self) -> None:
        made = socket.socket(socket.AF_INET6 if ":" in self.route.host else socket.AF_INET, socket.SOCK_STREAM)
        try:
            made.setblocking(False)
            made.setsockopt(socket.SOL_SOCKET, socket.SO_REUSEADDR, 1)  # connections of an earlier run may linger
            if made.family == socket.AF_INET6:
                made.setsockopt(socket.IPPROTO_IPV6, socket.IPV6_V6ONLY, 1)
            made.bind(self.route.address)
            made.listen()
        except OSError:
            made.close()
            raise
        self._socket, self.trouble = made, ""
        self._host.watch(made, self._take_connections)

    def close(self) -> None:
        self.is_open = False
        for peer in list(self._wires):
            self.part(peer)
        if self._socket is not None:
            self._host.unwatch(self._socket)
            self._socket.close()
            self._socket = None

    def send(self, frame: bytes, peer: Peer) -> None:
        if peer in self._wires:
            self._wires[peer][0].send(frame)

    def look_after(self) -> None:
        super().look_after()
        for peer, (wire, _) in list(self._wires.items()):
            if peer in self.sessions:
                wire.look_after()

    def receive(self, peer: Peer, data: bytes, splitter: StreamSplitter | None = None) -> int | None:
        good = super().receive(peer, data, splitter)
        if not good and peer in self._wires and self._wires[peer][0].rubbish > LONGEST_RUBBISH:
            self.counts["cut off"] += 1
            self.name_once(f"rubbish {peer[0]}", f"has ended a connection with {peer[0]}, which sends no MAVLink")
            self.part(peer)
        return good

    def reaches(self, peer: Peer) -> bool:
        return peer in self._wires

    def has_room(self) -> bool:
        return True  # whoever is connected has a place

    def part(self, peer: Peer) -> None:
        super().part(peer)
        wire, address = self._wires.pop(peer, (None, None))
        if wire is not None and address is not None:
            wire.close()
            address.connection.close()

    def _take_connections(self) -> None:
        """Take some connections; if there are more, or none can be taken, go on after a pause."""
        for _ in range(AT_ONCE):
            if self._socket is None:
                return
            try:
                opened, peer = self._socket.accept()
            except BlockingIOError:
                return
            except OSError as error:  # it has gone already, or there are no file descriptors left
                self.counts["not accepted"] += 1
                self.name_once("accept", f"cannot take a connection: {error.strerror}")
                break
            self._meet(opened, peer)
        if self._socket is not None:
            self._host.unwatch(self._socket)
            self._host.after(PAUSE * self._host.speed, self._go_on)

    def _go_on(self) -> None:
        if self._socket is not None:
            self._host.watch(self._socket, self._take_connections)

    def _meet(self, opened: socket.socket, peer: Peer) -> None:
        full = len(self._wires) >= self._host.maximum_peers
        if full and not (self.sessions and self.make_room()):
            opened.close()
            self.refuse(peer)
            return
        try:
            address = Accepted(opened, name_of(peer))
        except OSError:
            opened.close()
            return
        wire = Wire(self, self._host, peer, address, lambda trouble: self._tell(peer, trouble), Quiet())
        self._wires[peer] = wire, address

    def _tell(self, peer: Peer, trouble: str) -> None:
        if trouble:
            self.part(peer)
        else:
            self.session(peer)
