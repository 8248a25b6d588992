"""Range of a simulated radio: DUNE's `Communication Range`."""

import math
from collections.abc import Collection

import imc
from imc.coordinates import absolute_position
from imc.reserved_ids import UNKNOWN_SYSTEM
from support.wgs84 import displacement

UNDER_WATER = 0.5  # m of depth from which no radio wave gets out
MOST_SYSTEMS = 256


class RadioRange:
    """The systems within range, by the position of the vehicle and those that they announce; without one, none is.

    Messages with an id of `always` reach everybody, and so do all to places without a system. So does an Announce: it
    gives the present position of its system.
    """

    def __init__(self, distance: float = math.inf, under_water: bool = True, always: Collection[int] = ()):
        self.set_limits(distance, under_water, always)
        self._own: imc.EstimatedState | None = None
        self._others: dict[int, imc.Announce] = {}

    def set_limits(self, distance: float, under_water: bool, always: Collection[int]) -> None:
        """Change the limits; the positions stay."""
        self._distance, self._under_water = distance, under_water
        self._always = frozenset((*always, imc.Announce.ID))
        self._near: dict[int, bool] = {}

    def on_own_state(self, state: imc.EstimatedState) -> None:
        self._own = state
        self._near.clear()

    def on_announce(self, other: imc.Announce) -> None:
        if len(self._others) >= MOST_SYSTEMS and other.src not in self._others:
            del self._others[next(iter(self._others))]
        self._others[other.src] = other
        self._near.pop(other.src, None)

    def reaches(self, system: int, message: int) -> bool:
        """Whether a message with this id gets to a system, or from there."""
        if message in self._always or system == UNKNOWN_SYSTEM:
            return True
        if system not in self._near:
            self._near[system] = self._is_near(system)
        return self._near[system]

    def _is_near(self, system: int) -> bool:
        own, other = self._own, self._others.get(system)
        if own is None or other is None or (own.depth > UNDER_WATER and not self._under_water):
            return False
        return math.hypot(*displacement(*absolute_position(own), other.lat, other.lon, other.height)) <= self._distance
