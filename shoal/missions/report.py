"""How a mission went: its outcome, and each maneuver with its time, distance and errors."""

import math
from dataclasses import dataclass, field

COMPLETED, FAILED, LATE = "SUCCESS", "FAILURE", "TIMEOUT"


@dataclass
class ManeuverReport:
    """One maneuver of a flight: its time (s), distance over ground (m), and worst errors (m), NaN where it has none."""

    name: str
    began: float
    seconds: float = 0.0
    distance: float = 0.0
    cross_track: float = math.nan
    depth_error: float = math.nan


@dataclass
class Report:
    """How a mission went: `outcome` is SUCCESS, FAILURE or TIMEOUT, `reason` the words of the plan engine.

    `seconds` and `distance` (m, over ground) count from the first maneuver, `deepest` is in m. Errors of a leg count
    from where it has first been followed: within 1.5 m and 15° across, 0.5 m in depth.
    """

    outcome: str = LATE
    reason: str = "no answer of the plan engine"
    deepest: float = 0.0
    legs: list[ManeuverReport] = field(default_factory=list[ManeuverReport])
    states: list[str] = field(default_factory=list[str])

    @property
    def completed(self) -> bool:
        return self.outcome == COMPLETED

    @property
    def seconds(self) -> float:
        return sum(leg.seconds for leg in self.legs)

    @property
    def distance(self) -> float:
        return sum(leg.distance for leg in self.legs)

    @property
    def cross_track(self) -> float:
        """The worst of all legs (m), NaN where no leg was straight."""
        return max((leg.cross_track for leg in self.legs if not math.isnan(leg.cross_track)), default=math.nan)

    @property
    def depth_error(self) -> float:
        """The worst of all legs (m), NaN where no leg had reached its depth."""
        return max((leg.depth_error for leg in self.legs if not math.isnan(leg.depth_error)), default=math.nan)

    @property
    def maneuvers(self) -> list[str]:
        """The names of the maneuvers in the order in which they were executed."""
        return [leg.name for leg in self.legs]
