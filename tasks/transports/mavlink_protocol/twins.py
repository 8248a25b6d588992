"""Other vehicles with the same MAVLink id, whom a ground station cannot tell from this one."""

from collections.abc import Callable

import imc
from imc.discovery import Services, readable_name
from mavlink import system_of

MOST = 16
VEHICLES = (imc.SystemType.UUV, imc.SystemType.USV, imc.SystemType.UAV, imc.SystemType.UGV)


class Twins:
    """Names each of them once; `system` is the own MAVLink id, `warn` takes a text."""

    def __init__(self, system: int, warn: Callable[[str], object]) -> None:
        self._system = system
        self._warn = warn
        self._named: set[object] = set()

    def meet(self, other: imc.Announce) -> None:
        """Take the Announce of another vehicle; its id follows from its IMC id if it does not tell it."""
        theirs = Services.parse(other.services).mavlink_id or system_of(other.src)
        if other.sys_type in VEHICLES and theirs == self._system:
            self.name(f"{readable_name(other.sys_name)} ({other.src:#06x})")

    def name(self, twin: str) -> None:
        if twin not in self._named and len(self._named) < MOST:
            self._named.add(twin)
            self._warn(f"MAVLink id {self._system} is also that of {twin}: set System Id")
