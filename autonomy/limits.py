"""The limits within which a vehicle operates, and how far each part of it stays away from them."""

import math
from collections.abc import Callable, Mapping
from dataclasses import dataclass, replace
from typing import Self

import imc

Bits = imc.OpLimitsMask

# m above the maximum depth
REFERENCE_MARGIN = 1.0  # the deepest reference of Control.AUV.Attitude
FLOOR_MARGIN = 0.5  # where Control.AUV.Attitude holds the vehicle for any reference
YOYO_MARGIN = 3.0  # the deepest turn of Maneuver.YoYo
PLAN_MARGIN = 1.0  # the deepest maneuver of a plan
MAVLINK_MARGIN = 1.0  # the deepest place to which a ground station may send the vehicle
# m above the minimum altitude
YOYO_ALTITUDE_MARGIN = 0.5  # the lowest turn of Maneuver.YoYo; lower, the vehicle would level off

OPTIONS: Mapping[str, str] = {
    "deepest": "Absolute Maximum Depth",
    "lowest": "Absolute Minimum Altitude",
    "highest": "Absolute Maximum Altitude",
    "fastest": "Maximum Absolute Speed",
}


@dataclass(frozen=True)
class OperatingLimits:
    """The maximum depth, minimum and maximum altitude (m above ground) and maximum speed (m/s); infinite is none."""

    deepest: float = math.inf
    lowest: float = -math.inf
    highest: float = math.inf
    fastest: float = math.inf

    @classmethod
    def from_options(cls, number: Callable[[str, float], float], **defaults: float) -> Self:
        """The limits named in `defaults`; `number` gives an option of a profile, or the default where it is missing."""
        return cls(**{limit: number(OPTIONS[limit], default) for limit, default in defaults.items()})

    def tightened(self, limits: imc.OperationalLimits) -> Self:
        """These limits, or those of a message where they are stricter; what is not a finite number does not count."""

        def stricter(choose: Callable[[float, float], float], own: float, bit: int, value: float) -> float:
            return choose(own, value) if limits.mask & bit and math.isfinite(value) else own

        return replace(
            self,
            deepest=stricter(min, self.deepest, Bits.MAX_DEPTH, limits.max_depth),
            lowest=stricter(max, self.lowest, Bits.MIN_ALT, limits.min_altitude),
            highest=stricter(min, self.highest, Bits.MAX_ALT, limits.max_altitude),
            fastest=stricter(min, self.fastest, Bits.MAX_SPEED, limits.max_speed),
        )
