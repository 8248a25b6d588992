"""Rejects, before the first run, values with which the scenario of a study cannot begin."""

from collections.abc import Mapping
from contextlib import suppress

from shoal.campaigns.sampling import EditableScenario, SamplingDesign, Scalar
from shoal.campaigns.search import SearchConfig
from support.located_yaml import Node

MOST_WORDS = 50  # to choose from
MOST_RUNS = 10_000  # whose draws are looked at
BESIDE = 8  # draws of all other values beside which a value is tried: it is to blame if none of them goes with it


class DryRun:
    """Tries values of a study in its scenario. `lines` are where the distributions are, by the place of their value."""

    def __init__(
        self, draft: EditableScenario, design: SamplingDesign, lines: Mapping[str, Node], fixed: Mapping[str, object]
    ):
        self._draft, self._design, self._lines, self._fixed = draft, design, lines, fixed

    def first_valid_values(self, most: int) -> Mapping[str, object]:
        """The values of the first run that can begin; values that do not go together may cost a run, not a study.

        Raises the error of the tree at the line of the distribution whose value is wrong, else the scenario's.
        """
        first = self._design.scenario_values(0)
        for run in range(min(most, BESIDE)):
            with suppress(ValueError):
                self._draft.scenario({**self._fixed, **self._design.scenario_values(run)})
                first = self._design.scenario_values(run)
                break
            self._blame(run)
        try:
            self._draft.dry_run({**self._fixed, **first})
        except ValueError:
            if self._is_fine(self._fixed):  # else no value is to blame
                for place, value in first.items():
                    try:
                        self._draft.dry_run({**self._fixed, place: value})
                    except ValueError as error:
                        self._refuse(place, value, error)
            raise
        return {**self._fixed, **first}

    def check_extreme_values(self, first: Mapping[str, object], most: int, search: SearchConfig | None) -> None:
        """Reject words, and the smallest and largest numbers, with which no run can begin.

        Where values exclude each other in a later run, its row reports it.
        """
        self._check_words(first)
        if search is not None:
            for axis in search.axes.values():
                for cell in (axis.levels[0], axis.levels[-1]) if axis.is_ordered else ():
                    self._try_alone(axis.place, self._design.distributions[axis.place].append_unit(cell))
            return
        for run in self._design.extreme_runs(min(most, MOST_RUNS)):
            try:
                self._draft.scenario({**self._fixed, **self._design.scenario_values(run)})
            except ValueError:
                self._blame(run)

    def _check_words(self, first: Mapping[str, object]) -> None:
        words = [(place, cell) for place, found in self._design.distributions.items() for cell in found.levels]
        for place, cell in [item for item in words if isinstance(item[1], str)][:MOST_WORDS]:
            try:
                self._draft.dry_run({**first, place: cell})
            except ValueError as error:
                self._refuse(place, cell, error)

    def _blame(self, run: int) -> None:
        """Reject each value of a run that goes with nothing; none if the scenario is wrong as it is."""
        if not self._is_read(self._fixed):
            return
        for place, value in self._design.scenario_values(run).items():
            self._try_alone(place, value, f" in run {run}")

    def _try_alone(self, place: str, value: Scalar, when: str = "") -> None:
        """Reject a value with which no draw of the others can begin, nor the scenario as it is."""
        try:
            self._draft.scenario({**self._fixed, place: value})
        except ValueError as error:
            draws = (self._design.scenario_values(run) for run in range(BESIDE))
            if not any(self._is_read({**self._fixed, **values, place: value}) for values in draws):
                self._refuse(place, value, error, when)

    def _is_read(self, values: Mapping[str, object]) -> bool:
        try:
            self._draft.scenario(values)
        except ValueError:
            return False
        return True

    def _is_fine(self, values: Mapping[str, object]) -> bool:
        try:
            self._draft.dry_run(values)
        except ValueError:
            return False
        return True

    def _refuse(self, place: str, value: Scalar, error: ValueError, when: str = "") -> None:
        is_endless = self._design.distributions[place].text.startswith("normal:")
        hint = "; truncated: {mean: M, deviation: D, from: A, to: B} has an end" if is_endless else ""
        self._lines[place].fail(f"{place} = {value}{when}: {error}{hint}")
