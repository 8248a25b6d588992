"""Compares what was detected with what there is: misses, false alarms, exchanged numbers, and errors."""

import math
from itertools import pairwise
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from world.detection.ground_projection import Floats

Bools = NDArray[np.bool_]
Integers = NDArray[np.integer[Any]]

REACH, REACH_SHARE = 1.0, 0.15  # m, and of the distance: what is farther from a thing is no detection of it


class ObjectScore(NamedTuple):
    """Score of the detections of an object.

    `pictures` are the pictures that showed it (-1 if that is not known), `detections` its detections, `ids` their
    numbers in order of appearance, `switches` how often the number changed. `rms` (m) is the error of the offsets;
    `nees` the mean of e' P^-1 e, which is 2 for errors e as large as by their covariance P; NaN without one.
    """

    pictures: int
    detections: int
    ids: tuple[int, ...]
    switches: int
    rms: float
    nees: float

    @property
    def missed_picture_count(self) -> int:
        """Pictures that showed it without a detection."""
        return max(0, self.pictures - self.detections)


class DetectionStatistics(NamedTuple):
    """Scores of all things, and the detections that are of none: how many, and of how many numbers."""

    objects: tuple[ObjectScore, ...]
    false_alarms: int
    false_ids: int


def match_objects(offsets: Floats, truth: Floats) -> Integers:
    """The thing (n,) that each detection is of, -1 for none; from offsets (n, 2) and those of all things (n, k, 2)."""
    if truth.shape[1] == 0:
        return np.full(len(offsets), -1)
    apart = np.linalg.norm(offsets[:, None] - truth, axis=-1)
    reach = REACH + REACH_SHARE * np.linalg.norm(truth, axis=-1)
    nearest = np.argmin(apart / reach, axis=1)
    rows = np.arange(len(offsets))
    return np.where(apart[rows, nearest] <= reach[rows, nearest], nearest, -1)


def detection_statistics(
    ids: Integers, offsets: Floats, truth: Floats, spreads: Floats, shown: Bools | None
) -> DetectionStatistics:
    """Judge detections (n,), in order of time.

    `offsets` (n, 2) and those of all things at the same times (n, k, 2) are in m; `spreads` (n, 2, 2) are covariances,
    NaN where there is none. `shown` (m, k) is which picture showed which thing; None if that is not known.
    """
    of = match_objects(offsets, truth)
    things: list[ObjectScore] = []
    for k in range(truth.shape[1]):
        mine = np.flatnonzero(of == k)
        errors = offsets[mine] - truth[mine, k]
        numbers: list[int] = ids[mine].tolist()
        known = np.isfinite(spreads[mine]).all(axis=(1, 2))
        inverse: Floats = np.asarray(np.linalg.inv(spreads[mine][known]), np.float64)
        weighed = np.einsum("ni,nij,nj->n", errors[known], inverse, errors[known]).tolist()
        things.append(
            ObjectScore(
                -1 if shown is None else int(np.count_nonzero(shown[:, k])),
                len(mine),
                tuple(dict.fromkeys(numbers)),
                len([1 for a, b in pairwise(numbers) if a != b]),
                math.sqrt(math.fsum(np.square(errors).ravel().tolist()) / len(mine)) if len(mine) else math.nan,
                math.fsum(weighed) / len(weighed) if weighed else math.nan,
            )
        )
    false = ids[of < 0]
    return DetectionStatistics(tuple(things), len(false), len(np.unique(false)))
