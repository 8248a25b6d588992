"""The position of an estimate, and where a vehicle was first seen, also when the reference of its states moves."""

from imc.messages import EstimatedState, SimulatedState
from support.wgs84 import displace, displacement

NOWHERE: tuple[float, float] = (0.0, 0.0)  # rad, of systems without a position


def absolute_position(state: EstimatedState | SimulatedState) -> tuple[float, float, float]:
    """Position of a vehicle (rad, rad, m): its reference position displaced by its offsets."""
    return displace(state.lat, state.lon, state.height, state.x, state.y, state.z)


class LocalOrigin:
    """First known position of a vehicle: `north`, `east` (m) of the reference position of its latest state.

    A navigation filter may move the reference during a run (DUNE's does when far from it); the start does not move.
    Latitude and longitude are both 0 while a system has no position: it is first seen elsewhere.
    """

    def __init__(self) -> None:
        self.known: bool = False
        self.north: float = 0.0
        self.east: float = 0.0
        self._reference: tuple[float, float] = NOWHERE

    def update(self, state: EstimatedState | SimulatedState) -> None:
        """Take the next state, whose position must be finite."""
        reference = state.lat, state.lon
        if not self.known or (self._reference == NOWHERE != reference):
            self.known, self.north, self.east = True, state.x, state.y
        elif reference != self._reference:
            north, east, _ = displacement(*reference, 0.0, *self._reference, 0.0)
            self.north, self.east = self.north + north, self.east + east
        self._reference = reference
