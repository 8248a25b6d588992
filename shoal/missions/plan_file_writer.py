"""Writes plans as files of Shoal and of other programs."""

import math
from collections.abc import Collection, Iterable, Sequence
from dataclasses import replace
from pathlib import Path
from typing import NamedTuple

import imc
from autonomy.plans.yaml import PlanFileError, plan_text
from mavlink import FLAVORS, KINDS, Home
from mavlink.missions import (
    ConversionContext,
    Item,
    home_item,
    items_of,
    write_qgc_plan,
    write_waypoints,
)
from shoal.missions.plan_file_reader import DEGREES, QGC_SUFFIX, SUBMARINE, WAYPOINTS_SUFFIX
from shoal.missions.route_file import ROUTE_WRITERS, RoutePoint

WITH_PLACE = range(16, 96)  # MAV_CMD of items that go somewhere
TERRAIN_FRAMES = (10, 11)


class PlanFileText(NamedTuple):
    """The text of a file for a plan, remarks on what the file lacks, and the maneuvers that are missing in it."""

    text: str
    remarks: list[str]
    missing: list[str]


def plan_file_text(plan: imc.PlanSpecification, path: Path, context: ConversionContext | None = None) -> PlanFileText:
    """The content of a file for a plan, by the suffix of its path.

    YAML and JSON keep everything. `context` is the vehicle, by default a submarine. Raises PlanFileError.
    """
    suffix = path.suffix.lower()
    if suffix == ".json":
        return PlanFileText(plan.to_json() + "\n", [], [])
    if suffix not in (QGC_SUFFIX, WAYPOINTS_SUFFIX, *ROUTE_WRITERS):
        return PlanFileText(plan_text(plan), [], [])
    context = context or _usual_context(plan)
    flavor = FLAVORS["ardupilot"]  # in files, item 0 is home
    if context.home is None and (place := _first_place(plan)) is not None:
        context = replace(context, home=Home(*place, 0.0, 0.0))
    mission = items_of(plan, flavor, context)
    items = [home_item(context.home), *mission.items[1:]]
    if len(items) < 2:
        raise PlanFileError("has nothing that a mission can hold", plan.plan_id)
    if suffix == QGC_SUFFIX:
        text = write_qgc_plan(items, context.kind, flavor, context.speed)
        return PlanFileText(text, mission.remarks, _missing(plan, mission.item_map.steps))
    if suffix == WAYPOINTS_SUFFIX:
        return PlanFileText(write_waypoints(items), mission.remarks, _missing(plan, mission.item_map.steps))
    route = _route(items[1:])
    places = [ids for ids, item in zip(mission.item_map.steps, mission.items, strict=False) if _has_place(item)]
    if not route:
        raise PlanFileError("has no places for a route", plan.plan_id)
    remarks = [] if len(route) == len(mission.items) - 1 else ["a route has only the places of the plan"]
    text = ROUTE_WRITERS[suffix](route, plan.plan_id)
    return PlanFileText(text, mission.remarks + remarks, _missing(plan, places))


def _missing(plan: imc.PlanSpecification, steps: Iterable[Collection[str]]) -> list[str]:
    """The maneuvers that no item of a file belongs to."""
    written = {name for names in steps for name in names}
    names = [item.maneuver_id for item in plan.maneuvers if isinstance(item, imc.PlanManeuver)]
    return [name for name in names if name not in written]


def _has_place(item: Item) -> bool:
    return item.command in WITH_PLACE and (item.x, item.y) != (0, 0)


def _usual_context(plan: imc.PlanSpecification) -> ConversionContext:
    """A vehicle that can carry out a plan: one that takes off flies."""
    flies = any(isinstance(item, imc.PlanManeuver) and isinstance(item.data, imc.Takeoff) for item in plan.maneuvers)
    return replace(SUBMARINE, kind=KINDS["hexacopter"]) if flies else SUBMARINE


def _first_place(plan: imc.PlanSpecification) -> tuple[float, float] | None:
    """The first position (rad) in a plan."""
    for item in plan.maneuvers:
        data = item.data if isinstance(item, imc.PlanManeuver) else None
        lat, lon = (getattr(data, axis, 0.0) for axis in ("lat", "lon"))
        if (lat, lon) != (0.0, 0.0) and math.isfinite(lat) and math.isfinite(lon):
            return lat, lon
    return None


def _route(items: Sequence[Item]) -> list[RoutePoint]:
    places = filter(_has_place, items)
    return [RoutePoint(i.x / DEGREES, i.y / DEGREES, i.z + 0.0, i.frame in TERRAIN_FRAMES) for i in places]
