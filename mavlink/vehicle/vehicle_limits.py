"""How fast, deep, high and far the vehicle may be sent, by its profile and its operational limits."""

import math
from collections.abc import Callable

import imc
from mavlink.missions import fence_of, inside
from mavlink.vehicle.latest_values import LatestValues

DEPTH_MARGIN = 1.0  # m above its greatest depth that a vehicle stays
MAX_PLAN_SPEED = 100.0  # m/s that a plan may ask for
Mask = imc.OpLimitsMask


class VehicleLimits:
    """The present limits; `limit` gives one of the profile by its option, infinite if there is none."""

    def __init__(self, latest: LatestValues, limit: Callable[[str], float]) -> None:
        self._latest = latest
        self._limit = limit

    @property
    def message(self) -> imc.OperationalLimits | None:
        """Those that were published last."""
        return self._latest.get(imc.OperationalLimits)

    @property
    def max_speed(self) -> float:
        """In m/s."""
        known = self.message
        set_ = known.max_speed if known is not None and known.mask & Mask.MAX_SPEED else MAX_PLAN_SPEED
        return min(set_, MAX_PLAN_SPEED, self._limit("Maximum Absolute Speed"))

    @property
    def max_depth(self) -> float:
        """In m."""
        known = self.message
        set_ = known.max_depth if known is not None and known.mask & Mask.MAX_DEPTH else math.inf
        return min(set_, self._limit("Absolute Maximum Depth")) - DEPTH_MARGIN

    @property
    def max_altitude(self) -> float:
        """In m above the ground."""
        known = self.message
        set_ = known.max_altitude if known is not None and known.mask & Mask.MAX_ALT else math.inf
        return min(set_, self._limit("Absolute Maximum Altitude"))

    def contains(self, lat: float, lon: float) -> bool | None:
        """Whether a place (rad) is inside the fence; None if there is none."""
        known = self.message
        return inside(known, lat, lon) if known is not None and fence_of(known) else None
