"""Reads plans from files: Shoal's own, and missions of other programs."""

import math
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path

import imc
from autonomy.plans.yaml import PlanFileError, maneuver_lines, parse_plan
from mavlink import FLAVORS, KINDS, home_at
from mavlink.missions import (
    BadItem,
    ConversionContext,
    Item,
    MissionCommand,
    MissionFile,
    MissionFileError,
    home_item,
    plan_of,
    read_qgc_plan,
    read_waypoints,
)
from shoal.missions.route_file import ROUTE_READERS, RoutePoint
from support.located_yaml import read_text

RELATIVE, TERRAIN = 3, 10  # MAV_FRAME
DEGREES = 1e7
QGC_SUFFIX, WAYPOINTS_SUFFIX = ".plan", ".waypoints"
OTHERS = {".kmz": "unzip it, the KML is inside", ".csv": "", ".mission": "", ".gpkg": "", ".shp": ""}
MISSION_SUFFIXES = (QGC_SUFFIX, WAYPOINTS_SUFFIX, *ROUTE_READERS)
PLAN_SUFFIXES = (".yaml", ".yml", ".json", *MISSION_SUFFIXES)
SUBMARINE = ConversionContext(KINDS["submarine"])


def load_plan(
    path: Path, context: ConversionContext | None = None, *, remark: Callable[[str], object] = lambda _: None
) -> imc.PlanSpecification:
    """The plan in a YAML or JSON file, or in a mission file of another program by its suffix: see PLAN_SUFFIXES.

    `context` is the vehicle for which a mission is converted, by default the kind that the file names, or else a
    submarine; `remark` gets what the plan lacks of the file. Raises PlanFileError, and OSError if it cannot be read.
    """
    suffix = path.suffix.lower()
    if suffix in OTHERS:
        hint = OTHERS[suffix] or f"known are {', '.join(PLAN_SUFFIXES)}"
        raise PlanFileError(f"{suffix} files are not read ({hint})", path)
    text = read_text(path, PlanFileError)
    if suffix in ROUTE_READERS:
        items = [_route_item(point) for point in ROUTE_READERS[suffix](text, str(path))]
        return _convert(MissionFile(items), path, context)
    if suffix in (QGC_SUFFIX, WAYPOINTS_SUFFIX) or text.startswith("QGC WPL"):
        try:
            read = read_qgc_plan if suffix == QGC_SUFFIX else read_waypoints
            mission = read(text, str(path))
        except MissionFileError as error:
            raise PlanFileError(error.reason, error.where) from None
        for words in mission.remarks:
            remark(words)
        return _convert(mission, path, context)
    return parse_plan(text, str(path), json=suffix == ".json")


def locate_reason(path: Path, reason: str) -> str:
    """A vehicle's reason, after the line of the plan file with the maneuver that the reason begins with.

    The reason alone where this is not known: of missions of other programs, or if the reason names no maneuver.
    """
    try:
        lines = maneuver_lines(read_text(path, PlanFileError), str(path))
    except (PlanFileError, imc.DecodeError, OSError):
        lines = {}
    names = [name for name in lines if reason.startswith(f"{name}: ")]
    return f"{path}:{lines[max(names, key=len)]}: {reason}" if names else reason


def _convert(mission: MissionFile, path: Path, context: ConversionContext | None) -> imc.PlanSpecification:
    if context is None:
        kinds = (kind for kind in KINDS.values() if kind.type == mission.vehicle_type)
        context = replace(SUBMARINE, kind=next(kinds, SUBMARINE.kind))
    if context.home is None and mission.home is not None and context.kind.afloat:
        lat, lon, altitude = mission.home
        context = replace(context, home=home_at(math.radians(lat), math.radians(lon), altitude, afloat=True))
    context = replace(context, name=path.stem, speed=mission.speed or context.speed)
    try:
        return plan_of([home_item(context.home), *mission.items], FLAVORS["ardupilot"], context).plan
    except BadItem as error:
        raise PlanFileError(str(error), path) from None


def _route_item(point: RoutePoint) -> Item:
    """A waypoint at a point; only depths, and heights above the ground, are used of altitudes."""
    x, y = round(DEGREES * point.lat), round(DEGREES * point.lon)
    frame = TERRAIN if point.above_ground and (point.altitude or 0.0) > 0.0 else RELATIVE
    z = (point.altitude or 0.0) if frame == TERRAIN else min(0.0, point.altitude or 0.0)
    return Item(frame, MissionCommand.NAV_WAYPOINT, x=x, y=y, z=z)
