"""The bottom in the world of a vehicle, which expressions compare with its position."""

import math
from typing import Any

from support.wgs84 import offset
from world.sea import Bathymetry


class WorldBottom:
    """The bottom in the world of a vehicle; it stands where else its latest message is."""

    def __init__(self, seabed: Bathymetry):
        self._seabed = seabed
        self._reference = (math.nan, math.nan)
        self._north = self._east = math.nan

    def distance_below(self, state: Any) -> float:
        """Distance of the bottom below a vehicle (m)."""
        if (state.lat, state.lon) != self._reference:
            self._reference = state.lat, state.lon
            self._north, self._east = offset(*self._seabed.reference, state.lat, state.lon)
        return self._seabed.depth(self._north + state.x, self._east + state.y) - state.z


def altitude(state: Any, bottom: WorldBottom) -> float:
    """Distance of the bottom below a vehicle (m); NaN if its position is no number."""
    try:
        return bottom.distance_below(state)
    except (ValueError, OverflowError):
        return math.nan
