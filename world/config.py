"""Reads the world from the section [World] of a profile, and from the older places of its options."""

import math
from collections.abc import Callable, Mapping
from pathlib import Path

from world.charts import POSITIVE, Chart, ChartWindow, find_chart_suffix, parse_coordinates, read_chart
from world.objects import CLASSES, NorthEast, Waypoint, WorldObject, make_gliders, parse_positions
from world.options import (
    BATHYMETRY_OPTIONS,
    ENVIRONMENT,
    FLAT_OPTIONS,
    OBJECT_OPTIONS,
    OPTIONS,
    WORLD,
    WorldOption,
)
from world.sea import (
    WATER_TYPES,
    Bathymetry,
    BathymetryError,
    OffsetFunction,
    SeaState,
    read_bathymetry,
    read_bathymetry_reference,
    water_visibility,
)
from world.sun import Sun
from world.world import World

Reader = Callable[[str, str], str]
FindFile = Callable[[str, str], Path]

FLAT_BOTTOM = "Simulators.EstimatedState"  # whose option counts where nothing else gives a bottom
PLANES = ("Seabed", "Surface", "Depth")


class WorldError(ValueError):
    """The section [World], or another one that describes the world, is invalid; the text names section and option."""


def read_world(value: Reader, offset: OffsetFunction | None = None, find_file: FindFile | None = None) -> World:
    """The world of a profile; `value(section, option)` returns its texts. Raises WorldError.

    `offset` returns north and east (m) from one latitude and longitude (rad) to another; it is needed only if the
    origin is not that of [Bathymetry]. `find_file(section, option)` returns the file that an option names; without it,
    relative paths begin in the working folder.
    """
    section = _Section(value, WORLD, OPTIONS)
    given = section.numbers("Origin", 2)
    if given and not (abs(given[0]) <= 90.0 and abs(given[1]) <= 180.0):
        raise section.error("Origin", "is not a latitude and a longitude")
    try:
        origin = (math.radians(given[0]), math.radians(given[1])) if given else read_bathymetry_reference(value)
        chart = _read_chart(_Section(value, "Bathymetry", BATHYMETRY_OPTIONS), origin, find_file)
        seabed = _read_seabed(value, section, origin, offset, chart)
    except BathymetryError as error:
        raise WorldError(f"[Bathymetry] {error}") from None
    kind = section.choice("Water Type", ("", *WATER_TYPES))
    if kind and section.is_set("Water Visibility"):
        raise section.error("Water Visibility", f"is that of the Water Type {kind}: set one of both")
    return World(
        origin,
        seabed,
        _read_objects(value, section),
        SeaState(section.number("Wave Height")),
        Sun(math.radians(section.number("Sun Azimuth")), math.radians(section.number("Sun Elevation"))),
        water_visibility(kind) if kind else section.number("Water Visibility"),
        section.number("Air Visibility"),
        kind,
        walls=_read_walls(section),
        caustics=section.number("Caustics"),
        marine_snow=section.number("Marine Snow"),
        waves_move_boats=section.is_set("Wave Height"),
        wave_bearing=math.radians(section.number("Wave Direction")),
        chart=chart,
    )


def older_option_text(value: Reader, section: str, option: str) -> str:
    """The text that counts in the world for an option of an older place: its own, that of [World], or the default.

    Raises WorldError for texts that contradict each other; KeyError if [World] has no such option.
    """
    name = world_option_name(section, option)
    world = _Section(value, WORLD, OPTIONS)
    depth = _depth_elsewhere(value, world) if name == "Out Of Bounds Depth" else None
    return world.text(name) if depth is None else f"{depth}"


def older_places(section: str, option: str) -> tuple[tuple[str, str], ...]:
    """The sections and options that stand for the same option of [World]. Raises KeyError if it has no such option."""
    return OPTIONS[world_option_name(section, option)].older


def world_option_name(section: str, option: str) -> str:
    """The option of [World] for one of an older place. Raises KeyError if there is none."""
    return {place: name for name, known in OPTIONS.items() for place in known.older}[section, option]


