"""Scenarios: what happens to vehicles in one run, and what is expected of them."""

from shoal.scenarios.engine import run
from shoal.scenarios.file_dependencies import ScenarioDependencies, normalized_absolute_path
from shoal.scenarios.includes import merge_includes
from shoal.scenarios.result import ExpectationVerdict, ScenarioResult
from shoal.scenarios.scenario import Scenario, ScenarioFileError
from shoal.scenarios.scenario_tree import ScenarioDocument, load_document

__all__ = [
    "ExpectationVerdict",
    "Scenario",
    "ScenarioDependencies",
    "ScenarioDocument",
    "ScenarioFileError",
    "ScenarioResult",
    "load_document",
    "merge_includes",
    "normalized_absolute_path",
    "run",
]
