"""Scenarios: what happens to vehicles in one run, and what is expected of them."""

from shoal.scenarios.dependencies import Sources, absolute
from shoal.scenarios.document import Draft, load_draft
from shoal.scenarios.engine import run
from shoal.scenarios.result import Result, Verdict
from shoal.scenarios.scenario import Scenario, ScenarioFileError

__all__ = [
    "Draft",
    "Result",
    "Scenario",
    "ScenarioFileError",
    "Sources",
    "Verdict",
    "absolute",
    "load_draft",
    "run",
]
