"""Other vehicles on the network, which obey some of the messages that they receive, from any sender."""

from collections.abc import Collection

import imc
from imc.discovery import VEHICLE_TYPES
from imc.reserved_ids import OPERATORS


class VehiclePeers:
    """Finds the systems that get nothing: other vehicles, unless `called` has their ids.

    A DUNE stops its plan when it receives the VehicleState of another vehicle, and rotates its log for LoggingControl.
    An id of a console stays one, also if a stranger announces it. A console, or a gateway, withholds nothing.
    """

    def __init__(self, system: int, called: Collection[int] = ()):
        self._system = system
        self.called: Collection[int] = called
        self._vehicles: set[int] = set()
        self._announced: set[int] = set()
        self._is_vehicle = True  # until it announces something else

    def on_announce(self, other: imc.Announce) -> bool:
        """Take an Announce, of this system too; whether somebody gets nothing now, or gets something again."""
        is_vehicle = other.sys_type in VEHICLE_TYPES
        if other.src == self._system:
            changed, self._is_vehicle = is_vehicle != self._is_vehicle, is_vehicle
            return changed
        self._announced.add(other.src)
        is_vehicle &= other.src not in OPERATORS
        changed = is_vehicle != (other.src in self._vehicles)
        if is_vehicle:
            self._vehicles.add(other.src)
        else:
            self._vehicles.discard(other.src)
        return changed

    def is_no_vehicle(self, system: int) -> bool:
        """Whether a system may certainly get messages, by its Announce, its id or `called`."""
        is_known = not self._is_vehicle or system in OPERATORS or system in self._announced or system in self.called
        return is_known and not self.withholds(system)

    def withholds(self, system: int) -> bool:
        """Whether a system gets nothing."""
        return self._is_vehicle and system in self._vehicles and system not in self.called
