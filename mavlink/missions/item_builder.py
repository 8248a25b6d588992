"""The items of a mission, added one by one by the maneuvers of a plan."""

import math
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from itertools import islice
from typing import Any

import imc
from imc.coordinates import maneuver_corner_offsets
from mavlink.missions.command_conversion import ROUND, UNCHANGED, camera_switch, turns_duration
from mavlink.missions.conversion_context import ConversionContext, Level, shortest_decimal
from mavlink.missions.enums import MISSION, RELATIVE_INT, MissionCommand
from mavlink.missions.item import Item, to_float32
from mavlink.positions import degrees_e7
from support.wgs84 import displace, is_on_earth

Chain = Sequence[imc.PlanManeuver]
OVER_GROUND = 1.0  # kind of speed in DO_CHANGE_SPEED
UNLIMITED = 1000  # points of one maneuver; more than a mission has items


class ItemBuilder:
    """Makes items of maneuvers; `steps` has the maneuvers of each. What items cannot express is left out of them.

    `unset` stands for a yaw that is not given: NaN, or 0 for ArduPilot.
    """

    def __init__(self, context: ConversionContext, unset: float):
        self.context = context
        self.unset = unset
        self.items: list[Item] = []
        self.steps: list[tuple[str, ...]] = []
        self.remarks: list[str] = []
        self.level: Level | None = None
        self._speed = context.usual_speed

    def add_next_maneuvers(self, chain: Chain) -> int:
        """Add the first maneuver of a chain, and those after it that the same item expresses; how many these are."""
        node = chain[0]
        self.switch_camera(node.start_actions)
        taken = MANEUVERS.get(type(node.data), _somewhere)(self, chain)
        for node in chain[:taken]:
            self.switch_camera(node.end_actions)
        return taken

    def add_item(
        self,
        command: MissionCommand,
        chain: Chain,
        at: tuple[float, float] | None,
        level: Level | None,
        *numbers: float,
    ) -> None:
        """Add an item for all maneuvers of `chain`, with parameters 1 to 4; without a position x and y are 0."""
        frame, z = (level and self.context.frame_and_z(level)) or (RELATIVE_INT, 0.0)
        self.level = level or self.level
        lat, lon = at or (0.0, 0.0)
        if not is_on_earth(lat, lon):
            self.remarks.append(f"{chain[0].maneuver_id}: has no position, and is not shown")
            return
        one, two, three, four, *_ = map(to_float32, (*numbers, 0.0, 0.0, 0.0, 0.0))
        self.items.append(Item(frame, int(command), 0, 1, one, two, three, four, degrees_e7(lat), degrees_e7(lon), z))
        self.steps.append(tuple(node.maneuver_id for node in chain))

    def add_command(self, command: MissionCommand, *numbers: float) -> None:
        """Add an item that takes no time."""
        one, two, three, four, *_ = (*numbers, 0.0, 0.0, 0.0, 0.0)
        self.items.append(Item(MISSION, int(command), 0, 1, one, two, three, four))
        self.steps.append(())

    def set_speed(self, maneuver: Any) -> None:
        """Add the speed of a maneuver, if it is new and an item can express it."""
        units = imc.SpeedUnits
        speed = maneuver.speed, maneuver.speed_units
        if speed == self._speed or not 0.0 < maneuver.speed < math.inf:
            return
        if maneuver.speed_units == units.METERS_PS:
            self.add_command(MissionCommand.DO_CHANGE_SPEED, OVER_GROUND, to_float32(maneuver.speed), UNCHANGED)
        elif maneuver.speed_units == units.PERCENTAGE:
            self.add_command(MissionCommand.DO_CHANGE_SPEED, OVER_GROUND, UNCHANGED, to_float32(maneuver.speed))
        else:
            return
        self._speed = speed

    def switch_camera(self, actions: Iterable[imc.Message | None]) -> None:
        """Add items where the camera is switched."""
        context = self.context
        commands = ((True, MissionCommand.IMAGE_START_CAPTURE), (False, MissionCommand.IMAGE_STOP_CAPTURE))
        for action in actions:
            for on, command in commands if context.camera else ():
                if isinstance(action, imc.SetEntityParameters) and _same(action, camera_switch(context, on)):
                    self.add_command(command)

    def yaw_degrees(self, angle: float) -> float:
        """An angle (rad) in degrees."""
        if angle == 0.0 or not abs(angle) <= math.radians(ROUND):
            return self.unset
        return shortest_decimal(math.degrees(angle), lambda short: math.radians(short) == angle)

    def is_at_home(self, maneuver: Any) -> bool:
        """Whether a maneuver goes home; a waypoint at home has its position rounded, and stays one."""
        home = self.context.home
        return home is not None and (maneuver.lat, maneuver.lon) == (home.lat, home.lon)

    def keeps_level(self, maneuver: Any) -> bool:
        """Whether a maneuver stays at the level of the one before."""
        return level_of(maneuver) == (self.level or self.context.usual_level)


