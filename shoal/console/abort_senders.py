"""Names of those who have aborted, for texts of vehicles, which have the number of a system only."""

import re
from collections.abc import Callable

from imc.discovery import displayable_name
from shoal.network import Network

REQUEST = re.compile(r"got abort request from system (?P<name>.{1,255}?) - (?P<id>\d{1,5}) @ (?P<entity>[^\n]{1,255})")
"""The text of Shoal and of DUNE."""


class AbortSenders:
    """Names systems by what is known of them on a network, and this console by its user.

    `user(vehicle)` is the user of this console who has aborted a vehicle last, empty if none has.
    """

    def __init__(self, network: Network, user: Callable[[str], str] = lambda _: "") -> None:
        self._network, self._user = network, user

    def named(self, vehicle: str, text: str) -> str:
        """A text of a vehicle with the name of who has aborted; without, or without an Abort in it, as it is."""
        return REQUEST.sub(lambda found: f"aborted by {self._sender(vehicle, found)}", text)

    def _sender(self, vehicle: str, found: re.Match[str]) -> str:
        number, entity = int(found["id"]), found["entity"]
        if number == self._network.console.id:
            return f"{self._user(vehicle) or 'a user'} on this page"
        raw = f"0x{number:04X}"
        known = (system.name for system in self._network.systems.values() if system.id == number and system.name != raw)
        name = displayable_name(next(known, found["name"]))
        sender = f"system {raw}" if name in ("", raw) else f"{name} ({raw})"
        return sender if entity.isdecimal() else f"{entity} of {sender}"
