"""Makes the links to the networks that a user names."""

import os
from collections.abc import Callable, Sequence
from contextlib import suppress
from pathlib import Path

import imc
from imc.discovery import LOOPBACK, PORTS, Endpoint, Service
from imc.reserved_ids import OPERATORS
from runtime.zenoh import read_connect_endpoints
from shoal.network.blocking import VehicleConnection
from shoal.network.link import ConsoleIdentity, NetworkLink
from shoal.network.network import Network
from shoal.network.tcp_link import USUAL_PORT, TCPLink
from shoal.network.udp_link import EVERYWHERE, UDPLink
from shoal.network.zenoh_link import LOCAL, ZenohLink

ENDPOINTS = "SHOAL_CONNECT"
CONFIG_FILE = "SHOAL_ZENOH_CONFIG"
DISCOVERY = "SHOAL_DISCOVERY"
CONSOLE = "SHOAL_CONSOLE"
"""Environment variables: endpoints with commas; a configuration file of zenoh; ports of discovery, such as 30100-30104;
our system id, such as 0x4101, for vehicles that list the consoles that may command them."""
EXAMPLES = "zenoh, udp, tcp/10.0.0.7:7447, imc+udp://10.0.0.7:6002/ or imc+tcp://10.0.0.7:7001/"


def make_network(
    endpoints: str | Sequence[str] = (),
    zenoh_config: Path | None = None,
    messages: imc.Schema | None = None,
    report: Callable[[str], object] = lambda _: None,
) -> Network:
    """A network of the links to some endpoints; without any, to all of this computer.

    An endpoint is `zenoh` or `udp` (of this computer), one of zenoh such as tcp/10.0.0.7:7447, or an address for IMC:
    imc+udp://10.0.0.7:6002/, imc+tcp://10.0.0.7:7001/, or imc+udp://0.0.0.0/ for all networks of this computer. Without
    endpoints those in the environment are used, or those for zenoh in `zenoh_config`, a file. Each endpoint of zenoh is
    a network of its own, since a client of zenoh joins one only. `messages` are those of its vehicles, by default the
    built-in ones. `report` gets a sentence when a search takes long. Raises ValueError for a wrong endpoint or file.
    """
    texts = [endpoints] if isinstance(endpoints, str) else list(endpoints) or [os.environ.get(ENDPOINTS, "")]
    given = [word.strip() for text in texts for word in text.split(",") if word.strip()]
    if zenoh_config is None and os.environ.get(CONFIG_FILE):
        zenoh_config = Path(os.environ[CONFIG_FILE])
    of_zenoh: list[str] = []
    of_udp: list[Endpoint] = []
    of_tcp: list[Endpoint] = []
    for endpoint in given or ["zenoh", "udp"]:
        if endpoint in ("zenoh", "udp"):
            of_zenoh += ((_in_file(zenoh_config) if not given else []) or [LOCAL]) if endpoint == "zenoh" else []
            of_udp += [Endpoint(LOOPBACK, 0)] if endpoint == "udp" else []
        elif endpoint.startswith("imc+tcp:"):
            of_tcp.append(_server(endpoint))
        elif endpoint.startswith("imc+udp:"):
            of_udp.append(_place(endpoint))
        elif "/" in endpoint and ":" in endpoint and "://" not in endpoint:
            of_zenoh.append(endpoint)
        else:
            raise ValueError(f"{endpoint!r} is not an endpoint such as {EXAMPLES}")
    links: list[NetworkLink] = []
    of_zenoh = list(dict.fromkeys(of_zenoh))
    names = [f"zenoh {endpoint}" for endpoint in of_zenoh] if len(of_zenoh) > 1 else ["zenoh"]
    links += [ZenohLink([each], zenoh_config, name) for each, name in zip(of_zenoh, names, strict=False)]
    links += [UDPLink(of_udp, _ports())] if of_udp else []
    links += [TCPLink(of_tcp)] if of_tcp else []
    return Network(links, _console(), _schema(messages), expects_all=bool(given or len(of_zenoh) > 1), report=report)


def connect(
    name: str,
    *,
    endpoints: str | Sequence[str] = (),
    zenoh_config: Path | None = None,
    messages: imc.Schema | None = None,
    timeout: float | None = None,
    report: Callable[[str], object] = lambda _: None,
) -> VehicleConnection:
    """A running vehicle, by its name; over zenoh or IMC, whichever answers.

    `make_network` explains endpoints, messages and report.

    Use it in `with` (then it is a `RemoteVehicle`) or in `async with` (an `AsyncRemoteVehicle`):

        with shoal.connect("lauv-noptilus-1") as vehicle:
            print(vehicle.plan.start("survey"))

    or, in a notebook, `open` it in one cell and `close` it in another.

    Entering raises NetworkError if it is not found within `timeout` seconds, by default as long as there is hope, and
    ValueError for a wrong endpoint.
    """
    return VehicleConnection(name, lambda: make_network(endpoints, zenoh_config, messages, report), timeout)


def _in_file(path: Path | None) -> list[str]:
    with suppress(ModuleNotFoundError):  # without zenoh the link reports that
        return [] if path is None else read_connect_endpoints(path)
    return []


def _schema(messages: object) -> imc.Schema | None:
    if messages is not None and not isinstance(messages, imc.Schema):
        raise TypeError(f"messages is {messages!r}, not a schema such as imc.load returns")
    return messages


def _server(text: str) -> Endpoint:
    service = Service.parse(text)
    if service.address in ("", EVERYWHERE):
        raise ValueError(f"{text!r} is not the address of one computer")
    return Endpoint(service.address, service.port or USUAL_PORT)


def _place(text: str) -> Endpoint:
    service = Service.parse(text)
    place = Endpoint(EVERYWHERE, 0) if service.address == EVERYWHERE else Endpoint(service.address, service.port)
    if place.address != EVERYWHERE and Service("imc+udp", place.address, place.port or 1).endpoint is None:
        raise ValueError(f"{text!r}: {service.address!r} is not the IPv4 address of a computer")
    return place


def _console() -> ConsoleIdentity | None:
    text = os.environ.get(CONSOLE, "")
    if not text:
        return None
    try:
        number = int(text, 0)
    except ValueError:
        number = 0
    if number not in OPERATORS:
        raise ValueError(
            f"{CONSOLE}: {text!r} is not the id of a console: 0x{OPERATORS[0]:04X} to 0x{OPERATORS[-1]:04X}"
        )
    return ConsoleIdentity.of_this_program(number)


def _ports() -> Sequence[int]:
    text = os.environ.get(DISCOVERY, "")
    if not text:
        return PORTS
    first, _, last = text.partition("-")
    if not (first.isdecimal() and last.isdecimal() and 0 < int(first) <= int(last) < 65536):
        raise ValueError(f"{DISCOVERY}: {text!r} is not a range of ports such as 30100-30104")
    return range(int(first), int(last) + 1)
