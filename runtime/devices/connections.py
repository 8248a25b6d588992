"""Connections that a driver can open: a serial port, a TCP server, a UDP socket. Opening never waits."""

import errno
import os
import socket
from contextlib import suppress
from typing import Any, Protocol

from imc.discovery import is_ip_address
from runtime.udp_sockets import bind_udp_socket

MOST_AT_ONCE = 4096  # bytes that are read before other handlers have their turn
MOST_DATAGRAMS = 64
LARGEST_DATAGRAM = 65535
SLOWEST_CAP = 1 << 16  # bytes/s
SOCKET_CAP = 1 << 22  # bytes/s
KEEPALIVE = {"TCP_KEEPIDLE": 5, "TCP_KEEPINTVL": 2, "TCP_KEEPCNT": 3, "TCP_USER_TIMEOUT": 11_000}
"""s, s, probes, ms: a peer that has vanished is noticed in 11 s, also while it owes an answer to what was sent."""
IN_PROGRESS = (errno.EINPROGRESS, errno.EWOULDBLOCK, errno.EALREADY)
HINTS = {
    errno.EACCES: "permission denied: is the user in the group of the device, such as dialout?",
    errno.EAGAIN: "another program has it open",
    errno.ENOTTY: "is not a serial port",
}


class Connection(Protocol):
    """A device that is open. Methods raise OSError if it is no longer there; none of them waits."""

    def fileno(self) -> int: ...

    def is_connected(self) -> bool:
        """Whether the connection is made."""
        ...

    def read(self) -> list[bytes]:
        """The bytes that have arrived, at most some kB."""
        ...

    def write(self, data: bytes) -> int:
        """Send; returns how many bytes were accepted."""
        ...

    def close(self) -> None: ...


class Address(Protocol):
    """An address that can be opened.

    `bytes_per_second` is that of the line, `max_read_rate` what is read at most (both in bytes/s). `starts_midway`
    is whether the first bytes may belong to a piece that began before. `datagrams` is whether each portion is complete.
    """

    @property
    def name(self) -> str: ...
    @property
    def bytes_per_second(self) -> float: ...
    @property
    def max_read_rate(self) -> float: ...
    @property
    def starts_midway(self) -> bool: ...
    @property
    def datagrams(self) -> bool: ...
    @property
    def unresolved_host(self) -> str:
        """The host name to look up before it is opened; empty if there is none."""
        ...

    def open(self, number: str) -> Connection:
        """Open it; `number` is the numeric address of `host`. Raises OSError."""
        ...


class SerialPort:
    """A serial port by its device file, such as /dev/ttyUSB0."""

    starts_midway = True
    datagrams = False

    def __init__(self, device: str, baud: int, **settings: Any):
        self.name: str = device or "serial port"
        self._device = device
        self.bytes_per_second: float = baud / 10.0  # a byte has a start and a stop bit
        self.max_read_rate: float = max(
            SLOWEST_CAP, 2.0 * self.bytes_per_second
        )  # ports over USB may be faster than their baud rate
        self._baud = baud
        self._settings = settings

    @property
    def unresolved_host(self) -> str:
        return ""

    def open(self, number: str) -> "SerialConnection":
        if not self._device:
            raise OSError("its device is not set")
        try:
            import serial
        except ModuleNotFoundError:
            raise OSError("a serial port needs pip install 'shoal[drivers]'") from None
        try:
            port = serial.Serial(self._device, self._baud, timeout=0, write_timeout=0, exclusive=True, **self._settings)
        except (OSError, ValueError) as error:
            raise user_friendly_error(error) from None
        except Exception as error:  # termios.error is no OSError
            raise OSError(*error.args) from None
        return SerialConnection(port)


class SerialConnection:
    """An open serial port."""

    def __init__(self, port: Any):
        self._port = port

    def fileno(self) -> int:
        return self._port.fileno()

    def is_connected(self) -> bool:
        return True

    def read(self) -> list[bytes]:
        try:
            return [data] if (data := self._port.read(MOST_AT_ONCE)) else []
        except OSError as error:  # pyserial's errors, too, which a port that has gone raises in several ways
            raise OSError(errno.ENODEV, "unplugged") from error

    def write(self, data: bytes) -> int:
        try:
            return os.write(self._port.fileno(), data)  # pyserial's own write never returns while the line is full
        except BlockingIOError:
            return 0
        except OSError as error:
            raise OSError(errno.ENODEV, "unplugged") from error

    def close(self) -> None:
        with suppress(OSError):
            self._port.close()


class TcpServerAddress:
    """A TCP server to connect to, such as a converter of serial ports, which passes on lines that have begun before."""

    starts_midway = True
    datagrams = False
    bytes_per_second: float = 1e6
    max_read_rate = SOCKET_CAP

    def __init__(self, host: str, port: int, *, waiting: int = 0):
        self.name: str = f"tcp://{host}:{port}"
        self._host = "127.0.0.1" if host == "localhost" else host
        self._port = port
        self._waiting = waiting

    @property
    def unresolved_host(self) -> str:
        return "" if is_ip_address(self._host) else self._host

    def open(self, number: str) -> "TcpConnection":
        host = number or self._host
        if not 0 < self._port < 65536:
            raise OSError("its port is not a number from 1 to 65535")
        made = socket.socket(socket.AF_INET6 if ":" in host else socket.AF_INET, socket.SOCK_STREAM)
        try:
            connection = TcpConnection(made, waiting=self._waiting)
            code = made.connect_ex((host, self._port))
            if code and code not in IN_PROGRESS:
                raise OSError(code, os.strerror(code))
        except (OSError, ValueError, OverflowError) as error:
            made.close()
            raise user_friendly_error(error) from None
        return connection


