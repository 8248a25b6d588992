"""What a search has found."""

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any

from shoal.campaigns.jobs import Row
from shoal.campaigns.search.axes import Values, size, values_of
from shoal.campaigns.search.course import AS_IT_IS, PART, TRIAL
from shoal.campaigns.search.goal import Goal, goal_of


@dataclass(frozen=True)
class Findings:
    """Rows of a search: `as_it_is`, the trials, the best of all, those that fail, the smallest change that does.

    `course` is the best value until each of them (NaN if there is none). Rows are None if there are none such.
    """

    goal: Goal
    axes: Mapping[str, Mapping[str, Any]]
    as_it_is: Row | None
    trials: Sequence[Row]
    broken: Sequence[Row]
    best: Row | None
    smallest: Row | None
    course: Sequence[float]

    @property
    def found(self) -> Row | None:
        """What is worth keeping: the smallest change that fails, or a trial better than the scenario as it is."""
        if self.goal.breaks:
            return self.smallest
        return self.best if self.best is not self.as_it_is else None

    def changes(self, row: Row) -> Values:
        """What a run changes, without units."""
        return values_of(row, self.axes)

    def default(self, place: str) -> object:
        """The value of the scenario; None if it is not known."""
        return self.axes[place]["default"]


def findings(about: Mapping[str, Any], rows: Sequence[Row]) -> Findings:
    """What the rows of a search have shown, in order of run; `about` is what the data set says of the search."""
    goal, axes = goal_of(about), about["axes"]
    best: Row | None = None
    value, course = math.nan, list[float]()
    trials = [row for row in rows if row[PART] == TRIAL]
    as_it_is = next((row for row in rows if row[PART] == AS_IT_IS), None)
    for row in rows:
        if goal.is_better(goal.value(row), value):
            best, value = row, goal.value(row)
        course.append(value)
    broken = [row for row in rows if goal.is_broken(row)]
    smallest = min(broken, key=lambda row: (size(values_of(row, axes), axes), row["run"]), default=None)
    return Findings(goal, axes, as_it_is, trials, broken, best, smallest, course)
