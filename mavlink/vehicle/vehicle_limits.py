"""Limits of speed, depth, height and distance of the vehicle, by its profile and its operational limits."""

import math
from collections.abc import Callable

import imc
from autonomy.limits import MAVLINK_MARGIN, OperatingLimits
from imc.coordinates import area_contains
from mavlink.missions import fence_items
from mavlink.vehicle.latest_values import LatestValues

MAX_PLAN_SPEED = 100.0  # m/s that a plan may ask for


class VehicleLimits:
    """The present limits; `limit` gives one of the profile by its option, infinite if there is none."""

    def __init__(self, latest: LatestValues, limit: Callable[[str], float]) -> None:
        self._latest = latest
        self._limit = limit

    @property
    def message(self) -> imc.OperationalLimits | None:
        """Limits that were published last."""
        return self._latest.get(imc.OperationalLimits)

    @property
    def max_speed(self) -> float:
        """Speed limit in m/s."""
        return self._present().fastest

    @property
    def max_depth(self) -> float:
        """Depth limit in m, of places to which a station may send the vehicle."""
        return self._present().deepest - MAVLINK_MARGIN

    @property
    def max_altitude(self) -> float:
        """Altitude limit in m above the ground."""
        return self._present().highest

    def contains(self, lat: float, lon: float) -> bool | None:
        """Whether a place (rad) is inside the fence; None if there is none."""
        known = self.message
        return area_contains(known, lat, lon) if known is not None and fence_items(known) else None

    def _present(self) -> OperatingLimits:
        own = OperatingLimits.from_options(
            lambda option, greatest: min(self._limit(option), greatest),
            deepest=math.inf,
            highest=math.inf,
            fastest=MAX_PLAN_SPEED,
        )
        known = self.message
        return own.tightened(known) if known is not None else own
