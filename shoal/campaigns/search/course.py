"""The runs of a search, in rounds: each follows from the rows of those before, however long ago they were done."""

from collections.abc import Generator, Mapping
from typing import Any

from shoal.campaigns.draws import share
from shoal.campaigns.jobs import Row
from shoal.campaigns.search.axes import Values, size, values_of
from shoal.campaigns.search.shrinking import shrink
from shoal.campaigns.search.spec import Search
from shoal.campaigns.search.trials import ask

PART, AS_IT_IS, TRIAL, SMALLER = "part", "as it is", "trial", "smaller"


class Course:
    """What a search runs: the scenario as it is, trials, and changes that are made smaller.

    `rows` are those of the runs that are done, by number, and may grow; `end` is the number of all runs once it is
    known. If the scenario fails as it is, there is nothing to look for.
    """

    def __init__(self, search: Search, trials: int, seed: int, rows: Mapping[int, Row]):
        self._search, self._trials, self._seed, self._rows = search, trials, seed, rows
        self._about = search.about()["axes"]
        self._numbers: dict[int, Values] = {}
        self._parts: dict[int, str] = {}
        self.end: int | None = None

    def look(self) -> None:
        """Nothing follows from a run alone; see `rounds`."""

    def numbers(self, run: int) -> Values:
        """What a run changes, without units."""
        return self._numbers[run]

    def marks(self, run: int) -> dict[str, Any]:
        """What its row says besides."""
        return {PART: self._parts[run]}

    def rounds(self) -> Generator[list[int]]:
        """The runs that are left, in lists; all of one must be done before the next is asked for."""
        yield from self._round([{}], AS_IT_IS)
        goal = self._search.goal
        if not goal.is_broken(self._rows[0]):
            while (batch := self._next()) is not None:
                yield from self._round(batch, TRIAL)
            if goal.breaks and self._search.shrink:
                yield from self._smaller()
        self.end = len(self._numbers)

    def _round(self, batch: list[Values], part: str) -> Generator[list[int]]:
        first = len(self._numbers)
        for run, values in enumerate(batch, first):
            self._numbers[run], self._parts[run] = values, part
        left = [run for run in range(first, first + len(batch)) if not self._is_done(run)]
        if left:
            yield left

    def _is_done(self, run: int) -> bool:
        row = self._rows.get(run)
        return (
            row is not None
            and row.get(PART) == self._parts[run]
            and values_of(row, self._search.axes) == self._numbers[run]
        )

    def _next(self) -> list[Values] | None:
        """The next trials; None if there are enough, or nothing is left to try."""
        first = len(self._numbers)
        count = min(self._search.at_a_time, self._trials - first)
        if count <= 0:
            return None
        rows = [self._rows.get(run) for run in range(first, first + count)]
        known = [values_of(row, self._search.axes) for row in rows if row is not None and row.get(PART) == TRIAL]
        if len(known) == count:
            return known
        seed = int(share(self._seed, "search", first) * 2**31)
        axes, goal = list(self._search.axes.values()), self._search.goal
        told = [(values, goal.value(self._rows[run])) for run, values in self._numbers.items() if run]
        defaults = {axis.place: axis.default for axis in axes}
        if all(d is not None and axis.share(d) is not None for axis, d in zip(axes, defaults.values(), strict=True)):
            told.insert(0, ({place: d for place, d in defaults.items() if d is not None}, goal.value(self._rows[0])))
        return ask(axes, told, count=count, seed=seed, largest=goal.is_largest) or None

    def _smaller(self) -> Generator[list[int]]:
        """Make the smallest change that breaks it smaller, with as many runs as are allowed."""
        broken = [values for run, values in self._numbers.items() if self._search.goal.is_broken(self._rows[run])]
        if not broken:
            return
        last = len(self._numbers) + self._search.shrink
        asking = shrink(self._search.axes, min(broken, key=lambda values: size(values, self._about)))
        try:
            batch = next(asking)
            while (first := len(self._numbers)) + len(batch) <= last:
                yield from self._round(batch, SMALLER)
                runs = range(first, first + len(batch))
                batch = asking.send([self._search.goal.is_broken(self._rows[run]) for run in runs])
        except StopIteration:
            pass
