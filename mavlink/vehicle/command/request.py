"""MAV_CMD as the vehicle sees it: an order, and what becomes of it."""

import math
from collections.abc import Callable
from dataclasses import dataclass
from enum import IntEnum
from typing import NamedTuple

from mavlink import ReceivedMessage

REPEATED = 10.0  # s in which the same order again means that the answer was lost
TAKEOFF = 22  # MAV_CMD_NAV_TAKEOFF, which would be denied in the air; MAVSDK repeats it without counting
UNKNOWN_32 = (-(1 << 31), (1 << 31) - 1)


class MavResult(IntEnum):
    """MAV_RESULT."""

    ACCEPTED = 0
    TEMPORARILY_REJECTED = 1
    DENIED = 2
    UNSUPPORTED = 3
    FAILED = 4
    IN_PROGRESS = 5
    UNSUPPORTED_FRAME = 9


class CommandResult(NamedTuple):
    """The result of an order, and the reason for people if it is not carried out."""

    result: MavResult
    reason: str = ""


DONE = CommandResult(MavResult.ACCEPTED)
Finish = Callable[[CommandResult], None]


class CommandRequest(NamedTuple):
    """A command and its seven parameters; NaN: not given. `frame` is a MAV_FRAME, None in COMMAND_LONG.

    An order that takes time is answered by `finish`.
    """

    command: int
    params: tuple[float, ...]
    frame: int | None
    finish: Finish

    def integer_parameter(self, index: int) -> int | None:
        """A parameter, counted from 1, as an integer; None if it is not one."""
        value = self.params[index - 1]
        return int(value) if math.isfinite(value) and value == int(value) else None

    @property
    def lat_lon(self) -> tuple[float, float]:
        """Latitude and longitude in rad; NaN: not given. COMMAND_INT has them in 1e-7 degrees."""
        scale = 1.0 if self.frame is None else 1e-7
        return math.radians(self.params[4] * scale), math.radians(self.params[5] * scale)


def parse_command(message: ReceivedMessage, finish: Finish) -> CommandRequest:
    """The order in COMMAND_LONG or COMMAND_INT."""
    values = message.values
    whole = message.name == "COMMAND_INT"
    names = ("x", "y", "z") if whole else ("param5", "param6", "param7")
    params = [float(values[name]) for name in ("param1", "param2", "param3", "param4", *names)]
    if whole:
        params[4:6] = [math.nan if value in UNKNOWN_32 else value for value in params[4:6]]
    return CommandRequest(values["command"], tuple(params), values["frame"] if whole else None, finish)


@dataclass(slots=True)
class PendingCommand:
    """The last order of a component that took time: `reply` is None until it is finished.

    `number` is its place among the orders of all stations: after another one, the same order again is meant, and so it
    is from `until` on.
    Only one that is not finished at `progress_due` is reported to be in progress: MAVSDK takes that for "busy" in many
    cases.
    """

    message: ReceivedMessage
    until: float
    progress_due: float
    number: int
    reply: CommandResult | None = None

    def is_repeated_by(self, message: ReceivedMessage, number: int, now: float) -> bool:
        """Whether a message gives the same order again; `number` is that of the last order of all."""
        if _meaning(message) != _meaning(self.message):
            return False
        if self.reply is None:
            return True
        counted = message.name == "COMMAND_LONG" and message.values["confirmation"] > 0
        uncounted = message.name == "COMMAND_INT" or message.values["command"] == TAKEOFF
        again = counted or (uncounted and self.reply.result is MavResult.ACCEPTED)
        return again and self.number == number and now < self.until


def _meaning(message: ReceivedMessage) -> tuple[object, ...]:
    """Content of an order, bit by bit, without the count of its repetitions."""
    values = {**message.values, "confirmation": 0}
    return message.name, message.definition.pack(values)
