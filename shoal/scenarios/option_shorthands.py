"""Short words for options of profiles: where and how a vehicle starts, and what its world is like."""

import math
from collections.abc import Iterator, Mapping
from types import MappingProxyType

from autonomy.plans.yaml import parse_position, split_quantity
from runtime.profile import Profile
from shoal.scenarios.scenario import ScenarioSetting
from shoal.scenarios.value_reader import (
    convert_node_value,
    read_mapping,
    read_nonempty_text,
    read_number,
    read_option_number,
    read_option_text,
    read_seconds,
)
from support.located_yaml import Node
from support.terminal_text import with_suggestion
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
CHART: Mapping[str, str] = MappingProxyType(
    {"radius": "Chart Radius", "coordinates": "Chart Coordinates", "positive": "Chart Positive"}
)
COMPASS = ("North", "East", "Down")
WORLD_KEYS = ("current", "wind", "objects", "bathymetry", *(name.lower() for name in SECTIONS["World"]))


class EnabledTasks:
    """The sections of a profile that run in the modes of a vehicle."""

    def __init__(self, profile: Profile, modes: frozenset[str]):
        self.names: list[str] = [name for name in profile.config.sections if profile.is_task_enabled(name, modes)]

    def sections_of(self, task: str) -> list[str]:
        """The sections of a task, also those with an instance."""
        return [name for name in self.names if name.partition("/")[0] == task]


def start_settings(node: Node, tasks: EnabledTasks) -> list[ScenarioSetting]:
    """The options that a `start` stands for. Raises the error of the file, also if the vehicle has none of them."""
    found: list[ScenarioSetting] = []
    for key, item in read_mapping(node, "at", "time", *START).items():
        if key == "time":
            found.append(ScenarioSetting("General", "Start Time", read_nonempty_text(item), item.where))
            continue
        made = list(_place(item, tasks) if key == "at" else _start(item, START[key], tasks))
        if not made:
            item.fail(f"this vehicle has no option for {key}")
        found += made
    return found


def _start(node: Node, places: tuple[tuple[str, str, str], ...], tasks: EnabledTasks) -> Iterator[ScenarioSetting]:
    for task, option, unit in places:
        for section in tasks.sections_of(task):
            yield ScenarioSetting(section, option, repr(read_option_number(node, unit)), node.where)


def _place(node: Node, tasks: EnabledTasks) -> Iterator[ScenarioSetting]:
    lat, lon = map(math.degrees, convert_node_value(node, parse_position))
    for section in tasks.sections_of(RECEIVER):
        yield ScenarioSetting(section, "Initial Position", f"{lat!r}, {lon!r}", node.where)
    for section in tasks.sections_of(KINEMATIC):
        yield ScenarioSetting(section, "Start Latitude", repr(lat), node.where)
        yield ScenarioSetting(section, "Start Longitude", repr(lon), node.where)


def world_settings(node: Node, tasks: EnabledTasks) -> list[ScenarioSetting]:
    """The options that `world` stands for, of those that the vehicle has. Raises the error of the file."""
    found: list[ScenarioSetting] = []
    for key, item in read_mapping(node, *WORLD_KEYS).items():
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
            found.append(setting_with_unit("World", option, SECTIONS["World"][option].unit, item))
    return found


def _current(node: Node, tasks: EnabledTasks) -> Iterator[ScenarioSetting]:
    parts = read_mapping(node, "north", "east", "down", "deviation", "time constant")
    speeds = {key: read_number(item, "m/s") for key, item in parts.items() if key != "time constant"}
    sections = [] if tasks.sections_of(DRONE) else tasks.sections_of(STREAM)
    for key in ("north", "east", "down"):
        if key in speeds:
            for section in sections:
                yield ScenarioSetting(section, f"Default Speed {key.title()}", repr(speeds[key]), parts[key].where)
            for section in tasks.sections_of(KINEMATIC) if key != "down" else ():
                yield ScenarioSetting(section, f"Current {key.title()}", repr(speeds[key]), parts[key].where)
    yield from _wander(parts, sections)


