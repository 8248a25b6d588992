"""Interpolation in a table of numbers."""

from bisect import bisect_right
from collections.abc import Sequence


def interpolate(x: float, xs: Sequence[float], ys: Sequence[float]) -> float:
    """Piecewise linear interpolation, extrapolated beyond both ends.

    `xs` and `ys` have the same length, at least 2; `xs` are ascending.
    """
    at = min(max(1, bisect_right(xs, x)), len(xs) - 1)
    x0, x1, y0, y1 = xs[at - 1], xs[at], ys[at - 1], ys[at]
    return y0 + (x - x0) * (y1 - y0) / (x1 - x0) if x1 != x0 else y0
