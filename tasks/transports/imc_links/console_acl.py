"""Who may command the vehicle over a network that knows no passwords: systems, and where they send from."""

from collections.abc import Callable, Iterable

import imc
from support.terminal_text import quoted
from tasks.transports.imc_links.sockets import check_address

REPORTS = frozenset(
    kind.ID
    for kind in (
        *(imc.Announce, imc.Heartbeat, imc.EntityInfo, imc.EntityState, imc.EstimatedState, imc.SimulatedState),
        *(imc.VehicleState, imc.PlanControlState, imc.GpsFix, imc.RemoteSensorInfo, imc.FuelLevel, imc.LogBookEntry),
        *(imc.AngularVelocity, imc.Acceleration, imc.EulerAngles, imc.Temperature, imc.Salinity, imc.WaterVelocity),
    )
)
"""What any announced system may send, because no task obeys it: other vehicles report where they are."""


class ConsoleAcl:
    """The systems that may command; without any listed, all may.

    An item is the name or the id of a system, and may say from where: `ccu-lsts-1-1`, `0x4101@10.0.0.5`.
    `id_of(name)` is the id of a system. Raises ValueError for an item that is not in the syntax, or an unknown name.
    """

    def __init__(self, items: Iterable[str], id_of: Callable[[str], int | None]):
        self.listed: dict[int, set[str]] = {}
        items = list(filter(None, map(str.strip, items)))
        who = f"only {', '.join(items)} may" if items else "whoever reaches it can"
        self.risk = f"{who} command the vehicle"
        for item in items:
            name, at, address = (part.strip() for part in item.partition("@"))
            if at:
                check_address(address)
            self.listed.setdefault(_system(name, id_of), set()).add(address)

    def allows(self, system: int, address: str, kind: int) -> bool:
        """Whether to take a message, given the id of its type, from a system at an address."""
        if not self.listed or kind in REPORTS:
            return True
        places = self.listed.get(system, ())
        return "" in places or address in places


def _system(name: str, id_of: Callable[[str], int | None]) -> int:
    found = id_of(name)
    if found is None:
        try:
            found = int(name, 0)
        except ValueError:
            raise ValueError(f"{quoted(name)} is not in [IMC Addresses]: give the id of the system instead") from None
    if not 0 <= found < 0xFFFF:
        raise ValueError(f"{quoted(name)} is not the id of a system")
    return found
