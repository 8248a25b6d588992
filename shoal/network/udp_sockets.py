"""UDP sockets of a console: for packets, and for announcements at a port of discovery."""

import socket
from collections.abc import Callable, Iterable, Sequence

from imc.discovery import LOOPBACK, MULTICAST, Endpoint
from imc.layout import LARGEST_PACKET
from runtime.network_interfaces import EVERYWHERE, enable_icmp_errors, interfaces
from runtime.udp_sockets import bind_udp_socket, join_multicast_group, source_address

AT_ONCE = 256  # datagrams read before the rest of the program comes to its turn
BUFFER = 4 << 20  # bytes


def bound_socket(address: str, port: int) -> socket.socket:
    """A socket at an address of this computer, 0.0.0.0 for all. Raises OSError if the port is taken."""
    one = bind_udp_socket(address, port, BUFFER)
    try:
        enable_icmp_errors(one)
        if address == EVERYWHERE:
            one.setsockopt(socket.SOL_SOCKET, socket.SO_BROADCAST, 1)
            one.setsockopt(socket.IPPROTO_IP, socket.IP_MULTICAST_TTL, 1)
    except OSError:
        one.close()
        raise
    return one


def discovery_socket(address: str, ports: Sequence[int]) -> socket.socket | None:
    """A socket at the first free port of discovery; others of this computer need theirs, too. None if all are taken."""
    for port in ports:
        try:
            one = bound_socket(address, port)
        except OSError:
            continue
        if address == EVERYWHERE:
            join_multicast_group(one, MULTICAST, [interface.address for interface in interfaces()])
        return one
    return None


def waiting_datagrams(one: socket.socket, failed: Callable[[], object]) -> Iterable[tuple[bytes, Endpoint]]:
    """The datagrams that wait at a socket, AT_ONCE at most, and who sent them; `failed` is called after an error."""
    for _ in range(AT_ONCE):
        try:
            packet, sender = one.recvfrom(LARGEST_PACKET)
        except BlockingIOError:
            return
        except OSError:
            failed()
            return
        yield packet, Endpoint(*sender[:2])


def own_address(place: Endpoint) -> str:
    """The address of this computer on the way to a place."""
    return source_address(place.address, place.port or 9) or LOOPBACK