def level_of(maneuver: Any) -> Level:
    """The level of a maneuver."""
    return Level(maneuver.z, maneuver.z_units)


def _same(one: imc.SetEntityParameters, other: imc.SetEntityParameters) -> bool:
    entries = [[(p.name, p.value) for p in a.params if isinstance(p, imc.EntityParameter)] for a in (one, other)]
    return one.name == other.name and entries[0] == entries[1]


def _place(maneuver: Any) -> tuple[float, float]:
    return maneuver.lat, maneuver.lon


def _goto(builder: ItemBuilder, chain: Chain) -> int:
    goto: Any = chain[0].data
    after: Any = chain[1].data if len(chain) > 1 else None
    builder.set_speed(goto)
    plain = not chain[0].end_actions and len(chain) > 1 and not chain[1].start_actions
    joined = plain and all(getattr(after, name, None) == getattr(goto, name) for name in ("lat", "lon", "speed"))
    if joined and isinstance(after, imc.StationKeeping) and _holds(builder.context, goto, after):
        numbers = (after.duration, after.radius, 0.0, builder.yaw_degrees(goto.yaw))
        builder.add_item(MissionCommand.NAV_WAYPOINT, chain[:2], _place(goto), level_of(goto), *numbers)
        return 2
    if joined and isinstance(after, imc.PopUp) and after.flags & imc.PopUp.Flags.CURR_POS and builder.keeps_level(goto):
        _land_or_return(builder, chain[:2], last=len(chain) == 2)
        builder.level = level_of(after)
        return 2
    boat = not builder.context.flies and not builder.context.dives
    if boat and len(chain) == 1 and goto.yaw == 0.0 and builder.is_at_home(goto):
        _land_or_return(builder, chain, last=True)
    else:
        builder.add_item(
            MissionCommand.NAV_WAYPOINT, chain[:1], _place(goto), level_of(goto), 0, 0, 0, builder.yaw_degrees(goto.yaw)
        )
    return 1


def _holds(context: ConversionContext, goto: imc.Goto, station: imc.StationKeeping) -> bool:
    """Whether a stay is the hold time of a waypoint."""
    same = level_of(goto) == level_of(station) and goto.speed_units == station.speed_units
    return context.keeps_station and same and station.duration > 0 and station.radius >= context.radius


def _land_or_return(builder: ItemBuilder, chain: Chain, *, last: bool, numbers: Sequence[float] = ()) -> None:
    target: Any = chain[0].data
    if last and builder.is_at_home(target) and not any(number for number in numbers if not math.isnan(number)):
        builder.add_item(MissionCommand.NAV_RETURN_TO_LAUNCH, chain, None, None)
        builder.items[-1] = builder.items[-1]._replace(frame=MISSION)
    else:
        builder.add_item(MissionCommand.NAV_LAND, chain, _place(target), None, *numbers)


def _station(builder: ItemBuilder, chain: Chain) -> int:
    station: Any = chain[0].data
    builder.set_speed(station)
    numbers = (station.duration, 0.0, station.radius, builder.unset)
    command = MissionCommand.NAV_LOITER_TIME if station.duration else MissionCommand.NAV_LOITER_UNLIM
    builder.add_item(command, chain[:1], _place(station), level_of(station), *numbers)
    return 1


def _loiter(builder: ItemBuilder, chain: Chain) -> int:
    loiter: Any = chain[0].data
    builder.set_speed(loiter)
    radius, context = loiter.radius, builder.context
    signed = -radius if loiter.direction == imc.Loiter.Direction.CCLOCKW else radius
    command, first = MissionCommand.NAV_LOITER_TIME, float(loiter.duration)
    if not loiter.duration:
        command = MissionCommand.NAV_LOITER_UNLIM
    elif context.keeps_station and _in_turns(loiter):
        leg = {"speed": loiter.speed, "speed_units": loiter.speed_units}
        turns = loiter.duration * loiter.speed / (math.tau * max(radius, context.tightest))
        command = MissionCommand.NAV_LOITER_TURNS
        first = shortest_decimal(turns, lambda short: turns_duration(short, radius, leg, context) == loiter.duration)
    builder.add_item(command, chain[:1], _place(loiter), level_of(loiter), first, 0.0, signed, builder.unset)
    return 1


def _in_turns(loiter: imc.Loiter) -> bool:
    """Whether the turns in the time of a circle can be counted."""
    known = loiter.speed_units == imc.SpeedUnits.METERS_PS
    return known and 1e-3 < loiter.speed < 1e3 and 1e-3 < loiter.radius < math.inf


