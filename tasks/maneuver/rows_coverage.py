"""Covers an area with a sonar."""

import imc
from tasks.maneuver.coverage import cover
from tasks.maneuver.protocol import Maneuver


class RowsCoverage(Maneuver):
    """Goes along rows whose spacing follows from a sonar's aperture, range and the overlap of its swaths."""

    async def execute(self, area: imc.RowsCoverage) -> None:
        await cover(self, area)
