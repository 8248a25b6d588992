"""A plan, and the landing of a plane, as the mission of an autopilot; the item to which a path of the plan belongs."""

import math
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field
from typing import Any, NamedTuple

import imc
from autonomy.plans import main_sequence
from imc.coordinates import maneuver_corner_offsets
from mavlink.autopilot.leg import Leg, ReportedPosition, path_height_above_home
from mavlink.autopilot.setpoints import AIR_SPEED, GLOBAL, GROUND_SPEED, RELATIVE
from mavlink.autopilot.vehicle_modes import SteeredVehicle
from mavlink.missions import Item, MissionCommand
from mavlink.positions import degrees_e7
from support.wgs84 import displace, ground_distance

NO_PLACE = 2  # MAV_FRAME of an item that has none
EXTRA_TIME = 10.0  # s by which the autopilot's times are longer: Shoal advances first while it runs
MOST_TURNS = 200
STEEP = 15.0  # °; a plane's pitch as it takes off
SAME_PLACE = 1.0  # m
PASSING = 0.6  # of the length of an approach: where a plane crosses this part of its height
TO_ALT_TOWARDS_NEXT = 1.0
WINDLESS = 1.0  # m/s


class LandingApproach(NamedTuple):
    """Landing of a plane: length (m) and height (m) of the final leg, and its course (rad)."""

    length: float
    height: float
    course: float


def choose_landing_approach(
    length: float,
    height: float,
    course: float | None,
    wind: imc.EstimatedStreamVelocity | None,
    position: ReportedPosition,
) -> LandingApproach:
    """The approach on a course (rad); without one against the wind, and straight on if there is none."""
    if course is None:
        blows = wind is not None and math.hypot(wind.x, wind.y) > WINDLESS
        course = math.atan2(-wind.y, -wind.x) if wind is not None and blows else position.psi
    return LandingApproach(length, height, course)


