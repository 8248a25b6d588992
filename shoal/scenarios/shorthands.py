"""Short words for options of profiles: where and how a vehicle starts, and what its world is like."""

import math
from collections.abc import Iterator, Mapping
from types import MappingProxyType

from autonomy.plans.yaml import parse_position, split_quantity
from runtime.profile import Profile
from shoal.scenarios.scenario import Setting
from shoal.scenarios.values import known, number, option_number, option_text, seconds, told, word
from support.located_yaml import Node
from support.text import with_suggestion
from world import SECTIONS

STREAM, WIND, DRONE = "Simulators.StreamVelocity", "Simulators.Wind", "Simulators.UAV"
KINEMATIC, RECEIVER, BOTTOM = "Simulators.EstimatedState", "Simulators.GPS", "Bathymetry"
START: Mapping[str, tuple[tuple[str, str, str], ...]] = MappingProxyType(
    {
        "heading": (
            ("Simulators.VSIM", "Initial Heading", "°"),
            (DRONE, "Initial Heading", "°"),
            (KINEMATIC, "Start Heading", "°"),
        ),
        "depth": (("Simulators.VSIM", "Initial Depth", "m"), ("Navigation.AUV.Navigation", "Initial Depth", "m")),
        "level": (("Simulators.Battery", "Initial Level", "%"), ("Monitors.FuelLevel", "Initial Level", "%")),
    }
)
COMPASS = ("North", "East", "Down")
WORLD_KEYS = ("current", "wind", "objects", "bathymetry", *(name.lower() for name in SECTIONS["World"]))


class Tasks:
    """The sections of a profile that run in the modes of a vehicle."""

    def __init__(self, profile: Profile, modes: frozenset[str]):
        self.names = [name for name in profile.config.sections if profile.enabled(name, modes)]

    def of(self, task: str) -> list[str]:
        """The sections of a task, also those with an instance."""
        return [name for name in self.names if name.partition("/")[0] == task]


def start_settings(node: Node, tasks: Tasks) -> list[Setting]:
    """The options that a `start` stands for. Raises the error of the file, also if the vehicle has none of them."""
    found: list[Setting] = []
    for key, item in known(node, "at", "time", *START).items():
        if key == "time":
            found.append(Setting("General", "Start Time", word(item), item.where))
            continue
        made = list(_place(item, tasks) if key == "at" else _start(item, START[key], tasks))
        if not made:
            item.fail(f"this vehicle has no option for {key}")
        found += made
    return found


def _start(node: Node, places: tuple[tuple[str, str, str], ...], tasks: Tasks) -> Iterator[Setting]:
    for task, option, unit in places:
        for section in tasks.of(task):
            yield Setting(section, option, repr(option_number(node, unit)), node.where)


def _place(node: Node, tasks: Tasks) -> Iterator[Setting]:
    lat, lon = map(math.degrees, told(node, parse_position))
    for section in tasks.of(RECEIVER):
        yield Setting(section, "Initial Position", f"{lat!r}, {lon!r}", node.where)
    for section in tasks.of(KINEMATIC):
        yield Setting(section, "Start Latitude", repr(lat), node.where)
        yield Setting(section, "Start Longitude", repr(lon), node.where)


def world_settings(node: Node, tasks: Tasks) -> list[Setting]:
    """The options that `world` stands for, of those that the vehicle has. Raises the error of the file."""
    found: list[Setting] = []
    for key, item in known(node, *WORLD_KEYS).items():
        if key == "current":
            found += _current(item, tasks)
        elif key == "wind":
            found += _wind(item, tasks)
        elif key == "objects":
            found += _objects(item)
        elif key == "bathymetry":
            found += _bathymetry(item)
        else:
            option = next(name for name in SECTIONS["World"] if name.lower() == key)
            found.append(shared_setting("World", option, SECTIONS["World"][option].unit, item))
    return found


