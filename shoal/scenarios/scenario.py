"""A scenario as it was read: vehicles, events, expectations and metrics of one run."""

from dataclasses import dataclass
from pathlib import Path

import imc
from shoal.scenarios.expectations import Expectation
from shoal.scenarios.links import LinkModel
from shoal.scenarios.metrics import Metric
from shoal.scenarios.run_context import Event
from shoal.scenarios.scenario_condition import ScenarioCondition
from support.diagnostics import LocatedError


class ScenarioFileError(LocatedError):
    """A file that does not hold a scenario; the text names file, line and reason."""


@dataclass(frozen=True)
class ScenarioSetting:
    """An option that a scenario sets, and the place in its file."""

    section: str
    option: str
    value: str
    where: str

    @property
    def override_text(self) -> str:
        return f"{self.section}:{self.option}={self.value}"


@dataclass(frozen=True)
class VehicleSpec:
    """A vehicle of a scenario, not built yet: `modes` are selected, `seed` is None for that of the run.

    `start_ns` is when virtual time starts (ns since 1970), `plan_origin` the place in the file that has or names the
    plan, `plan_file` where it is from, if not from the scenario itself.
    """

    name: str
    profile: str
    folder: Path
    modes: tuple[str, ...]
    seed: int | None = None
    settings: tuple[ScenarioSetting, ...] = ()
    plan: imc.PlanSpecification | None = None
    start_ns: int = 0
    plan_origin: str = ""
    plan_file: Path | None = None


@dataclass(frozen=True)
class Scenario:
    """Scenario for any number of runs. Times are in s; `limit` is simulated time, `settle` that after the plans."""

    name: str
    path: Path
    description: str
    seed: int
    vehicles: tuple[VehicleSpec, ...]
    expectations: tuple[Expectation, ...] = ()
    metrics: tuple[Metric, ...] = ()
    links: tuple[LinkModel, ...] = ()
    events: tuple[Event, ...] = ()
    limit: float = 3600.0
    settle: float = 0.0
    stop_when: ScenarioCondition | None = None
    warnings: tuple[str, ...] = ()
    captures: tuple[Event, ...] = ()
