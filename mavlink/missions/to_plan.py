"""Items of a mission as an IMC plan."""

from collections.abc import Sequence

from mavlink.missions.commands import COMMANDS, UNKNOWN
from mavlink.missions.conversion_context import Settings
from mavlink.missions.enums import MISSION, PARAMETERS, POSITIONS, Command, MissionResult, MissionType, Refusal
from mavlink.missions.item import Item, first_item
from mavlink.missions.plan_builder import Converted, Planner
from mavlink.modes import Flavour

MOST_ITEMS = 600  # a PlanSpecification of so many waypoints still fits a packet of IMC
LARGEST = 3.5e38  # no float of 32 bits is larger


def plan_of(items: Sequence[Item], flavour: Flavour, settings: Settings) -> Converted:
    """The plan of a mission as a console of this flavor sends it.

    The numbers of the plan are rounded as on the wire. Maneuvers are called by kind and item: Goto3. Raises BadItem.
    """
    first = first_item(flavour)
    planner = Planner(settings, first)
    seq, item = 0, Item(MISSION, Command.NAV_WAYPOINT)
    try:
        for seq, item in enumerate(items[first:], first):
            if seq >= MOST_ITEMS:
                raise Refusal(MissionResult.NO_SPACE, f"a mission has at most {MOST_ITEMS} items")
            _check(item)
            planner.begin_item()
            COMMANDS[item.command](planner, item)
        return planner.finish()
    except Refusal as refusal:
        raise refusal.of(seq, item.command) from None


def _check(item: Item) -> None:
    if item.mission_type != MissionType.MISSION:
        raise Refusal(MissionResult.INVALID, "is part of a fence or a rally point, not of a mission")
    if item.command not in COMMANDS:
        raise Refusal(MissionResult.UNSUPPORTED, UNKNOWN.get(item.command, "is not supported in a mission"))
    if item.frame not in (MISSION, *POSITIONS):
        raise Refusal(MissionResult.UNSUPPORTED_FRAME, f"frame {item.frame} has no meaning for a mission")
    for number, value in enumerate((item.param1, item.param2, item.param3, item.param4)):
        if abs(value) > LARGEST:
            raise Refusal(PARAMETERS[number], f"parameter {number + 1} is infinite")
