"""Makes a change of a scenario smaller while it still fails."""

import math
from collections.abc import Generator, Mapping

from shoal.campaigns.search.search_space import SearchAxis, ValueChanges

NEAR = 0.02  # of the whole change: closer to what passes is not looked
PARTS = 4  # into which a change is cut at a time

FailureQueries = Generator[list[ValueChanges], list[bool], ValueChanges]
"""Asks whether some changes fail, and returns the smallest that does."""


def shrink_change(axes: Mapping[str, SearchAxis], values: ValueChanges) -> FailureQueries:
    """Leave values out that the failure does not need, then bring the others near to those of the scenario.

    What it asks depends on the answers alone. Without any of the values the scenario passes.
    """
    values = yield from _leave_out(values)
    for place in list(values):
        axis = axes[place]
        if axis.numeric_default == axis.numeric_default:
            values = yield from _approach(axis, values)
    return values


def _leave_out(values: ValueChanges) -> FailureQueries:
    while len(values) > 1:
        failing = yield [_without(values, place) for place in values]
        needless = [place for place, fails in zip(values, failing, strict=True) if fails]
        if not needless:
            break
        fewest = _without(values, *needless)
        if len(needless) > 1 and fewest:
            [fails] = yield [fewest]
            if fails:
                return (yield from _leave_out(fewest))
        values = _without(values, needless[0])
    return values


def _without(values: ValueChanges, *places: str) -> ValueChanges:
    return {place: value for place, value in values.items() if place not in places}


def _approach(axis: SearchAxis, values: ValueChanges) -> FailureQueries:
    """Find the value nearest to the default that fails, as far as those between behave."""
    good, bad = axis.numeric_default, float(values[axis.place])
    whole = abs(bad - good)
    while abs(bad - good) > NEAR * whole:
        points = _between(axis, good, bad)
        if not points:
            break
        failing = yield [{**values, axis.place: point} for point in points]
        first = next((number for number, fails in enumerate(failing) if fails), len(points))
        if first > 0:
            good = float(points[first - 1])
        if first < len(points):
            values = {**values, axis.place: points[first]}
            bad = float(points[first])
    return values


def _between(axis: SearchAxis, good: float, bad: float) -> list[float | int]:
    """Values between two, at most `PARTS` - 1, from the first to the second, with few digits."""
    low, high = min(good, bad), max(good, bad)
    if axis.is_continuous:
        step = (bad - good) / PARTS
        digits = min(15, -math.floor(math.log10(abs(step))))
        points: list[float | int] = [round(good + number * step, digits) for number in range(1, PARTS)]
        points = [point for point in dict.fromkeys(points) if low < point < high]
    else:
        cells = [cell for cell in axis.levels if isinstance(cell, int | float) and low < cell < high]
        ordered = cells if good < bad else cells[::-1]
        points = [ordered[len(ordered) * number // PARTS] for number in range(PARTS)] if ordered else []
    return list(dict.fromkeys(points))
