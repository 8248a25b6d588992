"""The values among which a search chooses, one axis for each that varies."""

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from itertools import pairwise
from typing import Any

import numpy as np

from shoal.campaigns.sampling import Distribution, Scalar

STEPS = 1000  # to which a distribution without cells is cut
TAIL = 0.001  # of a distribution without an end on that side
ValueChanges = dict[str, Scalar]
"""Values by their place in the scenario, without their units; what is not there is as in the scenario."""


@dataclass(frozen=True)
class SearchAxis:
    """Range of a value: `levels`, in rising order if `is_ordered`, and also between them if `is_continuous`.

    `default` is the value of the scenario in the same unit, None if it has none.
    """

    place: str
    levels: tuple[Scalar, ...]
    is_ordered: bool
    is_continuous: bool = False
    default: Scalar | None = None

    @property
    def span(self) -> float:
        """The length of the axis in its unit; NaN without an order."""
        return float(self.levels[-1]) - float(self.levels[0]) if self.is_ordered else math.nan

    @property
    def numeric_default(self) -> float:
        """The default, if it is a number from which one can go along the axis; else NaN."""
        if not self.is_ordered or self.default is None or isinstance(self.default, str | bool):
            return math.nan
        return float(self.default)

    def position_of(self, value: Scalar) -> float | int | None:
        """Position of a value: from 0 to 1 if there is an order, else its number; None if it is not on the axis."""
        if not self.is_ordered:
            return self.levels.index(value) if value in self.levels else None
        if isinstance(value, str) or not float(self.levels[0]) <= float(value) <= float(self.levels[-1]):
            return None
        return float(np.interp(float(value), np.asarray(self.levels, float), np.linspace(0.0, 1.0, len(self.levels))))

    def value_at(self, share: float | int) -> Scalar:
        """The value at a share, or with a number."""
        return self.levels[round(share * (len(self.levels) - 1)) if self.is_ordered else int(share)]

    def to_dict(self) -> dict[str, Any]:
        """Entry of the axis in a data set."""
        return {"default": self.default, "span": self.span if self.is_ordered else None}


def make_axis(place: str, found: Distribution, default: Scalar | None) -> SearchAxis:
    """The axis of a distribution. Raises ValueError if it has not two values at least, or values without bound."""
    if found.inverse_cdf is None:
        cells = tuple(
            cell for number, cell in enumerate(found.levels) if not found.weights or found.weights[number] > 0.0
        )
        numbers = [cell for cell in cells if isinstance(cell, int | float) and not isinstance(cell, bool)]
        ordered = len(numbers) == len(cells) and all(a < b for a, b in pairwise(numbers))
        made = SearchAxis(place, cells, ordered, default=default)
    else:
        made = SearchAxis(place, _discretize(found), is_ordered=True, is_continuous=True, default=default)
    if len(made.levels) < 2:
        raise ValueError("a search needs two values at least to choose from")
    return made


def _discretize(found: Distribution) -> tuple[Scalar, ...]:
    """Values of equal shares, from end to end or without tails, with no more digits than distinguish them."""
    first, last = (float(value) for value in found.quantiles([0.0, 1.0]))
    low, high = 0.0 if math.isfinite(first) else TAIL, 1.0 if math.isfinite(last) else 1.0 - TAIL
    values = [
        float(value) for value in found.quantiles([low + (high - low) * step / STEPS for step in range(STEPS + 1)])
    ]
    if not all(map(math.isfinite, values)) or not values[0] < values[-1]:
        raise ValueError("a search cannot go through this distribution: its values are not finite")
    inner = [_rounded(value, value - before) for before, value in pairwise(values[:-1]) if value > before]
    return tuple(dict.fromkeys([values[0], *(v for v in inner if values[0] < v < values[-1]), values[-1]]))


def _rounded(value: float, step: float) -> float:
    """A value with no more digits than distinguish it from one that is a step away."""
    return round(value, min(15, max(0, math.ceil(-math.log10(step)))))


def change_size(values: Mapping[str, Scalar], axes: Mapping[str, Mapping[str, Any]]) -> tuple[int, float]:
    """Size of a change of the scenario: the number of changed values, and their distance along their axes.

    `axes` is as `SearchAxis.to_dict` returns, by place.
    """
    return len(values), math.fsum(_departure(value, axes[place]) for place, value in values.items())


def _departure(value: Scalar, axis: Mapping[str, Any]) -> float:
    default, span = axis["default"], axis["span"]
    if not span or default is None or isinstance(value, str) or isinstance(default, str):
        return 1.0
    return abs(float(value) - float(default)) / span


def changed_values(row: Mapping[str, Any], places: Sequence[str] | Mapping[str, object]) -> ValueChanges:
    """The values of a run that are not as in the scenario."""
    return {place: row[f"values.{place}"] for place in places if row.get(f"values.{place}") is not None}