def _wind(node: Node, tasks: EnabledTasks) -> Iterator[ScenarioSetting]:
    parts = read_mapping(node, "speed", "from", "gusts", "deviation", "time constant")
    speed = read_number(parts["speed"], "m/s") if "speed" in parts else 0.0
    bearing = read_option_number(parts["from"], "°") if "from" in parts else 0.0
    for section in tasks.sections_of(WIND):
        yield ScenarioSetting(section, "Speed", repr(speed), node.where)
        yield ScenarioSetting(section, "Direction", repr(bearing), node.where)
        for key, option in (("gusts", "Gusts"), ("time constant", "Time Constant")):
            if key in parts:
                value = read_seconds(parts[key]) if key == "time constant" else read_number(parts[key], "m/s")
                yield ScenarioSetting(section, option, repr(value), parts[key].where)
    if tasks.sections_of(DRONE):
        toward = math.radians(bearing) + math.pi
        for section in tasks.sections_of(STREAM):
            north, east = speed * math.cos(toward), speed * math.sin(toward)
            yield ScenarioSetting(section, "Default Speed North", repr(north), node.where)
            yield ScenarioSetting(section, "Default Speed East", repr(east), node.where)
        deviation = {"deviation": parts["gusts"]} if "gusts" in parts else {}
        yield from _wander({**parts, **deviation}, tasks.sections_of(STREAM))


def _wander(parts: Mapping[str, Node], sections: list[str]) -> Iterator[ScenarioSetting]:
    """A deviation makes the velocity wander about its mean."""
    for section in sections:
        if "deviation" in parts:
            node = parts["deviation"]
            yield ScenarioSetting(section, "Stream Velocity Source", "Gauss-Markov", node.where)
            yield ScenarioSetting(section, "Standard Deviation", repr(read_number(node, "m/s")), node.where)
        if "time constant" in parts:
            yield ScenarioSetting(
                section, "Time Constant", repr(read_seconds(parts["time constant"])), parts["time constant"].where
            )


def _objects(node: Node) -> Iterator[ScenarioSetting]:
    options = SECTIONS["World/"]
    names = {name.lower(): name for name in options}
    things = node.mapping()
    yield ScenarioSetting("World", "Objects", ", ".join(things), node.where)
    for name, thing in things.items():
        for key, item in thing.mapping().items():
            if key not in names:
                item.fail(with_suggestion(f"an object has no {key!r}", key, names))
            yield setting_with_unit(f"World/{name}", names[key], options[names[key]].unit, item)


def _bathymetry(node: Node) -> Iterator[ScenarioSetting]:
    parts = read_mapping(node, "at", "soundings", "chart", *CHART)
    if "at" in parts:
        lat, lon = map(math.degrees, convert_node_value(parts["at"], parse_position))
        yield ScenarioSetting(BOTTOM, "Latitude (degrees)", repr(lat), parts["at"].where)
        yield ScenarioSetting(BOTTOM, "Longitude (degrees)", repr(lon), parts["at"].where)
    if "chart" in parts:
        if "soundings" in parts:
            parts["soundings"].fail("the bottom has either soundings or a chart")
        yield ScenarioSetting(BOTTOM, "Data", read_nonempty_text(parts["chart"]), parts["chart"].where)
    for key, option in CHART.items():
        if key in parts:
            yield setting_with_unit(BOTTOM, option, SECTIONS[BOTTOM][option].unit, parts[key])
    if "soundings" in parts:
        if parts["soundings"].content == []:
            parts["soundings"].fail("there is no sounding")
        rows = [" ".join(repr(read_number(cell, "m")) for cell in row.items()) for row in parts["soundings"].items()]
        yield ScenarioSetting(BOTTOM, "Data", ", ".join(rows), parts["soundings"].where)


def setting_with_unit(section: str, option: str, unit: str, node: Node) -> ScenarioSetting:
    """An option of the world, with its number in this unit. Raises the error of the file."""
    if unit and isinstance(node.content, str) and _is_quantity(node):
        return ScenarioSetting(section, option, repr(read_option_number(node, "" if unit == "1" else unit)), node.where)
    return ScenarioSetting(section, option, read_option_text(node), node.where)


def _is_quantity(node: Node) -> bool:
    """Whether the value is a number with a unit."""
    try:
        return bool(split_quantity(node.value())[1])
    except ValueError:
        return False