def has_same_words(text: str, other: str) -> bool:
    """Whether two texts of an option mean the same: `2 3.0` and `2.0, 3`."""
    return text == other or _words(text) == _words(other)


def _read_chart(section: "_Section", origin: tuple[float, float] | None, find_file: FindFile | None) -> Chart | None:
    """The chart that Data names; None if it has soundings, or nothing. Raises BathymetryError."""
    name = section.text("Data").strip()
    if not find_chart_suffix(name):
        return None
    if origin is None:
        raise BathymetryError(
            f"Data = {name} needs Latitude (degrees) and Longitude (degrees), around which it is read"
        )
    path = Path(name) if find_file is None else find_file("Bathymetry", "Data")
    window = ChartWindow(*origin, section.number("Chart Radius"))
    positive, text = section.choice("Chart Positive", POSITIVE), section.text("Chart Coordinates")
    option = "Chart Coordinates ="
    try:
        coordinates = parse_coordinates(text) if text else None
        option = f"Data = {name}"
        return read_chart(path, window, coordinates, positive)
    except BathymetryError as error:
        raise BathymetryError(f"{option} {error}") from None


def _read_seabed(
    value: Reader,
    section: "_Section",
    origin: tuple[float, float] | None,
    offset: OffsetFunction | None,
    chart: Chart | None,
) -> Bathymetry | None:
    """The bottom; None if the profile has neither soundings, nor a depth, nor a sonar that needs one."""
    radius, level = section.number("Sounding Radius"), section.number("Tide Level")
    elsewhere = _depth_elsewhere(value, section)
    if elsewhere is None and not value(ENVIRONMENT, "Enabled"):
        return None
    default = section.number("Out Of Bounds Depth")
    if chart is not None and origin is not None:
        radius = chart.sounding_radius(radius if section.is_set("Sounding Radius") else None)
        return Bathymetry(chart.soundings.T, radius, default, origin, level)
    return read_bathymetry(value, radius, default if elsewhere is None else elsewhere, level, origin, offset)


def _depth_elsewhere(value: Reader, section: "_Section") -> float | None:
    """The depth (m) where no sounding is near; None if the profile has no bottom."""
    if value("Bathymetry", "Data").strip(", ") or section.is_set("Out Of Bounds Depth"):
        return section.number("Out Of Bounds Depth")
    flat = _Section(value, FLAT_BOTTOM, FLAT_OPTIONS).number("Bottom Depth")
    return flat if flat >= 0.0 else None


def _read_walls(section: "_Section") -> tuple[tuple[NorthEast, NorthEast], ...]:
    found: list[tuple[NorthEast, NorthEast]] = []
    for text in filter(None, map(str.strip, section.text("Walls").split(","))):
        try:
            a, b, c, d = map(float, text.split())
        except ValueError:
            a = b = c = d = math.nan
        if not (math.isfinite(a + b + c + d) and (a, b) != (c, d)):
            raise section.error("Walls", "is not north and east of both ends of each wall")
        found.append(((a, b), (c, d)))
    return tuple(found)


def _read_objects(value: Reader, section: "_Section") -> tuple[WorldObject, ...]:
    text, plane = section.text("Gliders"), section.choice("Gliders Lie On", PLANES)
    try:
        places = parse_positions([] if text == "none" else [word.strip() for word in text.split(",")])
    except ValueError as error:
        raise section.error("Gliders", f"is wrong: {error}") from None
    found = list(make_gliders(places, {"Seabed": None, "Surface": 0.0}.get(plane, section.number("Gliders Depth"))))
    for name in filter(None, map(str.strip, section.text("Objects").split(","))):
        thing = _read_object(_Section(value, f"{WORLD}/{name}", OBJECT_OPTIONS), name, len(found) + 1)
        if thing.id in (other.id for other in found):
            raise WorldError(f"[{WORLD}/{name}] Id = {thing.id} is taken by another object")
        found.append(thing)
    return tuple(found)


