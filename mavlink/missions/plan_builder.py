"""The maneuvers of a plan, added one by one by the items of a mission."""

import math
from typing import Any, NamedTuple

import imc
from autonomy.plans import sequential_transitions
from imc.coordinates import area_contains
from mavlink.missions.conversion_context import ConversionContext, Level, Units
from mavlink.missions.enums import PARAMETERS, MissionError, MissionResult
from mavlink.missions.item import DEGREES, Item, check_position
from mavlink.missions.item_map import ItemMap

LONGEST = 65_535  # s, of what IMC lets a maneuver last
WIDEST = 25_000.0  # m, of a circle
SURFACING = 1  # s at the surface; 0 would wait for a position fix, forever
Place = tuple[float, float]


class ConvertedPlan(NamedTuple):
    """A plan, and which maneuvers of it are which items."""

    plan: imc.PlanSpecification
    item_map: ItemMap


class PlanBuilder:
    """Makes maneuvers of items one by one; speed, level and place hold until an item changes them."""

    def __init__(self, context: ConversionContext, first: int):
        self.context = context
        self.speed: tuple[float, int] = context.usual_speed
        self.level: Level | None = None
        self.place: Place | None = None
        self.pending: list[imc.Message] = []
        self._first = first
        self._maneuvers: list[imc.PlanManeuver] = []
        self._steps: list[tuple[str, ...]] = [()] * first
        self._aloft = context.aloft
        self._landed = self._returned = False

    def begin_item(self) -> None:
        """The maneuvers that follow belong to the next item."""
        self._steps.append(())

    def finish(self) -> ConvertedPlan:
        """The plan. Raises MissionError if there is nothing to do, or too much."""
        made = self._maneuvers
        if not made:
            raise MissionError(MissionResult.INVALID, "the mission has no item that moves the vehicle")
        made[-1] = made[-1].replace(end_actions=tuple(self.pending))
        names = [maneuver.maneuver_id for maneuver in made]
        plan = imc.PlanSpecification(
            plan_id=self.context.name,
            start_man_id=names[0],
            maneuvers=tuple(made),
            transitions=sequential_transitions(names),
        )
        try:
            plan = imc.decode(imc.encode(plan))
        except imc.EncodeError:
            raise MissionError(MissionResult.NO_SPACE, "the mission is too long for one plan") from None
        assert isinstance(plan, imc.PlanSpecification)
        return ConvertedPlan(plan, ItemMap(tuple(self._steps), self._first))

    def add(self, maneuver: imc.Message) -> None:
        """Append a maneuver; an aircraft takes off first, as PX4's do when their mission does not contain a takeoff."""
        if self._returned:
            raise MissionError(MissionResult.INVALID, "comes after a return to launch, which ends a mission")
        if self.context.flies and not isinstance(maneuver, imc.IdleManeuver | imc.Land):
            if not self._aloft and not isinstance(maneuver, imc.Takeoff):
                self._append(self._takeoff(maneuver))
            self._aloft = True
        if isinstance(maneuver, imc.Land):
            self._aloft, self._landed = False, True
        self._append(maneuver)

    def _append(self, maneuver: Any) -> None:
        lat, lon = (getattr(maneuver, axis, 0.0) for axis in ("lat", "lon"))
        margin = maneuver.radius if isinstance(maneuver, imc.Loiter) else 0.0
        area = self.context.area
        if area is not None and not lat == lon == 0.0 and not area_contains(area, lat, lon, margin):
            raise MissionError(MissionResult.INVALID, "is outside the fence, the area of the operational limits")
        name = f"{type(maneuver).__name__}{len(self._steps) - 1}"
        actions = tuple(self.pending)
        self._maneuvers.append(imc.PlanManeuver(maneuver_id=name, data=maneuver, start_actions=actions))
        self._steps[-1] += (name,)
        self.pending.clear()

    def _takeoff(self, maneuver: Any) -> imc.Takeoff:
        if self._landed:
            raise MissionError(MissionResult.INVALID, "flies after a landing; a NAV_TAKEOFF must come between")
        levels = (Level(maneuver.z, maneuver.z_units), self.context.usual_level)
        level = next((level for level in levels if self.context.altitude_above_ground(level) > 0.0), None)
        if level is None:
            raise MissionError(
                MissionResult.INVALID, "flies at the height of the ground; a NAV_TAKEOFF must come before"
            )
        return imc.Takeoff(z=level.z, z_units=level.z_units, speed=self.speed[0], speed_units=self.speed[1])

    def parameter(
        self, item: Item, which: int, lowest: float, highest: float, *, default: float | None = 0.0, what: str
    ) -> float:
        """Parameter `which` (1 to 4) between two limits; NaN means that it is not given. Raises MissionError."""
        value = float(getattr(item, f"param{which}"))
        if math.isnan(value) and default is not None:
            return default
        if not lowest <= value <= highest:
            raise MissionError(PARAMETERS[which - 1], f"{what} {value:g} is not between {lowest:g} and {highest:g}")
        return value

    def radius(self, item: Item, which: int) -> float:
        """The radius (m) in a parameter, negative for counterclockwise; 0 is the usual one."""
        return self.parameter(item, which, -WIDEST, WIDEST, what="radius") or self.context.radius

    def item_position(self, item: Item) -> Place | None:
        """The position (rad) of an item; latitude and longitude 0 are none. Raises MissionError."""
        check_position(item)
        if item.x == 0 and item.y == 0:
            return None
        self.place = math.radians(item.x / DEGREES), math.radians(item.y / DEGREES)
        return self.place

    def fields_for_item(self, item: Item) -> dict[str, Any]:
        """The fields of a maneuver that goes to an item. Raises MissionError."""
        self.level = self.context.level(item.frame, item.z)
        place = self.item_position(item) or self.place
        if place is None:
            raise MissionError(MissionResult.INVALID_PARAM5_X, "has no position, and no item before it has one")
        return self.fields_for_place(place)

    def fields_for_place(self, place: Place) -> dict[str, Any]:
        """The fields of a maneuver that goes to a place at the present level and speed."""
        z, units = self.level or self.context.usual_level
        speed, speed_units = self.speed
        lat, lon = place
        return {"lat": lat, "lon": lon, "z": z, "z_units": units, "speed": speed, "speed_units": speed_units}

    def add_stay(self, place: Place, seconds: float, radius: float) -> None:
        """Add a stay at the present level; of 0 s, one without end. A negative radius is a circle counterclockwise."""
        fields = self.fields_for_place(place)
        fields.update(radius=abs(radius), duration=math.ceil(seconds))
        counter = radius < 0.0 and not (self.context.flies and self.context.keeps_station)
        if self.context.keeps_station and not counter:
            custom = "Under Water=circle" if self.context.dives and fields["z"] > 0.0 else ""
            self.add(imc.StationKeeping(**fields, custom=custom))
        else:
            self.add_circle(fields, counter)

    def add_circle(self, fields: dict[str, Any], counter: bool) -> None:
        """Add a circle."""
        ways = imc.Loiter.Direction
        direction = ways.CCLOCKW if counter else ways.CLOCKW
        self.add(imc.Loiter(**fields, type=imc.Loiter.Type.CIRCULAR, direction=direction))

    def add_surfacing(self, place: Place | None) -> None:
        """Add the way to a place, if there is one, and from there to the surface."""
        if place is not None:
            self.add(imc.Goto(**self.fields_for_place(place)))
        self.level = Level(0.0, Units.DEPTH)
        flags = imc.PopUp.Flags.CURR_POS | imc.PopUp.Flags.WAIT_AT_SURFACE
        fields = self.fields_for_place(place or (0.0, 0.0))
        self.add(imc.PopUp(**fields, duration=SURFACING, radius=self.context.radius, flags=flags))

    def add_landing(self, place: Place | None, **fields: Any) -> None:
        """Add a landing at a place, else where the vehicle is; on the way it keeps its height."""
        leg = self.fields_for_place(place or (0.0, 0.0))
        if self.level is None or place is None:
            leg.update(z=0.0, z_units=Units.NONE)
        self.add(imc.Land(**leg, **fields))

    def end_mission(self) -> None:
        """Let no maneuver follow."""
        self._returned = True

    @property
    def grounded(self) -> bool:
        """Whether the vehicle is an aircraft that has not taken off."""
        return self.context.flies and not self._aloft
