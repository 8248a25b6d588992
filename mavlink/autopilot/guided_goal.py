"""Goal of the controller of an autopilot."""

from enum import Enum, auto


class GuidedGoal(Enum):
    """Goal of the controller; ENDS follows an Abort, or a long time without a maneuver."""

    NONE = auto()
    HOLD = auto()
    ENDS = auto()
    GO = auto()
    TAKE_OFF = auto()
    LAND = auto()


LEADING = (GuidedGoal.GO, GuidedGoal.TAKE_OFF, GuidedGoal.LAND)
