"""Opens UDP sockets."""

import socket
from collections.abc import Iterable
from contextlib import suppress


def bind_udp_socket(address: str, port: int, buffer: int | None = None) -> socket.socket:
    """A non-blocking UDP socket, not shared, at an address of this computer. Raises OSError if it is taken.

    buffer: bytes that the system may keep for us; else its default.
    """
    opened = socket.socket(socket.AF_INET6 if ":" in address else socket.AF_INET, socket.SOCK_DGRAM)
    try:
        opened.setblocking(False)
        if buffer is not None:
            with suppress(OSError):
                opened.setsockopt(socket.SOL_SOCKET, socket.SO_RCVBUF, buffer)
        opened.bind((address, port))
    except (OSError, ValueError, OverflowError):
        opened.close()
        raise
    return opened


def join_multicast_group(receiver: socket.socket, group: str, addresses: Iterable[str]) -> None:
    """Join a group on the interfaces that have these addresses; one that cannot is left out."""
    for address in addresses:
        with suppress(OSError):
            wish = socket.inet_aton(group) + socket.inet_aton(address)
            receiver.setsockopt(socket.IPPROTO_IP, socket.IP_ADD_MEMBERSHIP, wish)


def source_address(address: str, port: int) -> str:
    """The address of this computer on the way to another one; empty if no way leads there. Nothing is sent."""
    with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as probe, suppress(OSError):
        probe.setsockopt(socket.SOL_SOCKET, socket.SO_BROADCAST, 1)
        probe.connect((address, port))
        return probe.getsockname()[0]
    return ""
