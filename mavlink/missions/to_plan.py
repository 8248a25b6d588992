"""Items of a mission as an IMC plan."""

import math
from collections.abc import Sequence

from mavlink.missions.command_conversion import COMMANDS, UNKNOWN
from mavlink.missions.conversion_context import ConversionContext
from mavlink.missions.enums import (
    MISSION,
    PARAMETERS,
    POSITIONS,
    MissionCommand,
    MissionError,
    MissionResult,
    MissionType,
)
from mavlink.missions.item import WITHOUT_POSITION, Item, check_position, first_item_seq
from mavlink.missions.plan_builder import ConvertedPlan, PlanBuilder
from mavlink.modes import Flavor

MOST_ITEMS = 600  # a PlanSpecification of so many waypoints still fits a packet of IMC
LARGEST = 3.5e38  # no float of 32 bits is larger


def plan_of(items: Sequence[Item], flavor: Flavor, context: ConversionContext) -> ConvertedPlan:
    """The plan of a mission as a console of this flavor sends it.

    The numbers of the plan are rounded as on the wire. Maneuvers are called by kind and item: Goto3. Raises BadItem.
    """
    first = first_item_seq(flavor)
    builder = PlanBuilder(context, first)
    seq, item = 0, Item(MISSION, MissionCommand.NAV_WAYPOINT)
    try:
        for item in items[:first]:
            _check_home(item)
        for seq, item in enumerate(items[first:], first):
            if seq >= MOST_ITEMS:
                raise MissionError(MissionResult.NO_SPACE, f"a mission has at most {MOST_ITEMS} items")
            _check(item)
            builder.begin_item()
            COMMANDS[item.command](builder, item)
        return builder.finish()
    except MissionError as error:
        raise error.for_item(seq, item.command) from None


def _check_home(item: Item) -> None:
    """ArduPilot's item 0 is not kept, as home is the vehicle's own; one that no vehicle could have is an error."""
    _check(item)
    if item.command not in WITHOUT_POSITION:
        check_position(item)
        if not math.isfinite(item.z):
            raise MissionError(MissionResult.INVALID_PARAM7, "altitude is not a number")


def _check(item: Item) -> None:
    if item.mission_type != MissionType.MISSION:
        raise MissionError(MissionResult.INVALID, "is part of a fence or a rally point, not of a mission")
    if item.command not in COMMANDS:
        raise MissionError(MissionResult.UNSUPPORTED, UNKNOWN.get(item.command, "is not supported in a mission"))
    if item.frame not in (MISSION, *POSITIONS):
        raise MissionError(MissionResult.UNSUPPORTED_FRAME, f"frame {item.frame} has no meaning for a mission")
    for number, value in enumerate((item.param1, item.param2, item.param3, item.param4)):
        if abs(value) > LARGEST:
            raise MissionError(PARAMETERS[number], f"parameter {number + 1} is infinite")
