"""Content of a plan that is lost in the items of a mission."""

from collections.abc import Iterator, Sequence
from typing import Any

import imc
from mavlink.missions.conversion_context import ConversionContext, Units
from mavlink.missions.enums import MissionCommand
from mavlink.missions.item import Item
from mavlink.missions.item_builder import Chain
from mavlink.missions.item_map import ItemMap
from mavlink.missions.plan_builder import ConvertedPlan

UNUSED = frozenset({"timeout", "roll", "pitch", "custom"})  # no maneuver that items can express uses them
NEAR = 2e-9  # rad, about 1 cm; items count 1e-7 degrees


def losses(
    chain: Chain, item_map: ItemMap, items: Sequence[Item], again: ConvertedPlan, context: ConversionContext
) -> Iterator[str]:
    """Remarks on what is missing or different in `again`, the plan that `items` make of the maneuvers of `chain`."""
    old = {node.maneuver_id: node for node in chain}
    new = {node.maneuver_id: node for node in again.plan.maneuvers if isinstance(node, imc.PlanManeuver)}
    shown = [name for ids in item_map.steps for name in ids]
    times = {name: shown.count(name) for name in dict.fromkeys(shown)}
    for seq, (before, after) in enumerate(zip(item_map.steps, again.item_map.steps, strict=True)):
        kinds = [type(old[name].data) for name in before]
        if kinds == [type(new[name].data) for name in after] and all(times.get(name) == 1 for name in before):
            for name, other in zip(before, after, strict=True):
                yield from _loss(old[name], new[other], context)
            continue
        for name, kind in zip(before, kinds, strict=True):
            if count := times.pop(name, 0):
                yield f"{name}: {kind.__name__} is shown as {count} {MissionCommand(items[seq].command).name}"


def _loss(old: imc.PlanManeuver, new: imc.PlanManeuver, context: ConversionContext) -> Iterator[str]:
    different = _differences(old.data, new.data, context)
    if _settings_of(old.start_actions) != _settings_of(new.start_actions):
        different.append("what is set as it begins")
    if _settings_of(old.end_actions) != _settings_of(new.end_actions):
        different.append("what is set as it ends")
    if different:
        yield f"{old.maneuver_id}: not shown as it is: {', '.join(different)}"


def _differences(old: imc.Message | None, new: imc.Message | None, context: ConversionContext) -> list[str]:
    one, other = _meaning(old, context), _meaning(new, context)
    near = ("lat", "lon", "yaw", "bearing")
    return [
        name
        for name, value in one.items()
        if value != other[name] and not (name in near and abs(value - other[name]) <= NEAR)
    ]


def _meaning(maneuver: imc.Message | None, context: ConversionContext) -> dict[str, Any]:
    """The fields of a maneuver that matter, as they are understood."""
    infos = () if maneuver is None else imc.fields(type(maneuver))
    values = {info.name: getattr(maneuver, info.name) for info in infos if info.name not in UNUSED}
    if isinstance(maneuver, imc.Loiter) and maneuver.type not in (imc.Loiter.Type.EIGHT, imc.Loiter.Type.HOVER):
        ways = imc.Loiter.Direction
        values["direction"] = ways.CCLOCKW if maneuver.direction == ways.CCLOCKW else ways.CLOCKW
        values.update(type=imc.Loiter.Type.CIRCULAR, length=0.0, bearing=0.0)
    if isinstance(maneuver, imc.PopUp | imc.Elevator) and maneuver.flags & imc.PopUp.Flags.CURR_POS:
        values.update(lat=0.0, lon=0.0)
    if not context.flies and not context.dives and values.get("z_units") == Units.NONE:
        values["z_units"] = Units.DEPTH  # a boat stays at the surface in any case
    return values


def _settings_of(actions: tuple[imc.Message | None, ...]) -> list[object]:
    """Effects of actions, without addresses and times."""
    return [None if action is None else action.to_dict() for action in actions]
