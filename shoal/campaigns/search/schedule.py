"""The runs of a search, in rounds: each follows from the rows of those before, however long ago they were done."""

from collections.abc import Generator, Mapping
from typing import Any

from shoal.campaigns.jobs import ResultRow
from shoal.campaigns.sampling import hashed_uniform
from shoal.campaigns.search.config import SearchConfig
from shoal.campaigns.search.optuna_sampler import suggest_trials
from shoal.campaigns.search.search_space import ValueChanges, change_size, changed_values
from shoal.campaigns.search.shrinking import shrink_change

PART, AS_IT_IS, TRIAL, SMALLER = "part", "as it is", "trial", "smaller"


class SearchSchedule:
    """Runs of a search: the scenario as it is, trials, and changes that are made smaller.

    `rows` are those of the runs that are done, by number, and may grow; `total_runs` is the number of all runs once
    it is known. If the scenario fails as it is, there is nothing to look for.
    """

    def __init__(self, search: SearchConfig, trials: int, seed: int, rows: Mapping[int, ResultRow]):
        self._search, self._trials, self._seed, self._rows = search, trials, seed, rows
        self._about = search.to_dict()["axes"]
        self._raw_values: dict[int, ValueChanges] = {}
        self._parts: dict[int, str] = {}
        self.total_runs: int | None = None

    def update_total_runs(self) -> None:
        """Do nothing: the number does not follow from a run alone; see `batches`."""

    def raw_values(self, run: int) -> ValueChanges:
        """Values that a run changes, without units."""
        return self._raw_values[run]

    def extra_columns(self, run: int) -> dict[str, Any]:
        """Further columns of the row of a run."""
        return {PART: self._parts[run]}

    def batches(self) -> Generator[list[int]]:
        """The runs that are left, in lists; all of one must be done before the next is asked for."""
        yield from self._batch([{}], AS_IT_IS)
        goal = self._search.objective
        if not goal.is_failure(self._rows[0]):
            while (batch := self._next_trials()) is not None:
                yield from self._batch(batch, TRIAL)
            if goal.seeks_failure and self._search.max_shrink_runs:
                yield from self._shrink()
        self.total_runs = len(self._raw_values)

    def _batch(self, batch: list[ValueChanges], part: str) -> Generator[list[int]]:
        first = len(self._raw_values)
        for run, values in enumerate(batch, first):
            self._raw_values[run], self._parts[run] = values, part
        left = [run for run in range(first, first + len(batch)) if not self._is_done(run)]
        if left:
            yield left

    def _is_done(self, run: int) -> bool:
        row = self._rows.get(run)
        return (
            row is not None
            and row.get(PART) == self._parts[run]
            and changed_values(row, self._search.axes) == self._raw_values[run]
        )

    def _next_trials(self) -> list[ValueChanges] | None:
        """The next trials; None if there are enough, or nothing is left to try."""
        first = len(self._raw_values)
        count = min(self._search.batch_size, self._trials - first)
        if count <= 0:
            return None
        rows = [self._rows.get(run) for run in range(first, first + count)]
        known = [changed_values(row, self._search.axes) for row in rows if row is not None and row.get(PART) == TRIAL]
        if len(known) == count:
            return known
        seed = int(hashed_uniform(self._seed, "search", first) * 2**31)
        axes, goal = list(self._search.axes.values()), self._search.objective
        results = [(values, goal.value(self._rows[run])) for run, values in self._raw_values.items() if run]
        defaults = {axis.place: axis.default for axis in axes}
        if all(
            d is not None and axis.position_of(d) is not None for axis, d in zip(axes, defaults.values(), strict=True)
        ):
            results.insert(0, ({place: d for place, d in defaults.items() if d is not None}, goal.value(self._rows[0])))
        return suggest_trials(axes, results, count=count, seed=seed, largest=goal.is_maximized) or None

    def _shrink(self) -> Generator[list[int]]:
        """Make the smallest change that breaks it smaller, with as many runs as are allowed."""
        broken = [
            values for run, values in self._raw_values.items() if self._search.objective.is_failure(self._rows[run])
        ]
        if not broken:
            return
        last = len(self._raw_values) + self._search.max_shrink_runs
        asking = shrink_change(self._search.axes, min(broken, key=lambda values: change_size(values, self._about)))
        try:
            batch = next(asking)
            while (first := len(self._raw_values)) + len(batch) <= last:
                yield from self._batch(batch, SMALLER)
                runs = range(first, first + len(batch))
                batch = asking.send([self._search.objective.is_failure(self._rows[run]) for run in runs])
        except StopIteration:
            pass
