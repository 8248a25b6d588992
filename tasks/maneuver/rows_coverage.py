"""Covers an area with a sonar."""

import math
from collections import deque
from typing import ClassVar

import imc
from imc.coordinates import altitude_row_spacing
from runtime import param
from tasks.maneuver.maneuver_task import Maneuver, PathEnd
from tasks.maneuver.survey_row_following import follow_rows


class RowsCoverage(Maneuver):
    """Goes along rows whose spacing follows from a sonar's aperture and range and the overlap of its swaths.

    Where the bottom is nearer than the range the swath is narrower, so the next row is nearer: by the lowest mean
    altitude of the row before.
    """

    subscribed: ClassVar[tuple[type[imc.Message], ...]] = (imc.PathControlState, imc.EstimatedState)

    samples: int = param(
        40,
        "1",
        "Altitudes of which the mean is taken.",
        name="Altitude Moving Average Samples",
        minimum=5,
        maximum=1000,
    )
    minimum_altitude: float = param(0.3, "m", "Altitudes above this count.", name="Minimum Altitude Value", minimum=0)

    async def execute(self, area: imc.RowsCoverage) -> None:
        def narrowest() -> float:
            seen = self._lowest < math.inf and area.angaperture > 0.0
            return altitude_row_spacing(area.angaperture, self._lowest, area.overlap) if seen else math.inf

        self._forget()
        await follow_rows(self, area, narrowest)

    def start_path(self, leg: PathEnd, *, radius: float = 0.0, flags: int = 0) -> None:
        self._forget()
        super().start_path(leg, radius=radius, flags=flags)

    async def next_message(self, timeout: float | None = None) -> imc.Message:
        message = await super().next_message(timeout)
        if isinstance(message, imc.EstimatedState) and message.alt > self.minimum_altitude:
            self._altitudes.append(message.alt)
            if len(self._altitudes) == self.samples:
                self._lowest = min(self._lowest, math.fsum(self._altitudes) / self.samples)
        return message

    def _forget(self) -> None:
        """Begin to measure a row."""
        self._altitudes, self._lowest = deque[float](maxlen=self.samples), math.inf
