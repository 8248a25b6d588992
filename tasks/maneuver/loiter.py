"""Circles around a point, or in figures of eight."""

import math
from typing import ClassVar

import imc
from runtime import param
from support.wgs84 import displace
from tasks.maneuver.circle_timer import CircleTimer
from tasks.maneuver.hover_control import hover
from tasks.maneuver.maneuver_task import Maneuver, PathEnd, PathFlags

Form = imc.Loiter.Type
Direction = imc.Loiter.Direction


class Loiter(Maneuver):
    """Circles for a time, counted from the arrival on the circle; 0 is forever.

    The type EIGHT is a figure of eight, all others are circles. A vehicle that can hover does so for the type HOVER.
    """

    subscribed: ClassVar[tuple[type[imc.Message], ...]] = (imc.PathControlState, imc.EstimatedState)

    minimum_radius: float = param(10.0, "m", "Smallest radius; smaller ones are raised to it.", minimum=0)
    hovers: bool = param(False, "", "Whether the vehicle can hover.", editable=False)

    async def execute(self, loiter: imc.Loiter) -> None:
        if self.hovers and loiter.type == Form.HOVER:
            await hover(self, PathEnd.from_maneuver(loiter), loiter.duration)
            return
        circling = CircleTimer(self, loiter.duration)
        radius = max(loiter.radius, self.minimum_radius)
        counter = PathFlags.CCLOCKW if loiter.direction == Direction.CCLOCKW else 0
        if loiter.type != Form.EIGHT:
            self.start_path(PathEnd.from_maneuver(loiter), radius=radius, flags=counter)
            while not await circling.process_next_message():
                pass
        side, over = 1.0, loiter.type != Form.EIGHT
        while not over:
            over = await self._half_eight(circling, loiter, radius, side, counter)
            side, counter = -side, counter ^ PathFlags.CCLOCKW
        circling.report_missed_circle(PathEnd.from_maneuver(loiter), radius)

    async def _half_eight(
        self, circling: CircleTimer, loiter: imc.Loiter, radius: float, side: float, flags: int
    ) -> bool:
        """One circle of an eight: around its outer side, then until abeam of its center. True if the time is over."""
        north, east = side * math.cos(loiter.bearing), side * math.sin(loiter.bearing)
        reach = 0.5 * loiter.length
        lat, lon, _ = displace(loiter.lat, loiter.lon, 0.0, reach * north, reach * east)
        self.start_path(PathEnd.from_maneuver(loiter)._replace(lat=lat, lon=lon), radius=radius, flags=flags)
        outside = False
        while True:
            if await circling.process_next_message():
                return True
            if self.state is not None:
                to_north, to_east = self.north_east_from_vehicle(lat, lon)
                outward = -(to_north * north + to_east * east)
                outside = outside or outward > 0.5 * radius
                if outside and outward < 0.0:
                    return False