def _elevator(builder: ItemBuilder, chain: Chain) -> int:
    elevator: Any = chain[0].data
    builder.set_speed(elevator)
    here = elevator.flags & imc.Elevator.Flags.CURR_POS
    level = Level(elevator.end_z, elevator.end_z_units)
    builder.add_item(
        MissionCommand.NAV_LOITER_TO_ALT, chain[:1], None if here else _place(elevator), level, 0, elevator.radius
    )
    return 1


def _pop_up(builder: ItemBuilder, chain: Chain) -> int:
    pop_up: Any = chain[0].data
    builder.set_speed(pop_up)
    here = pop_up.flags & imc.PopUp.Flags.CURR_POS
    builder.add_item(MissionCommand.NAV_LAND, chain[:1], None if here else _place(pop_up), None)
    builder.level = level_of(pop_up)
    return 1


def _takeoff(builder: ItemBuilder, chain: Chain) -> int:
    takeoff: Any = chain[0].data
    builder.set_speed(takeoff)
    angle = takeoff.takeoff_pitch
    pitch = shortest_decimal(math.degrees(angle), lambda short: to_float32(math.radians(short)) == to_float32(angle))
    builder.add_item(
        MissionCommand.NAV_TAKEOFF, chain[:1], _place(takeoff), level_of(takeoff), pitch + 0.0, 0, 0, builder.unset
    )
    return 1


def _land(builder: ItemBuilder, chain: Chain) -> int:
    land: Any = chain[0].data
    builder.set_speed(land)
    numbers = (land.abort_z, 0.0, 0.0, builder.yaw_degrees(land.bearing))
    _land_or_return(builder, chain[:1], last=len(chain) == 1, numbers=numbers)
    return 1


def _idle(builder: ItemBuilder, chain: Chain) -> int:
    idle: Any = chain[0].data
    if idle.duration:
        builder.add_command(MissionCommand.NAV_DELAY, float(idle.duration), *(-1.0,) * 3)
        builder.steps[-1] = (chain[0].maneuver_id,)
    else:
        builder.remarks.append(f"{chain[0].maneuver_id}: a wait without end is not shown")
    return 1


def _path(builder: ItemBuilder, chain: Chain) -> int:
    path: Any = chain[0].data
    points = [point for point in path.points if isinstance(point, imc.PathPoint)]
    if not points:
        builder.remarks.append(f"{chain[0].maneuver_id}: a path without points is not shown")
    _points(builder, chain, ((point.x, point.y, point.z) for point in points))
    return 1


def _rows(builder: ItemBuilder, chain: Chain) -> int:
    _points(builder, chain, _corners(chain[0].data))
    return 1


def _corners(area: Any) -> Iterator[tuple[float, float, float]]:
    """The corners of rows; raises ValueError only when they are asked for."""
    for north, east in maneuver_corner_offsets(area):
        yield north, east, 0.0


def _points(builder: ItemBuilder, chain: Chain, offsets: Iterable[tuple[float, float, float]]) -> None:
    """A waypoint for each point of a maneuver."""
    maneuver: Any = chain[0].data
    builder.set_speed(maneuver)
    try:
        for north, east, z in islice(offsets, UNLIMITED):
            lat, lon, _ = displace(maneuver.lat, maneuver.lon, 0.0, north, east)
            level = Level(to_float32(maneuver.z + z), maneuver.z_units)
            builder.add_item(MissionCommand.NAV_WAYPOINT, chain[:1], (lat, lon), level, 0.0, 0.0, 0.0, builder.unset)
    except (ArithmeticError, ValueError) as error:
        builder.remarks.append(f"{chain[0].maneuver_id}: is not shown: {error}")


def _somewhere(builder: ItemBuilder, chain: Chain) -> int:
    """Add any other maneuver as a waypoint, if it has a position."""
    maneuver: Any = chain[0].data
    if not _has(maneuver, "lat", "lon"):
        builder.remarks.append(f"{chain[0].maneuver_id}: a {type(maneuver).__name__} is not shown")
        return 1
    if _has(maneuver, "speed", "speed_units"):
        builder.set_speed(maneuver)
    level = level_of(maneuver) if _has(maneuver, "z", "z_units") else None
    builder.add_item(MissionCommand.NAV_WAYPOINT, chain[:1], _place(maneuver), level, 0.0, 0.0, 0.0, builder.unset)
    return 1


def _has(maneuver: Any, *fields: str) -> bool:
    return all(hasattr(maneuver, field) for field in fields)


MANEUVERS: Mapping[type[Any], Callable[[ItemBuilder, Chain], int]] = {
    imc.Goto: _goto,
    imc.StationKeeping: _station,
    imc.Loiter: _loiter,
    imc.Elevator: _elevator,
    imc.PopUp: _pop_up,
    imc.Takeoff: _takeoff,
    imc.Land: _land,
    imc.IdleManeuver: _idle,
    imc.FollowPath: _path,
    imc.Rows: _rows,
    imc.RowsCoverage: _rows,
}
"""Converters of each maneuver to items; all others are waypoints."""
