"""Follows paths by steering to their end."""

import math

from autonomy.guidance import PathProgress, bearing
from runtime import param
from tasks.control.path.path_follower import PathFollower


class PurePursuit(PathFollower):
    """Steers towards the end of a straight track, or towards a point ahead on a circle."""

    lookahead: float = param(5.0, "m", "Distance to the point ahead on a circle.", name="Loiter Lookahead", minimum=0.1)

    def along(self, where: PathProgress, bearing: float) -> float:
        return where.line_of_sight

    def around(self, line_of_sight: float, distance: float, radius: float, side: int) -> float:
        outward = line_of_sight + math.pi
        ahead = outward + side * min(self.lookahead / radius, 0.5 * math.pi)
        here = distance * math.cos(outward), distance * math.sin(outward)
        return bearing(here, (radius * math.cos(ahead), radius * math.sin(ahead)))
