"""Lets an operator steer."""

from typing import ClassVar

import imc
from imc.reserved_ids import UNKNOWN_SYSTEM
from imc.tuple_list import parse_tuple_list, parse_tuple_list_integer
from tasks.maneuver.maneuver_task import Loops, Maneuver


class Teleoperation(Maneuver):
    """Enables remote operation until TeleoperationDone or the action Exit, from the `src` in `custom` if given."""

    loops: ClassVar[int | None] = Loops.TELEOPERATION
    subscribed: ClassVar[tuple[type[imc.Message], ...]] = ()
    subscribed_from_others: ClassVar[tuple[type[imc.Message], ...]] = (imc.TeleoperationDone, imc.RemoteActions)

    async def execute(self, teleoperation: imc.Teleoperation) -> None:
        self.report_progress()
        operator = parse_tuple_list_integer(teleoperation.custom, "src")
        while True:
            event = await self.next_message()
            if event.dst not in (self.system, UNKNOWN_SYSTEM) or operator not in (None, event.src):
                continue
            if isinstance(event, imc.TeleoperationDone):
                return
            if isinstance(event, imc.RemoteActions) and parse_tuple_list(event.actions).get("Exit") == "1":
                return
