"""Covers an area in parallel rows."""

import imc
from tasks.maneuver.coverage import cover
from tasks.maneuver.protocol import Maneuver


class Rows(Maneuver):
    """Goes along rows at a given spacing; done at the end of the last."""

    async def execute(self, area: imc.Rows) -> None:
        await cover(self, area)
