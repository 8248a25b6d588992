"""Connected sets of pixels in a picture of which few pixels stand out."""

from typing import Any

import numpy as np
from numpy.typing import NDArray

Integers = NDArray[np.integer[Any]]


def label_components(rows: Integers, columns: Integers) -> tuple[Integers, int]:
    """The number (n,) of the set to which each pixel (n,) belongs, from 0 on, and how many sets there are.

    Pixels come row by row, from the left; those that touch at a corner belong together.
    """
    if len(rows) == 0:
        return np.empty(0, np.int64), 0
    begins = np.ones(len(rows), np.bool_)
    begins[1:] = (rows[1:] != rows[:-1]) | (columns[1:] != columns[:-1] + 1)
    first = np.flatnonzero(begins)
    last = np.append(first[1:], len(rows)) - 1
    left, right = _touching(rows[first], columns[first], columns[last])
    names = np.arange(len(first))
    while True:
        before = names.copy()
        least = np.minimum(names[left], names[right])
        np.minimum.at(names, left, least)
        np.minimum.at(names, right, least)
        names = names[names]
        if np.array_equal(names, before):
            break
    kept, numbers = np.unique(names, return_inverse=True)
    return numbers.reshape(-1)[np.cumsum(begins) - 1], len(kept)


def _touching(row: Integers, first: Integers, last: Integers) -> tuple[Integers, Integers]:
    """Pairs of runs of neighboring rows that touch; runs (n,) are ordered by row, and cover columns first to last."""
    stride = int(last.max()) + 3
    here, end = (row + 1) * stride + first, (row + 1) * stride + last
    # of the next row: those that end right of this one's begin, and begin left of its end
    low = np.searchsorted(end, here + stride - 1)
    high = np.searchsorted(here, end + stride + 1, side="right")
    counts = np.maximum(high - low, 0)
    upper = np.repeat(np.arange(len(row)), counts)
    within = np.arange(len(upper)) - np.repeat(np.cumsum(counts) - counts, counts)
    return upper, np.repeat(low, counts) + within
