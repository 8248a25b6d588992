"""The values among which a search chooses, one axis for each that varies."""

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from itertools import pairwise
from typing import Any

import numpy as np

from shoal.campaigns.draws import Distribution, Scalar

STEPS = 1000  # to which a distribution without cells is cut
TAIL = 0.001  # of a distribution without an end on that side
Values = dict[str, Scalar]
"""Values by their place in the scenario, without their units; what is not there is as in the scenario."""


@dataclass(frozen=True)
class Axis:
    """What a value may be: `cells`, in rising order if they are `ordered`, and also between them if `continuous`.

    `default` is the value of the scenario in the same unit, None if it has none.
    """

    place: str
    cells: tuple[Scalar, ...]
    ordered: bool
    continuous: bool = False
    default: Scalar | None = None

    @property
    def span(self) -> float:
        """The length of the axis in its unit; NaN without an order."""
        return float(self.cells[-1]) - float(self.cells[0]) if self.ordered else math.nan

    @property
    def number(self) -> float:
        """The default, if it is a number from which one can go along the axis; else NaN."""
        if not self.ordered or self.default is None or isinstance(self.default, str | bool):
            return math.nan
        return float(self.default)

    def share(self, value: Scalar) -> float | int | None:
        """Where a value is: from 0 to 1 if there is an order, else its number; None if it is not on the axis."""
        if not self.ordered:
            return self.cells.index(value) if value in self.cells else None
        if isinstance(value, str) or not float(self.cells[0]) <= float(value) <= float(self.cells[-1]):
            return None
        return float(np.interp(float(value), np.asarray(self.cells, float), np.linspace(0.0, 1.0, len(self.cells))))

    def cell(self, share: float | int) -> Scalar:
        """The value at a share, or with a number."""
        return self.cells[round(share * (len(self.cells) - 1)) if self.ordered else int(share)]

    def about(self) -> dict[str, Any]:
        """What a data set says of it."""
        return {"default": self.default, "span": self.span if self.ordered else None}


def axis_of(place: str, found: Distribution, default: Scalar | None) -> Axis:
    """The axis of a distribution. Raises ValueError if it has not two values at least, or values without bound."""
    if found.quantile is None:
        cells = tuple(
            cell for number, cell in enumerate(found.cells) if not found.weights or found.weights[number] > 0.0
        )
        numbers = [cell for cell in cells if isinstance(cell, int | float) and not isinstance(cell, bool)]
        ordered = len(numbers) == len(cells) and all(a < b for a, b in pairwise(numbers))
        made = Axis(place, cells, ordered, default=default)
    else:
        made = Axis(place, _cut(found), ordered=True, continuous=True, default=default)
    if len(made.cells) < 2:
        raise ValueError("a search needs two values at least to choose from")
    return made


def _cut(found: Distribution) -> tuple[Scalar, ...]:
    """Values of equal shares, from end to end or without tails, with no more digits than tell them apart."""
    first, last = (float(value) for value in found.at([0.0, 1.0]))
    low, high = 0.0 if math.isfinite(first) else TAIL, 1.0 if math.isfinite(last) else 1.0 - TAIL
    values = [float(value) for value in found.at([low + (high - low) * step / STEPS for step in range(STEPS + 1)])]
    if not all(map(math.isfinite, values)) or not values[0] < values[-1]:
        raise ValueError("a search cannot go through this distribution: its values are not finite")
    inner = [_rounded(value, value - before) for before, value in pairwise(values[:-1]) if value > before]
    return tuple(dict.fromkeys([values[0], *(v for v in inner if values[0] < v < values[-1]), values[-1]]))


def _rounded(value: float, step: float) -> float:
    """A value with no more digits than tell it from one that is a step away."""
    return round(value, min(15, max(0, math.ceil(-math.log10(step)))))


def size(values: Mapping[str, Scalar], axes: Mapping[str, Mapping[str, Any]]) -> tuple[int, float]:
    """How large a change of the scenario is: how many values are others, and how far they have gone along their axes.

    `axes` is as `Axis.about` tells, by place.
    """
    return len(values), math.fsum(_departure(value, axes[place]) for place, value in values.items())


def _departure(value: Scalar, axis: Mapping[str, Any]) -> float:
    default, span = axis["default"], axis["span"]
    if not span or default is None or isinstance(value, str) or isinstance(default, str):
        return 1.0
    return abs(float(value) - float(default)) / span


def values_of(row: Mapping[str, Any], places: Sequence[str] | Mapping[str, object]) -> Values:
    """The values of a run that are not as in the scenario."""
    return {place: row[f"values.{place}"] for place in places if row.get(f"values.{place}") is not None}
