"""The networks of this computer."""

import errno
import socket
import struct
import sys
from collections.abc import Iterator
from contextlib import suppress
from typing import NamedTuple

LOOPBACK, EVERYWHERE = "127.0.0.1", "0.0.0.0"
MOST_REFUSALS = 256
RECEIVE_ERRORS, ERROR_QUEUE = 11, 0x2000  # IP_RECVERR, MSG_ERRQUEUE of Linux: who refused a packet
SIOCGIFADDR, SIOCGIFBRDADDR = 0x8915, 0x8919  # of Linux: an interface's address, and that of all in its network


class Interface(NamedTuple):
    """A network of this computer: its name, the address here, and the one that reaches all in it (may be empty)."""

    name: str
    address: str
    broadcast: str

    @property
    def is_loopback(self) -> bool:
        return is_loopback_address(self.address)


def is_loopback_address(address: str) -> bool:
    """Whether an address is of the loopback interface, which only this computer reaches."""
    return address.startswith("127.")


def is_loopback_host(name: str) -> bool:
    """Whether a name or an address in a place such as tcp/localhost:7447 is this computer."""
    return name in ("localhost", "::1") or is_loopback_address(name)


def interfaces() -> list[Interface]:
    """The interfaces of this computer that have an IPv4 address; on other systems than Linux, only loopback."""
    try:
        from fcntl import ioctl
    except ImportError:
        return [Interface("lo", LOOPBACK, "")]
    found: list[Interface] = []
    with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as any_socket:

        def ask(question: int, name: str) -> str:
            try:
                answer = ioctl(any_socket.fileno(), question, struct.pack("256s", name.encode()[:15]))
            except OSError:
                return ""
            return socket.inet_ntoa(answer[20:24])

        for _, name in socket.if_nameindex():
            if address := ask(SIOCGIFADDR, name):
                broadcast = "" if is_loopback_address(address) else ask(SIOCGIFBRDADDR, name)
                found.append(Interface(name, address, "" if broadcast == EVERYWHERE else broadcast))
    return found or [Interface("lo", LOOPBACK, "")]


def enable_icmp_errors(sender: socket.socket) -> None:
    """Let a UDP socket store which computers reject its packets, where the system can; see `refused_destinations`."""
    with suppress(OSError):
        sender.setsockopt(socket.IPPROTO_IP, RECEIVE_ERRORS, 1)


def refused_destinations(sender: socket.socket) -> Iterator[tuple[str, int]]:
    """The destinations that returned ICMP port unreachable for packets that were sent."""
    for _ in range(MOST_REFUSALS):
        try:
            _, notes, _, place = sender.recvmsg(0, 128, ERROR_QUEUE)
        except OSError:
            return
        if any(data[:4] == errno.ECONNREFUSED.to_bytes(4, sys.byteorder) for _, _, data in notes):
            yield place[:2]
