"""Discovery of IMC systems: addresses of an Announce, and the services in it, as values.

A service is a URI. `imc+udp://10.0.0.7:6002/` is where a system takes packets; its slash at the end is required, since
imcjava looks for it. `dune://0.0.0.0/uid/N` names one run of a system: another N means that it has started again.
"""

import re
from collections.abc import Iterable, Mapping
from dataclasses import dataclass
from ipaddress import IPv4Address, ip_address
from typing import NamedTuple, Self

from support.terminal_text import quoted
from support.text_length import clip

MULTICAST = "224.0.75.69"
BROADCAST = "255.255.255.255"
LOOPBACK = "127.0.0.1"
PORTS = range(30100, 30105)
"""A system listens on the first of these that is free, so that several share a computer; announce to all of them."""
PERIOD = 10.0
"""s between two Announces."""
VEHICLE_TYPES = frozenset({2, 3, 4, 5})
"""SystemType in Announce: UUV, USV, UAV and UGV."""

MOST_SERVICES = 64
LONGEST_SERVICE = 512  # characters
LONGEST_NAME = 64
MOST_MESSAGES = 30  # in one service

_URI = re.compile(r"([A-Za-z][A-Za-z0-9+.-]{0,31})://([^/:;?#\s]*)(?::([0-9]{1,5}))?((?:/[!-:<-~]*)?)", re.ASCII)


class Endpoint(NamedTuple):
    """Destination: an IPv4 address and a port."""

    address: str
    port: int

    def __str__(self) -> str:
        return f"{self.address}:{self.port}"


class Service(NamedTuple):
    """One service: `scheme://address:port/path`; `port` is 0 without one, and `path` begins with its slash."""

    scheme: str
    address: str
    port: int = 0
    path: str = "/"

    def __str__(self) -> str:
        return f"{self.scheme}://{self.address}{f':{self.port}' if self.port else ''}{self.path}"

    @classmethod
    def parse(cls, uri: str) -> Self:
        """The service in a URI. Raises ValueError if it is not one."""
        found = _URI.fullmatch(uri) if len(uri) <= LONGEST_SERVICE else None
        if found is None:
            raise ValueError(f"{uri[:80]!a} is not a service such as imc+udp://10.0.0.7:6002/")
        scheme, address, port, path = found.groups()
        if port is not None and not 0 < int(port) < 65536:
            raise ValueError(f"{uri[:80]!a}: {port} is not a port (1 to 65535)")
        return cls(scheme.lower(), address, int(port or 0), path or "/")

    @property
    def endpoint(self) -> Endpoint | None:
        """Destination of the service; None without a port or the address of one computer.

        An Announce can contain anything, so no address that reaches several computers is an endpoint.
        """
        try:
            address = IPv4Address(self.address)
        except ValueError:
            return None
        of_one = not (address.is_multicast or address.is_unspecified or address.is_reserved)
        return Endpoint(self.address, self.port) if self.port and of_one else None


MESSAGES = Service("shoal+info", "0.0.0.0", 0, "/messages/")
CONSOLE = "/console/"
"""Path, before the name of a network, of the only service of a console that takes packets where they come from."""


def message_services(signatures: Mapping[int, str]) -> tuple[Service, ...]:
    """The service that lists the own messages of a system, by id; none if they are too many for one."""
    items = ",".join(f"{number}-{text}" for number, text in sorted(signatures.items()))
    return (MESSAGES._replace(path=MESSAGES.path + items),) if len(signatures) <= MOST_MESSAGES else ()


