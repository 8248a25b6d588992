"""Does nothing, for a time or forever."""

from typing import ClassVar

import imc
from tasks.maneuver.maneuver_task import Maneuver


class Idle(Maneuver):
    """Disables all control loops; a duration of 0 lasts until another maneuver begins."""

    loops: ClassVar[int | None] = 0
    subscribed: ClassVar[tuple[type[imc.Message], ...]] = ()

    async def execute(self, idle: imc.IdleManeuver) -> None:
        if idle.duration == 0:
            self.report_progress()
            await self.next_message()
        for left in range(idle.duration, 0, -1):
            self.report_progress(left)
            await self.sleep(1.0)
