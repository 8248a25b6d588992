"""Items of a mission as MAVLink has them, bit by bit."""

import math
import struct
import zlib
from collections.abc import Iterable
from typing import Any, NamedTuple

from mavlink.dialect import Fields
from mavlink.missions.enums import MissionCommand, MissionError, MissionResult, MissionType
from mavlink.modes import Flavor

LAYOUT = struct.Struct("<ffffIIfHBBBB")
DEGREES = 1e7  # parts of a degree in x and y
WITHOUT_POSITION = frozenset(
    {
        MissionCommand.NAV_RETURN_TO_LAUNCH,
        MissionCommand.NAV_DELAY,
        MissionCommand.CONDITION_DELAY,
        MissionCommand.DO_CHANGE_SPEED,
        MissionCommand.DO_SET_CAM_TRIGG_DIST,
        MissionCommand.IMAGE_START_CAPTURE,
        MissionCommand.IMAGE_STOP_CAPTURE,
        MissionCommand.VIDEO_START_CAPTURE,
        MissionCommand.VIDEO_STOP_CAPTURE,
    }
)
ARDUPILOT = 3  # MAV_AUTOPILOT


class Item(NamedTuple):
    """One item: x and y are latitude and longitude in 1e-7 degrees, or parameters 5 and 6 of other commands.

    Parameters may be NaN, so compare `pack()` instead of items.
    """

    frame: int
    command: int
    current: int = 0
    autocontinue: int = 1
    param1: float = 0.0
    param2: float = 0.0
    param3: float = 0.0
    param4: float = 0.0
    x: int = 0
    y: int = 0
    z: float = 0.0
    mission_type: int = MissionType.MISSION

    @classmethod
    def of(cls, fields: Fields) -> "Item":
        """Item with the values of MISSION_ITEM_INT."""
        values: Any = fields
        return cls(*(values[name] for name in cls._fields))

    @classmethod
    def of_legacy(cls, fields: Fields) -> "Item":
        """Item with the values of MISSION_ITEM, whose x and y are floats. Raises BadItem if they are not numbers."""
        values: Any = fields
        factor = 1.0 if values["command"] in WITHOUT_POSITION else DEGREES
        whole: dict[str, int] = {}
        for name, result in (("x", MissionResult.INVALID_PARAM5_X), ("y", MissionResult.INVALID_PARAM6_Y)):
            value = factor * values[name]
            if factor == 1.0 and math.isnan(value):
                value = 0.0  # not given
            if not abs(value) < 2.0**31:
                raise MissionError(result, f"{name} {values[name]:g} is no number of degrees").for_item(
                    values["seq"], values["command"]
                )
            whole[name] = round(value)
        return cls.of({**fields, **whole})

    def fields(self, seq: int) -> dict[str, int | float]:
        """The values of MISSION_ITEM_INT as item `seq`; the receiver is left to the caller."""
        return {**self._asdict(), "seq": seq}

    def legacy_fields(self, seq: int) -> dict[str, int | float]:
        """The values of MISSION_ITEM as item `seq`, for a console that asks with MISSION_REQUEST."""
        factor = 1.0 if self.command in WITHOUT_POSITION else DEGREES
        return {**self.fields(seq), "x": self.x / factor, "y": self.y / factor}

    def pack(self) -> bytes:
        """All values as bytes; what does not fit its field is cut, so nothing is ever rejected here."""
        floats = [to_float32(value) for value in (self.param1, self.param2, self.param3, self.param4)]
        places = [int(value) & 0xFFFFFFFF for value in (self.x, self.y)]
        small = [int(value) & 0xFF for value in (self.frame, self.current, self.autocontinue, self.mission_type)]
        return LAYOUT.pack(*floats, *places, to_float32(self.z), int(self.command) & 0xFFFF, *small)


def check_position(item: Item) -> None:
    """Raises MissionError if x or y are no latitude or longitude."""
    for value, limit, name, result in (
        (item.x, 90, "latitude", MissionResult.INVALID_PARAM5_X),
        (item.y, 180, "longitude", MissionResult.INVALID_PARAM6_Y),
    ):
        if abs(value) > limit * DEGREES:
            raise MissionError(result, f"{name} {value} is out of range; it counts 1e-7 degrees")


def to_float32(value: float) -> float:
    """The nearest number that a field of 32 bits holds."""
    try:
        return struct.unpack("<f", struct.pack("<f", value))[0]
    except OverflowError:
        return math.copysign(math.inf, value)


def opaque_id(items: Iterable[Item]) -> int:
    """The id by which consoles notice another mission; not 0, which means that there is no id.

    `current` does not count: it changes while a mission is flown.
    """
    return zlib.crc32(b"".join(item._replace(current=0).pack() for item in items)) or 1


def first_item_seq(flavor: Flavor) -> int:
    """The number of the first item that is flown: item 0 of ArduPilot is home."""
    return 1 if flavor.autopilot == ARDUPILOT else 0
