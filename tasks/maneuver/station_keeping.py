"""Keeps near a point."""

import math
from typing import ClassVar

import imc
from imc.tuple_list import parse_tuple_list
from runtime import param
from tasks.maneuver.hover_control import hover
from tasks.maneuver.maneuver_task import Loops, Maneuver, PathEnd
from tasks.maneuver.station_control import ApproachSpeed, keep_station


class StationKeeping(Maneuver):
    """Goes to a point, comes to the surface and drifts inside the circle, as in IMC; or circles under water.

    A vehicle that can hover does so. `Minimum Radius=3` (m) and `Under Water=circle` in the field `custom` replace the
    parameters for a station.
    """

    loops: ClassVar[int | None] = None
    subscribed: ClassVar[tuple[type[imc.Message], ...]] = (imc.PathControlState, imc.EstimatedState)
    subscribed_from_others: ClassVar[tuple[type[imc.Message], ...]] = (imc.ManeuverDone,)

    minimum_radius: float = param(10.0, "m", "Smallest radius; smaller ones are raised to it.", minimum=0)
    under_water: str = param(
        "surface",
        "",
        "Behavior at a station under water: come up and drift (surface), or stay on the circle at its depth "
        "or altitude (circle).",
        choices=("surface", "circle"),
        editable=False,
    )
    deceleration: float = param(
        0.0,
        "m/s²",
        "Deceleration toward the point, for a vehicle that coasts; 0 for none.",
        name="Approach Deceleration",
        minimum=0,
    )
    slowest: float = param(
        0.3,
        "m/s",
        "Lowest speed of the approach; a rudder needs flow to steer.",
        name="Approach Minimum Speed",
        minimum=0.05,
    )
    hovers: bool = param(False, "", "Whether the vehicle can hover.", editable=False)

    def smallest_radius(self, station: imc.StationKeeping) -> float:
        """The smallest radius of a station (m)."""
        try:
            own = float(parse_tuple_list(station.custom)["Minimum Radius"])
        except (KeyError, ValueError):
            return self.minimum_radius
        return own if 0.0 < own < math.inf else self.minimum_radius

    def circles(self, station: imc.StationKeeping) -> bool:
        """Whether to stay on the circle under water."""
        return parse_tuple_list(station.custom).get("Under Water", self.under_water).lower() == "circle"

    async def execute(self, station: imc.StationKeeping) -> None:
        if self.hovers:
            self.set_control_loops(Loops.PATH)
            await hover(self, PathEnd.from_maneuver(station), station.duration)
            return
        radius = max(station.radius, self.smallest_radius(station))
        approach = ApproachSpeed(self.deceleration, self.slowest)
        await keep_station(
            self, PathEnd.from_maneuver(station), radius, station.duration, approach, circle=self.circles(station)
        )
