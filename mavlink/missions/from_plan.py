"""An IMC plan as items of a mission, with remarks on what items cannot express."""

import math
from typing import NamedTuple

import imc
from autonomy.plans import main_sequence
from mavlink.missions.conversion_context import ConversionContext
from mavlink.missions.enums import GLOBAL, BadItem, MissionCommand
from mavlink.missions.item import Item, first_item_seq, to_float32
from mavlink.missions.item_builder import ItemBuilder
from mavlink.missions.item_map import ItemMap
from mavlink.missions.lossiness import losses
from mavlink.missions.to_plan import MOST_ITEMS, plan_of
from mavlink.modes import Flavor
from mavlink.positions import Home, degrees_e7


class ConvertedMission(NamedTuple):
    """A plan as items. `remarks` list what they cannot express; without any, `plan_of` makes the same plan of them.

    The names of maneuvers do not count, nor do fields that no maneuver of Shoal uses, such as timeouts.
    """

    items: list[Item]
    remarks: list[str]
    item_map: ItemMap


def items_of(plan: imc.PlanSpecification, flavor: Flavor, context: ConversionContext) -> ConvertedMission:
    """Any plan as a mission for a console of this flavor. Raises nothing."""
    plan, first = _as_received(plan), first_item_seq(flavor)
    chain, remarks = main_sequence(plan)
    builder = ItemBuilder(context, unset=0.0 if first else math.nan)
    taken = 0
    while taken < len(chain) and len(builder.items) < MOST_ITEMS:
        taken += builder.add_next_maneuvers(chain[taken:])
    items, steps = [home_item(context.home)] * first + builder.items, [()] * first + builder.steps
    if taken < len(chain) or len(items) > MOST_ITEMS:
        remarks.append(f"only the first {MOST_ITEMS} items are shown")
    item_map = ItemMap(tuple(steps[:MOST_ITEMS]), first)
    items = items[:MOST_ITEMS]
    remarks += builder.remarks
    if any(item_map.steps):
        try:
            remarks += losses(chain, item_map, items, plan_of(items, flavor, context), context)
        except BadItem as bad:
            remarks.append(f"the vehicle would not accept this mission: {bad}")
    if plan.start_actions or plan.end_actions:
        remarks.append("what the plan sets as it begins and ends is not shown")
    return ConvertedMission(items, remarks, item_map)


def home_item(home: Home | None) -> Item:
    """Item 0 of ArduPilot's missions; without a home it has no position."""
    if home is None:
        return Item(GLOBAL, MissionCommand.NAV_WAYPOINT)
    lat, lon = degrees_e7(home.lat), degrees_e7(home.lon)
    return Item(GLOBAL, MissionCommand.NAV_WAYPOINT, x=lat, y=lon, z=to_float32(home.altitude))


def _as_received(plan: imc.PlanSpecification) -> imc.PlanSpecification:
    """The plan as the wire would round it."""
    try:
        received = imc.decode(imc.encode(plan))
    except imc.EncodeError:
        return plan
    return received if isinstance(received, imc.PlanSpecification) else plan
