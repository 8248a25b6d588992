"""Numbers of MAVLink's mission protocol, and the errors of its items."""

from enum import IntEnum


class MissionCommand(IntEnum):
    """MAV_CMD of the items that are understood."""

    NAV_WAYPOINT = 16
    NAV_LOITER_UNLIM = 17
    NAV_LOITER_TURNS = 18
    NAV_LOITER_TIME = 19
    NAV_RETURN_TO_LAUNCH = 20
    NAV_LAND = 21
    NAV_TAKEOFF = 22
    NAV_LOITER_TO_ALT = 31
    NAV_SPLINE_WAYPOINT = 82
    NAV_DELAY = 93
    CONDITION_DELAY = 112
    DO_CHANGE_SPEED = 178
    DO_SET_CAM_TRIGG_DIST = 206
    IMAGE_START_CAPTURE = 2000
    IMAGE_STOP_CAPTURE = 2001
    VIDEO_START_CAPTURE = 2500
    VIDEO_STOP_CAPTURE = 2501
    NAV_FENCE_RETURN_POINT = 5000
    NAV_FENCE_POLYGON_VERTEX_INCLUSION = 5001
    NAV_FENCE_POLYGON_VERTEX_EXCLUSION = 5002
    NAV_FENCE_CIRCLE_INCLUSION = 5003
    NAV_FENCE_CIRCLE_EXCLUSION = 5004
    NAV_RALLY_POINT = 5100


class MissionType(IntEnum):
    """MAV_MISSION_TYPE."""

    MISSION = 0
    FENCE = 1
    RALLY = 2
    ALL = 255


class MissionResult(IntEnum):
    """MAV_MISSION_RESULT."""

    ACCEPTED = 0
    ERROR = 1
    UNSUPPORTED_FRAME = 2
    UNSUPPORTED = 3
    NO_SPACE = 4
    INVALID = 5
    INVALID_PARAM1 = 6
    INVALID_PARAM2 = 7
    INVALID_PARAM3 = 8
    INVALID_PARAM4 = 9
    INVALID_PARAM5_X = 10
    INVALID_PARAM6_Y = 11
    INVALID_PARAM7 = 12
    INVALID_SEQUENCE = 13
    DENIED = 14
    OPERATION_CANCELLED = 15


# MAV_FRAME. Each has a second number, from when positions of items were floats; both mean the same here.
GLOBAL, GLOBAL_INT = 0, 5  # above mean sea level
MISSION = 2  # of an item without a position
RELATIVE, RELATIVE_INT = 3, 6  # above home
TERRAIN, TERRAIN_INT = 10, 11  # above the ground or the seabed
GLOBAL_FRAMES = (GLOBAL, GLOBAL_INT)
RELATIVE_FRAMES = (RELATIVE, RELATIVE_INT)
TERRAIN_FRAMES = (TERRAIN, TERRAIN_INT)
POSITIONS = (*GLOBAL_FRAMES, *RELATIVE_FRAMES, *TERRAIN_FRAMES)
PARAMETERS = (
    MissionResult.INVALID_PARAM1,
    MissionResult.INVALID_PARAM2,
    MissionResult.INVALID_PARAM3,
    MissionResult.INVALID_PARAM4,
)
FENCE_COMMANDS = range(MissionCommand.NAV_FENCE_RETURN_POINT, MissionCommand.NAV_FENCE_CIRCLE_EXCLUSION + 1)


class MissionError(Exception):
    """Reason why an item cannot be accepted; a caller with its number makes a BadItem of it."""

    def __init__(self, result: MissionResult, reason: str):
        super().__init__(reason)
        self.result = result

    def for_item(self, seq: int, command: int) -> "BadItem":
        """The error of item `seq`."""
        known = command in set(MissionCommand)
        name = MissionCommand(command).name if known else f"command {command}"
        return BadItem(seq, self.result, name, str(self))


class BadItem(ValueError):
    """An item cannot be accepted: its sequence number, the result for MISSION_ACK; the text names item and reason."""

    def __init__(self, seq: int, result: MissionResult, name: str, reason: str):
        super().__init__(f"item {seq} ({name}): {reason}")
        self.seq = seq
        self.result = result
        self.reason = reason
