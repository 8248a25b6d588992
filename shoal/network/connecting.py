"""From where a user wants to connect to the links that do it."""

import os
from collections.abc import Sequence
from pathlib import Path

from shoal.network.blocking import Connection
from shoal.network.link import Link
from shoal.network.network import MEETING, Network
from shoal.network.zenoh_link import LOCAL, ZenohLink

ENDPOINTS = "SHOAL_CONNECT"
CONFIG_FILE = "SHOAL_ZENOH_CONFIG"
"""Environment variables: endpoints with commas, and a configuration file of zenoh."""


def make_network(endpoints: Sequence[str] = (), zenoh_config: Path | None = None) -> Network:
    """A network of all links; `endpoints` such as tcp/10.0.0.7:7447 (zenoh) replace those of this computer.

    Without them those in the environment are used. Raises ValueError for a wrong one.
    """
    given = list(endpoints) or [word.strip() for word in os.environ.get(ENDPOINTS, "").split(",") if word.strip()]
    if zenoh_config is None and os.environ.get(CONFIG_FILE):
        zenoh_config = Path(os.environ[CONFIG_FILE])
    for endpoint in given:
        if "/" not in endpoint or ":" not in endpoint:
            raise ValueError(f"{endpoint!r} is not an endpoint such as tcp/127.0.0.1:7447")
    links: list[Link] = [ZenohLink(given or (LOCAL,), zenoh_config)]
    return Network(links)


def connect(
    name: str, *, endpoints: Sequence[str] = (), zenoh_config: Path | None = None, timeout: float = MEETING
) -> Connection:
    """A running vehicle, by its name.

    Use it in `with` (then it is a `RemoteVehicle`) or in `async with` (an `AsyncRemoteVehicle`):

        with shoal.connect("lauv-noptilus-1") as vehicle:
            print(vehicle.plan.start("survey"))

    Entering raises NetworkError if it is not found within `timeout` seconds, and ValueError for a wrong endpoint.
    """
    return Connection(name, lambda: make_network(endpoints, zenoh_config), timeout)
