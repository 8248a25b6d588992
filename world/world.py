"""One world, which vehicle, sonars, DVL and cameras share."""

from dataclasses import dataclass, field
from functools import cached_property

from world.charts import Chart
from world.objects import GLIDER, NorthEast, ObjectPosition, WorldObject
from world.sea import Bathymetry, SeaState, WindSea
from world.sun import Sun


@dataclass(frozen=True)
class World:
    """The surroundings of a vehicle. Places are m north and east of the origin, and m below the surface of the sea.

    `origin` is a latitude and longitude (rad); without it, places count from where a vehicle is first seen. `seabed` is
    None where the bottom is not known. `water_visibility` and `air_visibility` (m) are the distances at which 2 % of
    the contrast is left; `water_type` is one of Jerlov's types, if the water is of one. `walls` are vertical, from one
    place (m north, east) to another, as high as the water is deep. `marine_snow` is how many flakes are in a cubic
    meter of water, `caustics` the share of a clear sun that waves gather on the bottom. `waves_move_boats`: boats ride
    on the waves, which come from `wave_bearing` (rad from north). `chart` is the file that the seabed is from, if any.
    """

    origin: tuple[float, float] | None = None
    seabed: Bathymetry | None = None
    objects: tuple[WorldObject, ...] = ()
    waves: SeaState = field(default_factory=SeaState)
    sun: Sun = field(default_factory=Sun)
    water_visibility: float = 60.0
    air_visibility: float = 20e3
    water_type: str = ""
    walls: tuple[tuple[NorthEast, NorthEast], ...] = ()
    marine_snow: float = 0.0
    caustics: float = 0.0
    waves_move_boats: bool = False
    wave_bearing: float = 0.0
    chart: Chart | None = None

    @cached_property
    def gliders(self) -> tuple[WorldObject, ...]:
        return tuple(thing for thing in self.objects if thing.kind == GLIDER)

    @cached_property
    def boards(self) -> tuple[WorldObject, ...]:
        return tuple(thing for thing in self.objects if thing.kind != GLIDER)

    def seabed_depth(self, north: float, east: float) -> float | None:
        """Depth (m) of the bottom at a place; None if it is not known."""
        return None if self.seabed is None else self.seabed.depth(north, east)

    def wind_sea(self, seed: int) -> WindSea | None:
        """The waves that boats feel in a run; None if they feel none."""
        return WindSea(self.waves, self.wave_bearing, seed) if self.waves_move_boats and self.waves.height else None

    def object_position(self, thing: WorldObject, time: float) -> ObjectPosition:
        """Position of an object at a time (s from the start of the run)."""
        north, east, heading = thing.pose_at(time)
        return ObjectPosition(
            north, east, self.seabed_depth(north, east) if thing.depth is None else thing.depth, heading
        )
