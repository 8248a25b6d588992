"""Circles around a point, or in figures of eight."""

import math

import imc
from imc.coordinates import displace
from runtime import param
from tasks.maneuver.hover import hover
from tasks.maneuver.protocol import Leg, Maneuver, PathFlags, PathState

Form = imc.Loiter.Type
Direction = imc.Loiter.Direction


class Loiter(Maneuver):
    """Circles for a time, counted from the arrival on the circle; 0 is forever.

    The type EIGHT is a figure of eight, all others are circles. A vehicle that can hover does so for the type HOVER.
    """

    hears = (imc.PathControlState, imc.EstimatedState)

    minimum_radius: float = param(10.0, "m", "Smallest radius; smaller ones are raised to it.", minimum=0)
    hovers: bool = param(False, "", "Whether the vehicle can hover.", editable=False)

    async def execute(self, loiter: imc.Loiter) -> None:
        if self.hovers and loiter.type == Form.HOVER:
            await hover(self, Leg.of(loiter), loiter.duration)
            return
        self._left = float(loiter.duration) or math.inf
        self._end = math.inf
        self._nearest = math.inf
        radius = max(loiter.radius, self.minimum_radius)
        counter = PathFlags.CCLOCKW if loiter.direction == Direction.CCLOCKW else 0
        if loiter.type != Form.EIGHT:
            self.steer(Leg.of(loiter), radius=radius, flags=counter)
            while not await self._over():
                pass
            self._judge(loiter)
            return
        side, over = 1.0, False
        while not over:
            over = await self._half_eight(loiter, radius, side, counter)
            side, counter = -side, counter ^ PathFlags.CCLOCKW
        self._judge(loiter)

    def _judge(self, loiter: imc.Loiter) -> None:
        if math.isfinite(self._nearest):
            self.judge(Leg.of(loiter), self._nearest)

    async def _half_eight(self, loiter: imc.Loiter, radius: float, side: float, flags: int) -> bool:
        """One circle of an eight: around its outer side, then until abeam of its center. True if the time is over."""
        north, east = side * math.cos(loiter.bearing), side * math.sin(loiter.bearing)
        reach = 0.5 * loiter.length
        lat, lon, _ = displace(loiter.lat, loiter.lon, 0.0, reach * north, reach * east)
        self.steer(Leg.of(loiter)._replace(lat=lat, lon=lon), radius=radius, flags=flags)
        outside = False
        while True:
            if await self._over():
                return True
            if self.state is not None:
                to_north, to_east = self.offset(lat, lon)
                outward = -(to_north * north + to_east * east)
                outside = outside or outward > 0.5 * radius
                if outside and outward < 0.0:
                    return False

    async def _over(self) -> bool:
        """Wait for the next message and report the time left; True if the time is over."""
        if await self.event() is self.path and self.path is not None:
            if self.path.flags & PathState.LOITERING:
                self._nearest = min(self._nearest, self.path.z, key=abs)
                self._end = min(self._end, self.now + self._left)
                self.report(self._end - self.now)
            elif self._end == math.inf:
                self.tell(after=self._left)
            else:
                self.report(self._end - self.now)
        return self.now >= self._end
