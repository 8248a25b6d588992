"""Refuses, before the first run, values with which the scenario of a study cannot begin."""

from collections.abc import Iterator, Mapping

from imc.schema.yamltree import Node
from shoal.campaigns.draws import Changeable, Design, Distribution, Scalar
from shoal.campaigns.search import Search

MOST_WORDS = 50  # to choose from
MOST_RUNS = 10_000  # whose draws are looked at


class Rehearsal:
    """Tries values of a study in its scenario. `lines` are where the distributions are, by the place of their value."""

    def __init__(self, draft: Changeable, design: Design, lines: Mapping[str, Node], fixed: Mapping[str, object]):
        self._draft, self._design, self._lines, self._fixed = draft, design, lines, fixed

    def check(self, most: int, search: Search | None) -> None:
        """Refuse what the first run cannot have; words, and the smallest and largest numbers, that others cannot have.

        Raises the error of the tree at the line of the distribution, that of the scenario if several values do not
        go together in the first run. Where this happens in a later run, its row tells it.
        """
        first = {**self._fixed, **self._design.values(0)}
        try:
            self._draft.rehearse(first)
        except ValueError:
            if self._is_fine(self._fixed):  # else no value is to blame
                for place, value in self._design.values(0).items():
                    try:
                        self._draft.rehearse({**self._fixed, place: value})
                    except ValueError as error:
                        self._refuse(place, value, error)
            raise
        self._check_words(first)
        if search is None:
            self._check_draws(most)
            return
        for axis in search.axes.values():
            for cell in (axis.cells[0], axis.cells[-1]) if axis.ordered else ():
                self._check_alone(axis.place, self._distribution(axis.place).written(cell))

    def _is_fine(self, values: Mapping[str, object]) -> bool:
        try:
            self._draft.rehearse(values)
        except ValueError:
            return False
        return True

    def _check_words(self, first: Mapping[str, object]) -> None:
        words = [(place, cell) for place, found in self._design.varied.items() for cell in found.cells]
        for place, cell in [item for item in words if isinstance(item[1], str)][:MOST_WORDS]:
            try:
                self._draft.rehearse({**first, place: cell})
            except ValueError as error:
                self._refuse(place, cell, error)

    def _check_draws(self, most: int) -> None:
        for run in dict.fromkeys(self._extremes(min(most, MOST_RUNS))):
            values = self._design.values(run)
            try:
                self._draft.scenario({**self._fixed, **values})
            except ValueError:
                for place, value in values.items():
                    self._check_alone(place, value, f" in run {run}")

    def _extremes(self, count: int) -> Iterator[int]:
        """The runs that draw the smallest and the largest number of each value."""
        numbers = [self._design.numbers(run) for run in range(count)]
        for place, found in self._design.varied.items():
            if not any(isinstance(cell, str) for cell in found.cells):
                drawn = [float(values[place]) for values in numbers]
                yield drawn.index(min(drawn))
                yield drawn.index(max(drawn))

    def _check_alone(self, place: str, value: Scalar, when: str = "") -> None:
        try:
            self._draft.scenario({**self._fixed, place: value})
        except ValueError as error:
            self._refuse(place, value, error, when)

    def _refuse(self, place: str, value: Scalar, error: ValueError, when: str = "") -> None:
        is_endless = self._distribution(place).text.startswith("normal:")
        hint = "; truncated: {mean: M, deviation: D, from: A, to: B} has an end" if is_endless else ""
        self._lines[place].fail(f"{place} = {value}{when}: {error}{hint}")

    def _distribution(self, place: str) -> Distribution:
        return self._design.varied[place]
