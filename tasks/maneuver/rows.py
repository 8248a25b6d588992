"""Covers an area in parallel rows."""

import imc
from tasks.maneuver.maneuver_task import Maneuver
from tasks.maneuver.survey_row_following import follow_rows


class Rows(Maneuver):
    """Goes along rows at a given spacing; done at the end of the last."""

    async def execute(self, area: imc.Rows) -> None:
        await follow_rows(self, area)