@dataclass(slots=True)
class MissionBuilder:
    """Makes items of the maneuvers of one plan. Raises ValueError for what no item can express.

    `undulation` (m) is that of the geoid, `position` where the vehicle is as the plan begins.
    """

    vehicle: SteeredVehicle
    position: ReportedPosition
    undulation: float
    approach: LandingApproach
    items: list[Item] = field(default_factory=list[Item])
    _speed: float = 0.0
    _place: tuple[float, float] = (0.0, 0.0)

    def build_plan_items(self, plan: imc.PlanSpecification) -> list[Item]:
        """The items of a plan."""
        chain, remarks = main_sequence(plan)
        if remarks:
            raise ValueError(remarks[0])
        self._place = self.position.lat, self.position.lon
        if not self.vehicle.px4:
            self.add_item(
                MissionCommand.NAV_WAYPOINT, self._place, self.position.amsl - self.position.above_home, frame=GLOBAL
            )
        for node in chain:
            writer = WRITERS.get(type(node.data))
            try:
                if writer is None:
                    raise ValueError(f"an autopilot does not support {type(node.data).__name__}")
                writer(self, node.data)
            except (ValueError, ArithmeticError) as error:
                raise ValueError(f"{node.maneuver_id}: {error}") from None
        return self.items

    def build_landing_items(self, lat: float, lon: float) -> list[Item]:
        """A plane's landing alone."""
        if not self.vehicle.px4:
            self.add_item(
                MissionCommand.NAV_WAYPOINT, (lat, lon), self.position.amsl - self.position.above_home, frame=GLOBAL
            )
        self.add_landing_approach(lat, lon)
        return self.items

    def add_item(
        self, command: MissionCommand, place: tuple[float, float], height: float, *numbers: float, frame: int = RELATIVE
    ) -> None:
        one, two, three, four, *_ = (*numbers, 0.0, 0.0, 0.0, 0.0)
        lat, lon = map(degrees_e7, place)
        self.items.append(Item(frame, int(command), 0, 1, one, two, three, four, lat, lon, height))

    def add_command(self, command: MissionCommand, *numbers: float) -> None:
        """An item without a place."""
        one, two, three, four, *_ = (*numbers, 0.0, 0.0, 0.0, 0.0)
        self.items.append(Item(NO_PLACE, int(command), 0, 1, one, two, three, four))

    def height(self, maneuver: Any, more: float = 0.0) -> float:
        """Height above home (m)."""
        path = imc.DesiredPath(end_z=maneuver.z + more, end_z_units=maneuver.z_units)
        vehicle = self.vehicle
        return path_height_above_home(path, self.position, self.undulation, flies=vehicle.flies, dives=vehicle.dives)

    def set_speed(self, maneuver: Any) -> None:
        if maneuver.speed_units != imc.SpeedUnits.METERS_PS or not maneuver.speed > 0.0:
            raise ValueError("the speed for an autopilot must be in m/s, and more than 0")
        if maneuver.speed != self._speed:
            self._speed = maneuver.speed
            self.add_command(
                MissionCommand.DO_CHANGE_SPEED, AIR_SPEED if self.vehicle.roams else GROUND_SPEED, maneuver.speed, -1.0
            )

    def add_waypoint(
        self, maneuver: Any, *numbers: float, command: MissionCommand = MissionCommand.NAV_WAYPOINT
    ) -> None:
        """An item at the place of a maneuver."""
        self.set_speed(maneuver)
        self._place = maneuver.lat, maneuver.lon
        self.add_item(command, self._place, self.height(maneuver), *numbers)

    def add_points(self, maneuver: Any, offsets: Sequence[tuple[float, float, float]]) -> None:
        self.set_speed(maneuver)
        for north, east, up in offsets:
            self._place = displace(maneuver.lat, maneuver.lon, 0.0, north, east)[:2]
            self.add_item(MissionCommand.NAV_WAYPOINT, self._place, self.height(maneuver, up))

    def add_landing_approach(self, lat: float, lon: float) -> None:
        """Down to the height of the approach in circles, then straight on to the ground."""
        final = self.approach
        for part, command in ((1.0, MissionCommand.NAV_LOITER_TO_ALT), (PASSING, MissionCommand.NAV_WAYPOINT)):
            back = -part * final.length
            place = displace(lat, lon, 0.0, back * math.cos(final.course), back * math.sin(final.course))[:2]
            numbers = (TO_ALT_TOWARDS_NEXT,) if command is MissionCommand.NAV_LOITER_TO_ALT else ()
            self.add_item(command, place, part * final.height, *numbers)
        self.add_item(MissionCommand.NAV_LAND, (lat, lon), 0.0)

    def add_takeoff(self, takeoff: imc.Takeoff) -> None:
        self.add_item(
            MissionCommand.NAV_TAKEOFF, self._place, self.height(takeoff), STEEP if self.vehicle.roams else 0.0
        )

    def add_landing(self, land: imc.Land) -> None:
        lat, lon = (land.lat, land.lon) if (land.lat, land.lon) != (0.0, 0.0) else self._place
        if self.vehicle.roams:
            self.add_landing_approach(lat, lon)
        else:
            self.add_item(MissionCommand.NAV_LAND, (lat, lon), 0.0)

    def add_stay(self, station: Any) -> None:
        """Hover, or circle if it cannot."""
        if station.duration:
            self.add_waypoint(station, station.duration + EXTRA_TIME, command=MissionCommand.NAV_LOITER_TIME)
        else:
            self.add_waypoint(station, command=MissionCommand.NAV_LOITER_UNLIM)

    def add_circle(self, loiter: imc.Loiter) -> None:
        forms, vehicle = imc.Loiter.Type, self.vehicle
        if loiter.type == forms.EIGHT:
            raise ValueError("an autopilot has no figures of eight")
        if loiter.type == forms.HOVER and not vehicle.roams:
            self.add_stay(loiter)
            return
        radius = -loiter.radius if loiter.direction == imc.Loiter.Direction.CCLOCKW else loiter.radius
        if vehicle.px4 and not vehicle.roams:
            raise ValueError("PX4 has no circles in missions of this vehicle")
        if not loiter.duration and not vehicle.roams:
            raise ValueError("a circle without end is not known in missions of this vehicle")
        if not loiter.duration:
            self.add_waypoint(loiter, 0.0, 0.0, radius, command=MissionCommand.NAV_LOITER_UNLIM)
        elif vehicle.px4 or not loiter.radius:
            self.add_waypoint(loiter, loiter.duration + EXTRA_TIME, 0.0, radius, command=MissionCommand.NAV_LOITER_TIME)
        else:
            turns = math.ceil(loiter.duration * loiter.speed / (math.tau * loiter.radius)) + 1
            if turns > MOST_TURNS:
                raise ValueError(f"{turns} turns are more than {MOST_TURNS}")
            self.add_waypoint(loiter, float(turns), 0.0, radius, command=MissionCommand.NAV_LOITER_TURNS)

    def add_wait(self, idle: imc.IdleManeuver) -> None:
        if not idle.duration or self.vehicle.roams:
            raise ValueError("a plane cannot wait" if self.vehicle.roams else "a wait without end is no item")
        self.add_command(MissionCommand.NAV_DELAY, idle.duration + EXTRA_TIME, -1.0, -1.0, -1.0)