class TcpConnection:
    """A TCP connection, perhaps still being made. The system keeps `waiting` bytes for a slow peer; 0: many."""

    def __init__(self, opened: socket.socket, *, waiting: int = 0):
        self._socket = opened
        self._ready = False
        opened.setblocking(False)
        opened.setsockopt(socket.SOL_SOCKET, socket.SO_KEEPALIVE, 1)
        for name, value in KEEPALIVE.items():
            if hasattr(socket, name):
                opened.setsockopt(socket.IPPROTO_TCP, getattr(socket, name), value)
        opened.setsockopt(socket.IPPROTO_TCP, socket.TCP_NODELAY, 1)
        if waiting:
            opened.setsockopt(socket.SOL_SOCKET, socket.SO_SNDBUF, waiting)

    def fileno(self) -> int:
        return self._socket.fileno()

    def is_connected(self) -> bool:
        if not self._ready:
            if code := self._socket.getsockopt(socket.SOL_SOCKET, socket.SO_ERROR):
                raise OSError(code, os.strerror(code))
            with suppress(OSError):
                self._socket.getpeername()
                self._ready = True
        return self._ready

    def read(self) -> list[bytes]:
        try:
            data = self._socket.recv(MOST_AT_ONCE)
        except BlockingIOError:
            return []
        if not data:
            raise ConnectionError("the other side has closed the connection")
        return [data]

    def write(self, data: bytes) -> int:
        try:
            return self._socket.send(data)
        except BlockingIOError:
            return 0

    def close(self) -> None:
        self._socket.close()


class Datagram(bytes):
    """A datagram, and the host and port that it came from."""

    source: tuple[str, int] | None = None


class UdpSocket:
    """A UDP socket that receives at a port; if `to` is set, it sends to and receives from this host and port only."""

    starts_midway = False
    datagrams = True
    bytes_per_second: float = 1e6
    max_read_rate = SOCKET_CAP

    def __init__(self, port: int, address: str, to: tuple[str, int] | None):
        self.name: str = f"udp://{address}:{port}"
        self._own = address, port
        self._to = ("127.0.0.1", to[1]) if to is not None and to[0] == "localhost" else to

    @property
    def unresolved_host(self) -> str:
        return "" if self._to is None or is_ip_address(self._to[0]) else self._to[0]

    def open(self, number: str) -> "UdpConnection":
        try:
            made = bind_udp_socket(*self._own)
        except (OSError, ValueError, OverflowError) as error:
            raise user_friendly_error(error) from None
        return UdpConnection(made, (number or self._to[0], self._to[1]) if self._to is not None else None)


class UdpConnection:
    """An open UDP socket. Without a destination it answers the last sender, or that of `set_destination`."""

    def __init__(self, opened: socket.socket, to: tuple[str, int] | None):
        self._socket = opened
        self._fixed = to is not None
        self._chosen = False
        self._to = to

    def fileno(self) -> int:
        return self._socket.fileno()

    def is_connected(self) -> bool:
        return True

    def read(self) -> list[bytes]:
        found: list[bytes] = []
        for _ in range(MOST_DATAGRAMS):
            try:
                data, sender = self._socket.recvfrom(LARGEST_DATAGRAM)
            except BlockingIOError:
                break
            except ConnectionRefusedError:  # an answer to something that was sent
                continue
            if self._fixed and self._to is not None and sender[0] != self._to[0]:
                continue
            if not (self._fixed or self._chosen):
                self._to = sender[:2]
            datagram = Datagram(data)
            datagram.source = sender[:2]
            found.append(datagram)
        return found

    def set_destination(self, sender: tuple[str, int]) -> None:
        """Send only to this one from now on."""
        if not self._fixed:
            self._to, self._chosen = sender, True

    def write(self, data: bytes) -> int:
        if self._to is not None:
            with suppress(BlockingIOError, ConnectionRefusedError):
                self._socket.sendto(data, self._to)
        return len(data)

    def close(self) -> None:
        self._socket.close()


def user_friendly_error(error: Exception) -> OSError:
    """An error of opening, with a text for people instead of a library's."""
    number = error.errno if isinstance(error, OSError) else None
    within = error.__context__  # pyserial puts the error of the system into words
    if number is None and within is not None and within.args and isinstance(within.args[0], int):
        number = within.args[0]
    if number is None:
        return OSError(str(error))
    return OSError(number, HINTS.get(number, os.strerror(number)))


def without_errno(error: OSError) -> str:
    """The text of an error, without its number."""
    return error.strerror or str(error)


def resolve_host(host: str) -> str | OSError:
    """The numeric address of a host name, which may take long; or why there is none."""
    try:
        return str(socket.getaddrinfo(host, None, type=socket.SOCK_STREAM)[0][4][0])
    except OSError as error:
        return OSError(f"{host}: {error.strerror or error}")
