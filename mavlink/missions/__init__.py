"""Missions of MAVLink as IMC plans and back, fences as operational limits; without a bus, sockets or clocks."""

from mavlink.missions.commands import COMMANDS
from mavlink.missions.conversion_context import ConversionContext
from mavlink.missions.enums import BadItem, MissionCommand, MissionError, MissionResult, MissionType
from mavlink.missions.fence import area_of, fence_of, inside
from mavlink.missions.from_plan import ConvertedMission, home_item, items_of
from mavlink.missions.item import Item, first_item, opaque_id
from mavlink.missions.item_builder import MANEUVERS
from mavlink.missions.item_map import ItemMap
from mavlink.missions.plan_builder import ConvertedPlan
from mavlink.missions.to_plan import MOST_ITEMS, plan_of

__all__ = [
    "COMMANDS",
    "MANEUVERS",
    "MOST_ITEMS",
    "BadItem",
    "ConversionContext",
    "ConvertedMission",
    "ConvertedPlan",
    "Item",
    "ItemMap",
    "MissionCommand",
    "MissionError",
    "MissionResult",
    "MissionType",
    "area_of",
    "fence_of",
    "first_item",
    "home_item",
    "inside",
    "items_of",
    "opaque_id",
    "plan_of",
]
