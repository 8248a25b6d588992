"""Missions of MAVLink as IMC plans and back, fences as operational limits; without a bus, sockets or clocks."""

from mavlink.missions.command_conversion import COMMANDS
from mavlink.missions.conversion_context import ConversionContext
from mavlink.missions.enums import BadItem, MissionCommand, MissionError, MissionResult, MissionType
from mavlink.missions.fence import fence_items, limits_with_fence
from mavlink.missions.from_plan import ConvertedMission, home_item, items_of
from mavlink.missions.item import Item, first_item_seq, opaque_id
from mavlink.missions.item_builder import MANEUVERS
from mavlink.missions.item_map import ItemMap
from mavlink.missions.mission_file import (
    MissionFile,
    MissionFileError,
    read_qgc_plan,
    read_waypoints,
    write_qgc_plan,
    write_waypoints,
)
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
    "MissionFile",
    "MissionFileError",
    "MissionResult",
    "MissionType",
    "fence_items",
    "first_item_seq",
    "home_item",
    "items_of",
    "limits_with_fence",
    "opaque_id",
    "plan_of",
    "read_qgc_plan",
    "read_waypoints",
    "write_qgc_plan",
    "write_waypoints",
]
