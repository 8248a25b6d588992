"""Keeps the position where a vehicle was first seen, also when the reference position of its states moves."""

from imc.coordinates.wgs84 import displacement
from imc.messages import EstimatedState, SimulatedState

NOWHERE: tuple[float, float] = (0.0, 0.0)  # rad, of systems that do not know their position


class StartPoint:
    """Where a vehicle was first seen: `north`, `east` (m) of the reference position of its latest state.

    A navigation filter may move the reference during a run (DUNE's does when far from it); the start does not move.
    Latitude and longitude are both 0 while a system does not know its position: it is first seen elsewhere.
    """

    def __init__(self) -> None:
        self.known = False
        self.north = self.east = 0.0
        self._reference: tuple[float, float] = NOWHERE

    def follow(self, state: EstimatedState | SimulatedState) -> None:
        """Take the next state, whose position must be finite."""
        reference = state.lat, state.lon
        if not self.known or (self._reference == NOWHERE != reference):
            self.known, self.north, self.east = True, state.x, state.y
        elif reference != self._reference:
            north, east, _ = displacement(*reference, 0.0, *self._reference, 0.0)
            self.north, self.east = self.north + north, self.east + east
        self._reference = reference
