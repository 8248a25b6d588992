"""Findings of a search."""

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any

from shoal.campaigns.jobs import ResultRow
from shoal.campaigns.search.objective import SearchObjective, objective_from_dict
from shoal.campaigns.search.schedule import AS_IT_IS, PART, TRIAL
from shoal.campaigns.search.search_space import ValueChanges, change_size, changed_values


@dataclass(frozen=True)
class SearchFindings:
    """Rows of a search: `baseline`, the trials, the best of all, those that fail, the smallest change that does.

    `best_so_far` is the best value until each of them (NaN if there is none). Rows are None if there are none such.
    """

    objective: SearchObjective
    axes: Mapping[str, Mapping[str, Any]]
    baseline: ResultRow | None
    trials: Sequence[ResultRow]
    failures: Sequence[ResultRow]
    best: ResultRow | None
    smallest_failure: ResultRow | None
    best_so_far: Sequence[float]

    @property
    def row_to_keep(self) -> ResultRow | None:
        """Row to keep: the smallest change that fails, or a trial better than the scenario as it is."""
        if self.objective.seeks_failure:
            return self.smallest_failure
        return self.best if self.best is not self.baseline else None

    def changed_values_of_run(self, row: ResultRow) -> ValueChanges:
        """Values that a run changes, without units."""
        return changed_values(row, self.axes)

    def default_scenario_value(self, place: str) -> object:
        """The value of the scenario; None if it is not known."""
        return self.axes[place]["default"]


def summarize_search(about: Mapping[str, Any], rows: Sequence[ResultRow]) -> SearchFindings:
    """Summarize the rows of a search, in order of run; `about` is the entry of the search in the data set."""
    goal, axes = objective_from_dict(about), about["axes"]
    best: ResultRow | None = None
    value, course = math.nan, list[float]()
    trials = [row for row in rows if row[PART] == TRIAL]
    as_it_is = next((row for row in rows if row[PART] == AS_IT_IS), None)
    for row in rows:
        if goal.is_better(goal.value(row), value):
            best, value = row, goal.value(row)
        course.append(value)
    broken = [row for row in rows if goal.is_failure(row)]
    smallest = min(broken, key=lambda row: (change_size(changed_values(row, axes), axes), row["run"]), default=None)
    return SearchFindings(goal, axes, as_it_is, trials, broken, best, smallest, course)