WRITERS: Mapping[type[Any], Callable[[MissionBuilder, Any], None]] = {
    imc.Goto: MissionBuilder.add_waypoint,
    imc.StationKeeping: MissionBuilder.add_stay,
    imc.Loiter: MissionBuilder.add_circle,
    imc.FollowPath: lambda w, path: w.add_points(
        path, [(p.x, p.y, p.z) for p in path.points if isinstance(p, imc.PathPoint)]
    ),
    imc.Rows: lambda w, area: w.add_points(area, [(north, east, 0.0) for north, east in maneuver_corner_offsets(area)]),
    imc.Takeoff: MissionBuilder.add_takeoff,
    imc.Land: MissionBuilder.add_landing,
    imc.IdleManeuver: MissionBuilder.add_wait,
}
"""Converters of each maneuver to items."""

ARRIVALS = frozenset(
    {
        MissionCommand.NAV_WAYPOINT,
        MissionCommand.NAV_LOITER_UNLIM,
        MissionCommand.NAV_LOITER_TIME,
        MissionCommand.NAV_LOITER_TURNS,
        MissionCommand.NAV_TAKEOFF,
        MissionCommand.NAV_LAND,
    }
)


def find_leg_item(leg: Leg, items: Sequence[Item], begin: int) -> int | None:
    """The number of the item that leads along a leg, at `begin` or later; None if there is none."""
    wanted = MissionCommand.NAV_TAKEOFF if leg.takes_off else MissionCommand.NAV_LAND if leg.lands else None
    for number, item in enumerate(items[begin:], begin):
        if item.command not in ARRIVALS or (wanted is not None and item.command != wanted):
            continue
        away = ground_distance(math.radians(item.x / 1e7), math.radians(item.y / 1e7), leg.lat, leg.lon)
        if wanted is not None or away <= SAME_PLACE:
            return number
    return None


def item_group_start(items: Sequence[Item], item: int) -> int:
    """The first of the items without a place that belong to an item: they set the speed, or lead to the landing."""
    land = items[item].command == MissionCommand.NAV_LAND
    while item > 0 and (items[item - 1].frame == NO_PLACE or (land and _leads_down(items, item))):
        item -= 1
    return item


def _leads_down(items: Sequence[Item], item: int) -> bool:
    to_alt = MissionCommand.NAV_LOITER_TO_ALT
    return any(each.command == to_alt for each in items[max(0, item - 2) : item])
