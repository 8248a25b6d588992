"""Result of a run of a scenario."""

import math
from dataclasses import dataclass, field
from pathlib import Path

TRACK_PERIOD = 5.0  # s


@dataclass(frozen=True)
class ExpectationVerdict:
    """Whether an expectation was met, and by how much.

    `margin` is how far it was from failing, in the unit of its comparison (negative if it failed, infinite if it
    compares nothing). `applied` is False if it never had anything to judge: then it has passed, and proved nothing.
    `time` (s from the start of the run) is that of the margin, NaN if there is none; `reason` is a sentence.
    """

    name: str
    passed: bool
    margin: float = math.inf
    reason: str = ""
    applied: bool = True
    time: float = math.nan
    origin: str = ""


@dataclass(frozen=True)
class ScenarioResult:
    """One run: `passed` if it ended in order and met all expectations.

    `error` is why the run ended out of order: an exception of a task, or the limit of wall time; else empty.
    `metrics` are by name, NaN if never measured. `outcomes` are those of the plans, by vehicle. `seconds` is simulated
    time. If logs were kept, `logs` are the folders of those with the plan, else of the first ones, by vehicle, and
    `hashes` the SHA-256 of the data of all logs of a vehicle, one after the other. `tracks` are true positions by
    vehicle: latitude and longitude (°) and depth (m), one after another, each `TRACK_PERIOD`.
    `fingerprint` is the same for equal runs, with or without log, on any computer.
    """

    scenario: str
    seed: int
    verdicts: tuple[ExpectationVerdict, ...] = ()
    metrics: dict[str, float] = field(default_factory=dict[str, float])
    outcomes: dict[str, str] = field(default_factory=dict[str, str])
    seconds: float = 0.0
    error: str = ""
    warnings: tuple[str, ...] = ()
    logs: dict[str, Path] = field(default_factory=dict[str, Path])
    hashes: dict[str, str] = field(default_factory=dict[str, str])
    fingerprint: str = ""
    tracks: dict[str, list[float]] = field(default_factory=dict[str, list[float]], repr=False)

    @property
    def passed(self) -> bool:
        return not self.error and all(verdict.passed for verdict in self.verdicts)

    @property
    def margin(self) -> float:
        """The smallest margin of all expectations."""
        return min((verdict.margin for verdict in self.verdicts), default=math.inf)