def _read_object(section: "_Section", name: str, number: int) -> WorldObject:
    position, rows = section.numbers("Position", 2), section.text("Track").split(",")
    if bool(position) == any(map(str.strip, rows)):
        raise WorldError(f"[{WORLD}] Objects has {name}, so [{section.name}] must have either Position or Track")
    try:
        track = [Waypoint(0.0, *position)] if position else [Waypoint(*map(float, row.split())) for row in rows]
        if not all(math.isfinite(number) for point in track for number in point):
            raise ValueError
    except (TypeError, ValueError):
        raise section.error("Track", "is not time, north and east of waypoints") from None
    plane = section.choice("Lies On", PLANES)
    heading = math.radians(section.number("Heading")) if section.text("Heading") else None
    try:
        return WorldObject(
            round(section.number("Id")) if section.text("Id") else number,
            tuple(track),
            {"Seabed": None, "Surface": 0.0}.get(plane, section.number("Depth")),
            heading,
            section.choice("Class", CLASSES),
            section.number("Length"),
            section.number("Diameter"),
            _squares(section),
            section.number("Square Size"),
        )
    except WorldError:
        raise
    except ValueError as error:
        words = str(error)
        option = "Track" if "track" in words else "Squares" if "squares" in words else "Diameter"
        raise WorldError(f"[{section.name}] {option} {words}") from None


def _squares(section: "_Section") -> tuple[int, int]:
    rows, columns = section.numbers("Squares", 2)
    if not (rows.is_integer() and columns.is_integer()):
        raise section.error("Squares", "is not two whole numbers")
    return int(rows), int(columns)


class _Section:
    """The texts and numbers of a section, also from the older place of an option. All methods raise WorldError."""

    def __init__(self, value: Reader, name: str, options: Mapping[str, WorldOption]):
        self.name = name
        self._value = value
        self._options = options

    def error(self, option: str, reason: str) -> WorldError:
        section, name, text = self._found(option) or (self.name, option, "")
        return WorldError(f"[{section}] {name} = {text} {reason}")

    def is_set(self, option: str) -> bool:
        return self._found(option) is not None

    def text(self, option: str) -> str:
        found = self._found(option)
        return self._options[option].default if found is None else found[2]

    def choice(self, option: str, choices: tuple[str, ...]) -> str:
        text = self.text(option)
        if text not in choices:
            raise self.error(option, f"is not one of {', '.join(choices)}")
        return text

    def number(self, option: str) -> float:
        (number,) = self.numbers(option, 1)
        return number

    def numbers(self, option: str, count: int) -> tuple[float, ...]:
        """`count` finite numbers; none if neither the option nor a default is set."""
        text, known = self.text(option), self._options[option]
        try:
            found = tuple(map(float, text.replace(",", " ").split()))
        except ValueError:
            found = (math.nan,)
        if text and (len(found) != count or not all(map(math.isfinite, found))):
            raise self.error(option, "is not a number" if count == 1 else f"is not {count} numbers")
        if not all(known.least <= number <= known.most for number in found):
            raise self.error(option, f"is not within {known.least:g} and {known.most:g}")
        return found

    def _found(self, option: str) -> tuple[str, str, str] | None:
        """Section, name and text of an option that is set; all places that set it must agree."""
        places = [(self.name, option), *self._options[option].older]
        found = [(*place, text) for place in places if (text := self._value(*place).strip())]
        for section, name, text in found[1:]:
            if _words(text) != _words(found[0][2]):
                raise WorldError(
                    f"[{section}] {name} = {text}, but [{found[0][0]}] {found[0][1]} = {found[0][2]}: there is one "
                    f"world; set [{self.name}] {option} alone"
                )
        return found[0] if found else None


def _words(text: str) -> list[float | str]:
    """The numbers and words of a text."""
    found: list[float | str] = []
    for word in text.replace(",", " ").split():
        try:
            found.append(float(word))
        except ValueError:
            found.append(word)
    return found
