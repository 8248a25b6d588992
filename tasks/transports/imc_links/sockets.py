"""UDP sockets for packets and announcements, and the addresses of this computer."""

import socket
from collections.abc import Callable
from ipaddress import IPv4Address
from typing import Any

from imc.discovery import BROADCAST, LOOPBACK, MULTICAST, check_address
from runtime import Task, param
from runtime.kernel import Timer, real_time_scale
from runtime.network_interfaces import EVERYWHERE, interfaces, is_loopback_address
from runtime.task import ParameterError
from runtime.udp_sockets import bind_udp_socket, join_multicast_group
from support.terminal_text import quoted

BUFFER = 1 << 20  # bytes that the system may keep for us
HOPS = 1  # of multicast packets, as in DUNE
IP_MULTICAST_ALL = 49  # of Linux: 0 gives a socket only the groups that it has joined itself


def listen_address_param() -> Any:
    """The parameter Address of a task that listens, for `listen_address`."""
    text = "Address to listen at; empty means [General] Network Address: 127.0.0.1 is this computer only."
    return param("", "", text, editable=False)


def listen_address(task: Task, own: str) -> str:
    """The address where a task listens: its own Address, or if that is empty the profile's [General] Network Address.

    Raises ParameterError if it is not an IPv4 address.
    """
    address = own.strip() or task.vehicle.profile.value("General", "Network Address", LOOPBACK).strip()
    try:
        check_address(address)
    except ValueError as error:
        raise ParameterError("Address" if own.strip() else "Network Address", str(error)) from None
    return address


def network_time_scale(task: Task) -> float:
    """Seconds of a vehicle in one second of other systems."""
    return real_time_scale(task.vehicle.kernel.clock)


def network_time(task: Task) -> float:
    """Seconds as they pass for other systems: on a scaled clock the vehicle's own pass faster."""
    return task.now / network_time_scale(task)


def network_silence(task: Task, since: float) -> float:
    """Seconds since a `network_time` in which other systems could be received: stalls of the process do not count."""
    scale = network_time_scale(task)
    return task.age(since * scale) / scale


def schedule_network_timer(task: Task, seconds: float, function: Callable[..., object], *args: Any) -> Timer:
    """Call a function after so many seconds of other systems."""
    return task.after(seconds * network_time_scale(task), function, *args)


def check_multicast_address(text: str) -> None:
    """Raises ParameterError if the Multicast Address of a task is not a group of IPv4."""
    try:
        valid = IPv4Address(text).is_multicast
    except ValueError:
        valid = False
    if not valid:
        raise ParameterError("Multicast Address", f"{quoted(text)} is not a multicast address of IPv4")


def send_packet(sender: socket.socket, packet: bytes, place: tuple[str, int]) -> None:
    """Send a packet. Raises OSError."""
    try:
        sender.sendto(packet, place)
    except OSError:  # maybe of an earlier packet that was refused; then this one was not sent
        sender.sendto(packet, place)


def open_announce_receivers(address: str, port: int, group: str = MULTICAST) -> list[socket.socket]:
    """Sockets that take announcements: sent to `address`, the group, and, unless it is of loopback, to all.

    At an address of one interface, those from other interfaces are not taken, but those of this computer are.
    Raises OSError if the port is taken; a group that cannot be joined is left out.
    """
    places = [address] if address == EVERYWHERE else list(dict.fromkeys((address, LOOPBACK)))
    opened: list[socket.socket] = []
    try:
        opened.extend(bind_udp_socket(place, port, BUFFER) for place in places)
        if address == EVERYWHERE:
            join_multicast_group(opened[0], group, [interface.address for interface in interfaces()])
        else:
            for place in (group, *(() if is_loopback_address(address) else (BROADCAST,))):
                try:
                    opened.append(bind_udp_socket(place, port, BUFFER))
                except OSError:
                    continue  # no such network here
            for further in opened[len(places) : len(places) + 1]:
                further.setsockopt(socket.IPPROTO_IP, IP_MULTICAST_ALL, 0)
                join_multicast_group(further, group, places)
    except OSError:
        for each in opened:
            each.close()
        raise
    return opened


def open_announce_sender(address: str = "") -> socket.socket:
    """A socket that sends announcements, to a group by the interface that has this address.

    What it sends to a group does not come back to this computer, which gets announcements at its own addresses.
    """
    opened = socket.socket(socket.AF_INET, socket.SOCK_DGRAM)
    opened.setblocking(False)
    opened.setsockopt(socket.SOL_SOCKET, socket.SO_BROADCAST, 1)
    opened.setsockopt(socket.IPPROTO_IP, socket.IP_MULTICAST_LOOP, 0)
    opened.setsockopt(socket.IPPROTO_IP, socket.IP_MULTICAST_TTL, HOPS)
    if address:
        opened.setsockopt(socket.IPPROTO_IP, socket.IP_MULTICAST_IF, socket.inet_aton(address))
    return opened
