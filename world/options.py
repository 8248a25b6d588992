"""The options of the sections that describe the world: [World], [World/NAME] and [Bathymetry]."""

import math
from collections.abc import Mapping
from types import MappingProxyType
from typing import NamedTuple

from world.objects import CLASSES, DIAMETER, GLIDER, LENGTH
from world.sea import USUAL_WAVE_HEIGHT, WATER_TYPES

WORLD, ENVIRONMENT, MUG_CAMERA = "World", "Simulators.Environment", "Simulators.MUGDetectionCamera"
DEEPEST = 11000.0  # m


class WorldOption(NamedTuple):
    """An option: its unit, what it means, its default, its limits if it is a number, older places that set it.

    `section_prefix` is what the sections begin with that its items name.
    """

    unit: str
    meaning: str
    default: str = ""
    least: float = -math.inf
    most: float = math.inf
    older: tuple[tuple[str, str], ...] = ()
    section_prefix: str = ""


OPTIONS: Mapping[str, WorldOption] = MappingProxyType(
    {
        "Origin": WorldOption("°", "Latitude and longitude from which places count; by default those of [Bathymetry]."),
        "Sounding Radius": WorldOption(
            "m",
            "Distance within which a sounding is used; that of a chart follows from its cells.",
            "10",
            0.1,
            older=((ENVIRONMENT, "Sounding Radius"),),
        ),
        "Out Of Bounds Depth": WorldOption(
            "m",
            "Depth where no sounding is near.",
            "120",
            -DEEPEST,
            DEEPEST,
            ((ENVIRONMENT, "Out Of Bounds Depth"),),
        ),
        "Tide Level": WorldOption(
            "m", "Height of the tide above the soundings' datum.", "0", -20.0, 20.0, ((ENVIRONMENT, "Tide Level"),)
        ),
        "Wave Height": WorldOption(
            "m",
            "Significant height of the waves in pictures; if it is set, boats feel them.",
            f"{USUAL_WAVE_HEIGHT}",
            0.0,
            30.0,
        ),
        "Wave Direction": WorldOption(
            "°", "Where the waves that boats feel come from, from north.", "0", -360.0, 360.0
        ),
        "Water Visibility": WorldOption("m", "Distance at which 2 % of the contrast is left in water.", "60", 0.1, 1e6),
        "Water Type": WorldOption("", f"Instead of a visibility: Jerlov's type of water, {', '.join(WATER_TYPES)}."),
        "Air Visibility": WorldOption("m", "The same in air.", "20000", 0.1, 1e6),
        "Marine Snow": WorldOption("1/m³", "Flakes in the water that cameras see.", "0", 0.0, 1e5),
        "Caustics": WorldOption("1", "Share of sun without clouds that waves gather on the bottom.", "0", 0.0, 1.0),
        "Sun Azimuth": WorldOption("°", "Where the sun stands, from north.", "0", -360.0, 360.0),
        "Sun Elevation": WorldOption("°", "How high it stands; negative at night.", "90", -90.0, 90.0),
        "Gliders": WorldOption(
            "m",
            'North and east of each glider (MUG), from the origin: "1.0 0.3, 25 5"; "none" for none; ids from 1.',
            "1.0 0.3",
            older=((MUG_CAMERA, "MUGs"), ("Vision.FisheyeCamera", "MUGs")),
        ),
        "Gliders Lie On": WorldOption(
            "", "Seabed, Surface, or Depth for that of Gliders Depth.", "Seabed", older=((MUG_CAMERA, "Target Plane"),)
        ),
        "Gliders Depth": WorldOption(
            "m", "Depth of the gliders, if they lie on none of both.", "0", 0, DEEPEST, ((MUG_CAMERA, "Target Depth"),)
        ),
        "Walls": WorldOption(
            "m",
            'Walls from bottom to surface: north and east of both ends of each, "0 0 20 0, 20 0 20 30".',
        ),
        "Objects": WorldOption(
            "", "Names of further objects, each of which has a section [World/NAME].", section_prefix=f"{WORLD}/"
        ),
    }
)
OBJECT_OPTIONS: Mapping[str, WorldOption] = MappingProxyType(
    {
        "Class": WorldOption("", f"What it is: {', '.join(CLASSES)}.", GLIDER),
        "Id": WorldOption("1", "Its number; by default the next one.", "", 0.0, 255.0),
        "Position": WorldOption("m", "North and east of the origin."),
        "Track": WorldOption("s, m", 'Instead of a position: time, north and east of waypoints: "0 1 0.3, 60 20 5".'),
        "Heading": WorldOption("°", "Where it looks; by default where it goes.", "", -360.0, 360.0),
        "Lies On": WorldOption("", "Seabed, Surface, or Depth for that of its option Depth.", "Seabed"),
        "Depth": WorldOption("m", "Its depth, if it lies on none of both.", "0", 0.0, DEEPEST),
        "Length": WorldOption("m", "Its length.", f"{LENGTH}", 0.01, 1000.0),
        "Diameter": WorldOption("m", "Its diameter.", f"{DIAMETER}", 0.01, 1000.0),
        "Squares": WorldOption("1", "Rows and columns of squares, or of tags, of a board.", "6, 9", 1.0, 100.0),
        "Square Size": WorldOption("m", "Width of a square of a chessboard, or of a tag.", "0.05", 0.001, 10.0),
    }
)
BATHYMETRY_OPTIONS: Mapping[str, WorldOption] = MappingProxyType(
    {
        "Latitude (degrees)": WorldOption("°", "Latitude from which the soundings count."),
        "Longitude (degrees)": WorldOption("°", "Longitude from which they count."),
        "Data": WorldOption(
            "m", "Soundings: north, east and depth, one after the other: 1 0 4.5, 4 1 4.4; or the file of a chart."
        ),
        "Chart Radius": WorldOption("m", "How far around the origin a chart is read.", "2000", 1.0, 100e3),
        "Chart Coordinates": WorldOption("", "Those of a chart that does not name its own, such as EPSG:32629."),
        "Chart Positive": WorldOption(
            "", "up for a chart of elevations, down for depths; by default that of its file."
        ),
    }
)
FLAT_OPTIONS: Mapping[str, WorldOption] = MappingProxyType({"Bottom Depth": WorldOption("m", "", "-1", -1.0, DEEPEST)})
SECTIONS: Mapping[str, Mapping[str, WorldOption]] = MappingProxyType(
    {WORLD: OPTIONS, f"{WORLD}/": OBJECT_OPTIONS, "Bathymetry": BATHYMETRY_OPTIONS}
)