@dataclass(frozen=True, slots=True)
class Services:
    """The services of one Announce. `refused` is how many URIs in it could not be read, or were too many."""

    each: tuple[Service, ...] = ()
    refused: int = 0

    @classmethod
    def parse(cls, text: str) -> Self:
        """The services in the text of an Announce; malformed text gives none. Never raises."""
        uris = [uri for uri in text.split(";", 4 * MOST_SERVICES) if uri.strip()]
        each: list[Service] = []
        for uri in uris[:MOST_SERVICES]:
            try:
                each.append(Service.parse(uri.strip()))
            except ValueError:
                pass  # counted below
        return cls(tuple(each), len(uris) - len(each))

    @classmethod
    def from_system_info(
        cls, offered: Iterable[Service] = (), *, uid: str | int = "", version: str = "", imc: str = ""
    ) -> Self:
        """Make the announcement of a system: its services, its `uid`, its version, and the version of its messages."""
        about = {"uid": ("dune", f"/uid/{uid}"), "version": ("dune", f"/version/{version}")}
        about["imc"] = ("imc+info", f"/version/{imc}")
        given = {"uid": uid != "", "version": version != "", "imc": imc != ""}
        each = {*offered, *(Service(about[key][0], "0.0.0.0", 0, about[key][1]) for key in about if given[key])}
        return cls(tuple(sorted(each, key=str)))

    def __str__(self) -> str:
        """The text for `Announce.services`."""
        return ";".join(map(str, self.each))

    def endpoints(self, scheme: str, sender: str = "") -> tuple[Endpoint, ...]:
        """Destinations for a scheme, such as "imc+udp", each once; first those at `sender`'s address."""
        found = dict.fromkeys(s.endpoint for s in self.each if s.scheme == scheme)
        return tuple(sorted((e for e in found if e is not None), key=lambda end: end.address != sender))

    @property
    def uid(self) -> str:
        """The name of this run of the system; empty if it gives none."""
        return self._about("dune", "/uid/")

    @property
    def version(self) -> str:
        """The version of the system's software; empty if it gives none."""
        return self._about("dune", "/version/")

    @property
    def imc_version(self) -> str:
        """The version of the system's messages; empty if it gives none."""
        return self._about("imc+info", "/version/")

    @property
    def message_checksums(self) -> dict[int, str] | None:
        """The signatures of the system's own messages, by id; None if it does not announce them."""
        if MESSAGES.scheme not in (service.scheme for service in self.each):
            return None
        items = (item.partition("-") for item in self._about(MESSAGES.scheme, MESSAGES.path).split(","))
        return {int(number): text for number, _, text in items if number.isdecimal()}

    @property
    def console_network(self) -> str:
        """The network of a console that announces only its name, such as "zenoh"; empty for other systems."""
        return "" if self.endpoints("imc+udp") else self._about(MESSAGES.scheme, CONSOLE)

    @property
    def mavlink_id(self) -> int:
        """The system's id in MAVLink; 0 if it gives none."""
        words = self._about("mavlink+info", "/system/")
        return int(words) if words.isdecimal() and len(words) <= 3 else 0

    def _about(self, scheme: str, path: str) -> str:
        return next((s.path[len(path) :] for s in self.each if s.scheme == scheme and s.path.startswith(path)), "")


def check_address(text: str) -> None:
    """Raises ValueError if a text is not an IPv4 address."""
    try:
        IPv4Address(text)
    except ValueError:
        raise ValueError(f"{quoted(text)} is not an IPv4 address") from None


def is_ip_address(host: str) -> bool:
    """Whether a host is given by its number, of IPv4 or IPv6."""
    try:
        ip_address(host)
    except ValueError:
        return False
    return True


def announce_targets(addresses: Iterable[str], ports: Iterable[int] = PORTS) -> tuple[Endpoint, ...]:
    """Destinations of an Announce: each port of each address, such as `LOOPBACK`, `MULTICAST`, `BROADCAST`."""
    ports = tuple(ports)
    return tuple(Endpoint(address, port) for address in dict.fromkeys(addresses) for port in ports)


def displayable_name(name: str) -> str:
    """A name from the network as it can be shown: printable, without spaces at its ends, at most 64 characters."""
    shown = "".join(c for c in name[: 4 * LONGEST_NAME] if c.isprintable()).strip()
    return clip(shown, LONGEST_NAME)