def _current(node: Node, tasks: Tasks) -> Iterator[Setting]:
    parts = known(node, "north", "east", "down", "deviation", "time constant")
    speeds = {key: number(item, "m/s") for key, item in parts.items() if key != "time constant"}
    sections = [] if tasks.of(DRONE) else tasks.of(STREAM)
    for key in ("north", "east", "down"):
        if key in speeds:
            for section in sections:
                yield Setting(section, f"Default Speed {key.title()}", repr(speeds[key]), parts[key].where)
            for section in tasks.of(KINEMATIC) if key != "down" else ():
                yield Setting(section, f"Current {key.title()}", repr(speeds[key]), parts[key].where)
    yield from _wander(parts, sections)


def _wind(node: Node, tasks: Tasks) -> Iterator[Setting]:
    parts = known(node, "speed", "from", "gusts", "deviation", "time constant")
    speed = number(parts["speed"], "m/s") if "speed" in parts else 0.0
    bearing = option_number(parts["from"], "°") if "from" in parts else 0.0
    for section in tasks.of(WIND):
        yield Setting(section, "Speed", repr(speed), node.where)
        yield Setting(section, "Direction", repr(bearing), node.where)
        for key, option in (("gusts", "Gusts"), ("time constant", "Time Constant")):
            if key in parts:
                value = seconds(parts[key]) if key == "time constant" else number(parts[key], "m/s")
                yield Setting(section, option, repr(value), parts[key].where)
    if tasks.of(DRONE):
        toward = math.radians(bearing) + math.pi
        for section in tasks.of(STREAM):
            north, east = speed * math.cos(toward), speed * math.sin(toward)
            yield Setting(section, "Default Speed North", repr(north), node.where)
            yield Setting(section, "Default Speed East", repr(east), node.where)
        deviation = {"deviation": parts["gusts"]} if "gusts" in parts else {}
        yield from _wander({**parts, **deviation}, tasks.of(STREAM))


def _wander(parts: Mapping[str, Node], sections: list[str]) -> Iterator[Setting]:
    """A deviation makes the velocity wander about its mean."""
    for section in sections:
        if "deviation" in parts:
            node = parts["deviation"]
            yield Setting(section, "Stream Velocity Source", "Gauss-Markov", node.where)
            yield Setting(section, "Standard Deviation", repr(number(node, "m/s")), node.where)
        if "time constant" in parts:
            yield Setting(section, "Time Constant", repr(seconds(parts["time constant"])), parts["time constant"].where)


def _objects(node: Node) -> Iterator[Setting]:
    options = SECTIONS["World/"]
    names = {name.lower(): name for name in options}
    things = node.mapping()
    yield Setting("World", "Objects", ", ".join(things), node.where)
    for name, thing in things.items():
        for key, item in thing.mapping().items():
            if key not in names:
                item.fail(with_suggestion(f"an object has no {key!r}", key, names))
            yield shared_setting(f"World/{name}", names[key], options[names[key]].unit, item)


def _bathymetry(node: Node) -> Iterator[Setting]:
    parts = known(node, "at", "soundings")
    if "at" in parts:
        lat, lon = map(math.degrees, told(parts["at"], parse_position))
        yield Setting(BOTTOM, "Latitude (degrees)", repr(lat), parts["at"].where)
        yield Setting(BOTTOM, "Longitude (degrees)", repr(lon), parts["at"].where)
    if "soundings" in parts:
        if parts["soundings"].content == []:
            parts["soundings"].fail("there is no sounding")
        rows = [" ".join(repr(number(cell, "m")) for cell in row.items()) for row in parts["soundings"].items()]
        yield Setting(BOTTOM, "Data", ", ".join(rows), parts["soundings"].where)


def shared_setting(section: str, option: str, unit: str, node: Node) -> Setting:
    """An option of the world, with its number in this unit. Raises the error of the file."""
    if unit and isinstance(node.content, str) and _is_quantity(node):
        return Setting(section, option, repr(option_number(node, "" if unit == "1" else unit)), node.where)
    return Setting(section, option, option_text(node), node.where)


def _is_quantity(node: Node) -> bool:
    """Whether it is a number with a unit."""
    try:
        return bool(split_quantity(node.value())[1])
    except ValueError:
        return False
