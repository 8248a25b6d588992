"""Follows paths by steering to their end."""

from autonomy.guidance import PurePursuitGains, PurePursuitLaw
from runtime import param
from tasks.control.path.path_follower import PathFollowerTask


class PurePursuit(PathFollowerTask):
    """Steers toward the end of a straight track, or toward a point ahead on a circle."""

    lookahead: float = param(5.0, "m", "Distance to the point ahead on a circle.", name="Loiter Lookahead", minimum=0.1)

    def steering_law(self) -> PurePursuitLaw:
        return PurePursuitLaw(PurePursuitGains(self.lookahead))
