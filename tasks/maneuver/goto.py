"""Goes to a point."""

import imc
from tasks.maneuver.maneuver_task import Maneuver, PathEnd


class Goto(Maneuver):
    """Goes to a point at a depth or an altitude; done when path control reports that it is near."""

    async def execute(self, goto: imc.Goto) -> None:
        await self.go_to_end(PathEnd.from_maneuver(goto))
