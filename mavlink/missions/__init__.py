"""Missions of MAVLink as IMC plans and back, fences as operational limits; without a bus, sockets or clocks."""

from mavlink.missions.commands import COMMANDS
from mavlink.missions.conversion_context import Settings
from mavlink.missions.enums import BadItem, Command, MissionResult, MissionType, Refusal
from mavlink.missions.fence import area_of, fence_of, inside
from mavlink.missions.from_plan import Listing, home_item, items_of
from mavlink.missions.item import Item, first_item, opaque_id
from mavlink.missions.item_builder import LISTED
from mavlink.missions.item_map import Table
from mavlink.missions.plan_builder import Converted
from mavlink.missions.to_plan import MOST_ITEMS, plan_of

__all__ = [
    "COMMANDS",
    "LISTED",
    "MOST_ITEMS",
    "BadItem",
    "Command",
    "Converted",
    "Item",
    "Listing",
    "MissionResult",
    "MissionType",
    "Refusal",
    "Settings",
    "Table",
    "area_of",
    "fence_of",
    "first_item",
    "home_item",
    "inside",
    "items_of",
    "opaque_id",
    "plan_of",
]
