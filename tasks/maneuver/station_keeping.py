"""Keeps near a point."""

import imc
from runtime import param
from tasks.maneuver.protocol import Leg, Maneuver
from tasks.maneuver.station import keep_station


class StationKeeping(Maneuver):
    """Goes to a point, drifts there with all loops off, and goes back when it has left the circle."""

    loops = None
    hears = (imc.PathControlState, imc.EstimatedState)
    hears_others = (imc.ManeuverDone,)

    minimum_radius: float = param(10.0, "m", "Smallest radius; smaller ones are raised to it.", minimum=0)

    async def execute(self, station: imc.StationKeeping) -> None:
        await keep_station(self, Leg.of(station), max(station.radius, self.minimum_radius), station.duration)
