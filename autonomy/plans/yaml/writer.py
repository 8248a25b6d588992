"""Writes plans as YAML that reads back to the same bytes."""

from collections.abc import Mapping
from enum import IntEnum, IntFlag
from itertools import pairwise
from typing import Any, cast

import imc
from autonomy.plans.sequence import DONE
from autonomy.plans.yaml.reader import PlanFileError, PlanValues, parse_plan
from autonomy.plans.yaml.value_codec import Z_UNITS, format_degrees, shortest_number, write_field
from imc.reserved_ids import UNKNOWN_ENTITY, UNKNOWN_SYSTEM


def plan_text(plan: imc.PlanSpecification) -> str:
    """The plan as YAML, which `parse_plan` reads back to the same bytes. Raises PlanFileError."""
    import yaml  # slow to import, and most runs write no plan

    wanted = imc.encode(_bare(plan))
    for draft in (_short(plan), _plain(plan)):
        text = yaml.safe_dump(draft, sort_keys=False, allow_unicode=True, default_flow_style=None, width=110)
        try:
            if imc.encode(_bare(parse_plan(text))) == wanted:
                return text
        except PlanFileError:
            continue
    raise PlanFileError("the plan has values that YAML cannot represent")


def _short(plan: imc.PlanSpecification) -> PlanValues:
    """The plan as people write it."""
    items = [item for item in plan.maneuvers if isinstance(item, imc.PlanManeuver)]
    names = [item.maneuver_id for item in items]
    arrows = [arrow for arrow in plan.transitions if isinstance(arrow, imc.PlanTransition)]
    usual = dict([*pairwise(names), (names[-1], None)]) if names else {}
    draft: PlanValues = {"plan": plan.plan_id}
    draft |= {"description": plan.description} if plan.description else {}
    draft |= {"namespace": plan.vnamespace} if plan.vnamespace else {}
    draft |= {"start": plan.start_man_id} if not names or plan.start_man_id != names[0] else {}
    draft |= _short_actions("on_start", plan.start_actions) | _short_actions("on_end", plan.end_actions)
    entries: list[PlanValues] = []
    draft["maneuvers"] = entries
    for number, item in enumerate(items, 1):
        kind = type(item.data).__name__
        entry: PlanValues = {kind: _short_fields(item.data)}
        entry |= {"id": item.maneuver_id} if item.maneuver_id != f"{kind}{number}" else {}
        leaving = [arrow for arrow in arrows if arrow.source_man == item.maneuver_id]
        following = usual[item.maneuver_id]
        if [(arrow.dest_man, arrow.conditions) for arrow in leaving] != ([(following, DONE)] if following else []):
            entry["then"] = [{"to": arrow.dest_man, "when": arrow.conditions} for arrow in leaving] or "end"
        entry |= _short_actions("on_start", item.start_actions) | _short_actions("on_end", item.end_actions)
        entries.append(entry)
    return draft


def _short_fields(maneuver: imc.Message | None) -> PlanValues:
    if maneuver is None:
        return {}
    infos = {info.name: info for info in imc.fields(type(maneuver))}
    fields: Any = maneuver
    found: PlanValues = {}
    if {"lat", "lon"} <= set(infos):
        lat, lon = format_degrees(fields.lat), format_degrees(fields.lon)
        found |= {"lat": lat, "lon": lon} if "rad" in lat + lon else {"at": f"{lat}, {lon}"}
    names = {int(unit): name for name, unit in Z_UNITS.items()}
    if "z" in infos and fields.z_units in names:
        found[names[fields.z_units]] = shortest_number(fields.z, infos["z"].type)
        del infos["z"], infos["z_units"]
    if "speed" in infos and fields.speed_units == imc.SpeedUnits.METERS_PS:
        found["speed"] = f"{shortest_number(fields.speed, 'fp32_t')} m/s"
        del infos["speed"], infos["speed_units"]
    default = type(maneuver)()
    for name, info in infos.items():
        value: Any = getattr(fields, name)
        if name in ("lat", "lon") or value == getattr(default, name):
            continue
        if name == "points":
            points = [point for point in value if isinstance(point, imc.PathPoint)]
            found[name] = [[shortest_number(v, "fp32_t") for v in (point.x, point.y, point.z)] for point in points]
        else:
            found[name] = write_field(info, value)
    return found


def _short_actions(key: str, actions: tuple[imc.Message | None, ...]) -> PlanValues:
    found: PlanValues = {}
    for action in actions:
        if isinstance(action, imc.SetEntityParameters):
            entries = [entry for entry in action.params if isinstance(entry, imc.EntityParameter)]
            found[action.name] = {entry.name: entry.value for entry in entries}
    return {key: found} if found else {}


def _plain(plan: imc.PlanSpecification) -> PlanValues:
    """The plan in full: all messages with all their fields."""
    return _without_header(plan.to_dict())


def _without_header(value: Any) -> Any:
    if isinstance(value, Mapping):
        header = ("timestamp", "src", "src_ent", "dst", "dst_ent")
        return {key: _without_header(item) for key, item in cast(PlanValues, value).items() if key not in header}
    if isinstance(value, list):
        return [_without_header(item) for item in cast(list[Any], value)]
    return int(value) if isinstance(value, IntEnum | IntFlag) else value


def _bare(plan: imc.PlanSpecification) -> imc.PlanSpecification:
    return plan.replace(
        timestamp=-1.0, src=UNKNOWN_SYSTEM, src_ent=UNKNOWN_ENTITY, dst=UNKNOWN_SYSTEM, dst_ent=UNKNOWN_ENTITY
    )
