"""Follows paths along a vector field of courses that lead to them."""

import math

from autonomy.guidance import VectorFieldGains, VectorFieldLaw
from runtime import param
from tasks.control.path.path_follower import PathFollowerTask


class VectorField(PathFollowerTask):
    """Steers at an angle that shrinks with the distance from the track (Nelson et al., IEEE T-RO 23(3), 2007)."""

    corridor_width: float = param(
        5.0,
        "m",
        "Distance from the track at which the entry angle applies.",
        name="Corridor -- Width",
        minimum=0.1,
        visibility="user",
    )
    entry_angle: float = param(
        15.0,
        "°",
        "Angle to the track at the edge of the corridor.",
        name="Corridor -- Entry Angle",
        minimum=1,
        maximum=60,
    )

    def steering_law(self) -> VectorFieldLaw:
        return VectorFieldLaw(VectorFieldGains(self.corridor_width, math.radians(self.entry_angle)))
