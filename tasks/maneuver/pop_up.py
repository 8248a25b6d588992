"""Surfaces for a position fix and dives again."""

import math
from typing import ClassVar

import imc
from imc.coordinates import absolute_position
from runtime import param
from support.wgs84 import ground_distance
from tasks.maneuver.depth_spiral import spiral
from tasks.maneuver.maneuver_task import Loops, Maneuver, ManeuverError, PathEnd, PathFlags
from tasks.maneuver.station_control import keep_station

Flags = imc.PopUp.Flags
Water = imc.VehicleMedium.Medium.WATER
SURFACING = 120.0  # s to float up from the end of the spiral; an AUV with little buoyancy needs half a minute


class PopUp(Maneuver):
    """Goes to a point, spirals to the surface where it is then, waits there, and spirals down again where it is.

    With the flag WAIT_AT_SURFACE or STATION_KEEP it keeps near the place where it came up for its duration. Without
    them it waits until a good fix confirms the navigation. It never dives without one, as in DUNE, which waits forever:
    after its duration it fails; 0 is no limit.
    """

    subscribed: ClassVar[tuple[type[imc.Message], ...]] = (
        imc.PathControlState,
        imc.EstimatedState,
        imc.VehicleMedium,
        imc.GpsFix,
        imc.DesiredZ,
    )

    elevator_radius: float = param(15.0, "m", "Smallest radius of the spirals.", minimum=1)
    station_radius: float = param(
        15.0, "m", "Radius in which the vehicle keeps station.", name="Maximum Distance From Station", minimum=1
    )
    minimum_distance: float = param(3.0, "m", "A fix within this distance confirms the estimated position.", minimum=0)
    minimum_satellites: int = param(8, "1", "Least number of satellites of a good fix.", minimum=0, maximum=255)

    slowest: float = param(0.1, "m/s", "Smallest vertical speed; below 0 for none.", name="VMonitor -- Minimum Speed")
    patience: float = param(
        20.0, "s", "Time over which the vertical speed is measured.", name="VMonitor -- Timeout", minimum=0.1
    )

    async def execute(self, popup: imc.PopUp) -> None:
        leg = PathEnd.from_maneuver(popup)
        radius = max(popup.radius, self.elevator_radius)
        if not popup.flags & Flags.CURR_POS:
            await self.go_to_end(leg, after=popup.duration)
        surface = leg._replace(z=0.0, z_units=imc.ZUnits.DEPTH)
        await self._spiral(surface, radius, popup.duration)
        self.set_control_loops(0)
        await self._until_afloat()
        if popup.flags & (Flags.STATION_KEEP | Flags.WAIT_AT_SURFACE):
            lat, lon, _ = absolute_position(await self.wait_for_state())
            station = surface._replace(lat=lat, lon=lon)
            await keep_station(self, station, max(self.station_radius, radius), max(1.0, popup.duration))
        else:
            await self._until_fixed(popup.duration)
        self.set_control_loops(Loops.PATH)
        await self._spiral(leg, radius)

    async def _spiral(self, leg: PathEnd, radius: float, after: float = 0.0) -> None:
        flags, slowest, patience = PathFlags.LOITER_CURR, self.slowest, self.patience
        await spiral(self, leg, radius, flags=flags, after=after, slowest=slowest, patience=patience)

    async def _until_afloat(self) -> None:
        """Float up. Raises ManeuverError if the vehicle stays under water."""
        medium, began = None, self.now
        while medium != Water:
            event = await self.next_message()
            medium = event.medium if isinstance(event, imc.VehicleMedium) else medium
            if self.age(began) > SURFACING:
                depth = "depth unknown" if self.state is None else f"depth {self.state.depth:.1f} m"
                raise ManeuverError(f"has not surfaced: {depth}" + ("" if medium else ", VehicleMedium is missing"))

    async def _until_fixed(self, seconds: float) -> None:
        """Drift until a fix confirms the position. Raises ManeuverError after `seconds` without one; 0 is forever."""
        end = self.now + (seconds or math.inf)
        while self.now < end:
            event = await self.next_message()
            if isinstance(event, imc.GpsFix) and self._confirms(event):
                return
            if isinstance(event, imc.VehicleMedium):
                self.report_progress(end - self.now)
        raise ManeuverError(f"no good fix has confirmed the position within {seconds:g} s")

    def _confirms(self, fix: imc.GpsFix) -> bool:
        if self.state is None or not fix.validity & imc.GpsFix.Validity.VALID_POS:
            return False
        lat, lon, _ = absolute_position(self.state)
        away = ground_distance(lat, lon, fix.lat, fix.lon)
        return fix.satellites >= self.minimum_satellites and away <= self.minimum_distance
