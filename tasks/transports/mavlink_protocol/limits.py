"""How fast, deep, high and far the vehicle may be sent, by its profile and its operational limits."""

import math
from collections.abc import Callable

import imc
from mavlink.missions import fence_of, inside
from tasks.transports.mavlink_protocol.figures import Figures

BELOW = 1.0  # m above its greatest depth that a vehicle stays
FASTEST = 100.0  # m/s that a plan may ask for
Limit = imc.OpLimitsMask


class Limits:
    """The present limits; `most` gives one of the profile by its option, infinite if there is none."""

    def __init__(self, figures: Figures, most: Callable[[str], float]) -> None:
        self._figures = figures
        self._most = most

    @property
    def message(self) -> imc.OperationalLimits | None:
        """Those that were published last."""
        return self._figures.latest(imc.OperationalLimits)

    @property
    def fastest(self) -> float:
        """In m/s."""
        known = self.message
        set_ = known.max_speed if known is not None and known.mask & Limit.MAX_SPEED else FASTEST
        return min(set_, FASTEST, self._most("Maximum Absolute Speed"))

    @property
    def deepest(self) -> float:
        """In m."""
        known = self.message
        set_ = known.max_depth if known is not None and known.mask & Limit.MAX_DEPTH else math.inf
        return min(set_, self._most("Absolute Maximum Depth")) - BELOW

    @property
    def highest(self) -> float:
        """In m above the ground."""
        known = self.message
        set_ = known.max_altitude if known is not None and known.mask & Limit.MAX_ALT else math.inf
        return min(set_, self._most("Absolute Maximum Altitude"))

    def holds(self, lat: float, lon: float) -> bool | None:
        """Whether a place (rad) is inside the fence; None if there is none."""
        known = self.message
        return inside(known, lat, lon) if known is not None and fence_of(known) else None
