"""The report of a mission: its outcome, and the time, distance and errors of each maneuver."""

import math
from dataclasses import dataclass, field
from pathlib import Path

COMPLETED, FAILED, LATE = "SUCCESS", "FAILURE", "TIMEOUT"


@dataclass
class ManeuverReport:
    """One maneuver: begin (s since 1970 UTC), time (s), distance over ground (m), worst errors (m), NaN if unknown."""

    name: str
    began: float
    seconds: float = 0.0
    distance: float = 0.0
    cross_track: float = math.nan
    depth_error: float = math.nan


@dataclass
class Report:
    """The result of a mission: `outcome` is SUCCESS, FAILURE or TIMEOUT, `reason` gives the cause.

    `seconds` and `distance` (m, over ground) count from the first maneuver, `deepest` is in m. Errors of a leg count
    from where the vehicle first follows it: cross-track within 1.5 m and 15°, depth within 0.5 m. `estimated_seconds`
    and `estimated_energy` (% of a full battery) are the plan engine's before the start, `battery_before` and
    `battery_after` (%) the vehicle's first and last FuelLevel of the plan; all NaN if unknown. `log` is the folder of
    the plan's log, None without one.
    """

    outcome: str = LATE
    reason: str = "no answer from the plan engine"
    deepest: float = 0.0
    legs: list[ManeuverReport] = field(default_factory=list[ManeuverReport])
    states: list[str] = field(default_factory=list[str])
    estimated_seconds: float = math.nan
    estimated_energy: float = math.nan
    battery_before: float = math.nan
    battery_after: float = math.nan
    log: Path | None = field(default=None, compare=False)

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
        """The worst of all legs (m), NaN if no straight leg was followed."""
        return max((leg.cross_track for leg in self.legs if not math.isnan(leg.cross_track)), default=math.nan)

    @property
    def depth_error(self) -> float:
        """The worst of all legs (m), NaN if no leg reached its depth."""
        return max((leg.depth_error for leg in self.legs if not math.isnan(leg.depth_error)), default=math.nan)

    @property
    def maneuvers(self) -> list[str]:
        """The names of the maneuvers, in order of execution."""
        return [leg.name for leg in self.legs]
