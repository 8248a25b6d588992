"""Depth limits of the maneuvers that zigzag in depth."""

import math
from functools import partial
from typing import NamedTuple

import imc
from autonomy.guidance import YoYoSettings
from autonomy.limits import YOYO_ALTITUDE_MARGIN, YOYO_MARGIN, OperatingLimits
from runtime.vehicle import ProfileValues, general_number


class YoYoLimits(NamedTuple):
    """The deepest turn (m) and the lowest above the bottom (m)."""

    deepest: float
    lowest: float

    @classmethod
    def of_profile(cls, profile: ProfileValues, lowest: float = -math.inf) -> "YoYoLimits":
        """The limits of a profile, and at least `lowest` (m) above the bottom. Raises ParameterError."""
        limits = OperatingLimits.from_options(partial(general_number, profile), deepest=math.inf, lowest=-math.inf)
        return cls(limits.deepest - YOYO_MARGIN, max(lowest, limits.lowest + YOYO_ALTITUDE_MARGIN))

    def settings(self, maneuver: imc.YoYo | imc.CompassCalibration, step: float) -> YoYoSettings:
        """The zigzag of a maneuver within these limits; its pitch changes by at most `step` (rad) at once."""
        by_altitude = maneuver.z_units == imc.ZUnits.ALTITUDE
        return YoYoSettings(maneuver.z, maneuver.amplitude, maneuver.pitch, by_altitude, *self, step)
