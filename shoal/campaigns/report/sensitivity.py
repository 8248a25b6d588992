"""Sensitivity of a campaign's outputs to its inputs: rank correlations and Sobol indices."""

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from shoal.campaigns.jobs import ResultRow
from shoal.campaigns.optional_import import import_optional
from shoal.campaigns.results import CampaignResults

LEAST = 10  # runs for a correlation
MOST_CHOICES = 30  # of one input
LEAST_FIRST_ORDER, MOST_FIRST_ORDER = 100, 2000  # runs for indices without a design
Columns = dict[str, Any]
"""Arrays of floats by name, one value per run, NaN where there is none."""


@dataclass(frozen=True)
class SobolIndex:
    """The share of an output's variance that an input has: alone, and with all that it acts together with.

    Each has the half-width of its interval of 95 %. `total_order` is NaN where the design does not allow it.
    """

    first_order: float
    first_order_half_width: float
    total_order: float = math.nan
    total_order_half_width: float = math.nan


def input_arrays(rows: Sequence[ResultRow]) -> Columns:
    """Drawn values that are numbers and vary."""
    return _varying(rows, ("values.",))


def output_arrays(rows: Sequence[ResultRow]) -> Columns:
    """Metrics and margins that are finite in some runs and vary."""
    return _varying(rows, ("metrics.", "margins."))


def group_rows_by_choice(rows: Sequence[ResultRow]) -> dict[str, dict[str, Any]]:
    """The places of the rows that drew each choice, of each input that is chosen among a few words or truths."""
    names = dict.fromkeys(name for row in rows for name in row if name.startswith("values."))
    found: dict[str, dict[str, Any]] = {}
    for name in sorted(names):
        drawn = [row.get(name) for row in rows]
        if not any(isinstance(value, str | bool) for value in drawn):
            continue
        words = sorted({str(value) for value in drawn if value is not None})
        if 1 < len(words) <= MOST_CHOICES:
            found[name] = {word: np.array([k for k, value in enumerate(drawn) if str(value) == word]) for word in words}
    return found


def eta_squared(groups: Sequence[Any], output: Any) -> float:
    """The share of the variance of an output's ranks that lies between groups of its runs; NaN if there are too few.

    It is eta squared of H of Kruskal and Wallis (1952): 0 if the groups are alike, 8/9 if three equal ones do not
    overlap.
    """
    good = [group[np.isfinite(output[group])] for group in groups]
    whole = np.concatenate(good)
    if len(whole) < LEAST or float(np.ptp(output[whole])) == 0.0:
        return math.nan
    ranks = np.full(len(output), np.nan)
    ranks[whole] = import_optional("scipy.stats").rankdata(output[whole])
    middle, spread = float(np.mean(ranks[whole])), float(np.var(ranks[whole]))
    between = math.fsum(len(group) * (float(np.mean(ranks[group])) - middle) ** 2 for group in good if len(group))
    return between / (len(whole) * spread)


def _varying(rows: Sequence[ResultRow], prefixes: tuple[str, ...]) -> Columns:
    names = dict.fromkeys(name for row in rows for name in row if name.startswith(prefixes))
    found: Columns = {}
    for name in sorted(names):
        values = [row.get(name, math.nan) for row in rows]
        if any(isinstance(value, str) for value in values):
            continue
        column = np.array([math.nan if value is None else value for value in values], float)
        finite = column[np.isfinite(column)]
        if len(finite) and float(np.ptp(finite)) > 0.0:
            found[name] = np.where(np.isfinite(column), column, np.nan)
    return found


def rank_correlations(inputs: Columns, outputs: Columns) -> dict[tuple[str, str], tuple[float, int]]:
    """Spearman's coefficient of each input with each output, and the number of runs that it is from."""
    rank = import_optional("scipy.stats").rankdata
    found: dict[tuple[str, str], tuple[float, int]] = {}
    whole = {name: rank(column) for name, column in {**inputs, **outputs}.items() if not np.isnan(column).any()}
    for name, x in inputs.items():
        for output, y in outputs.items():
            if name in whole and output in whole:
                ranks, count = (whole[name], whole[output]), len(x)
            else:
                both = np.isfinite(x) & np.isfinite(y)
                ranks, count = (rank(x[both]), rank(y[both])), int(np.sum(both))
            if count < LEAST or any(float(np.ptp(column)) == 0.0 for column in ranks):
                continue
            found[name, output] = float(np.corrcoef(*ranks)[0, 1]), count
    return found


def critical_correlation(count: int) -> float:
    """Limit below which 95 % of the coefficients of `count` runs are if there is no relation."""
    return 1.96 / math.sqrt(max(count - 1, 1))


def sobol_indices(
    data: CampaignResults, rows: Sequence[ResultRow], outputs: Columns
) -> dict[tuple[str, str], SobolIndex]:
    """Sobol indices by SALib, by input and output.

    From a campaign with sampling `saltelli`, first and total ones (Saltelli 2010); from random or evenly spread runs,
    first ones by RBD-FAST (Tarantola 2006, Plischke 2010). None for grids, or if there are too few runs. Noise between
    runs is a part of the variance and of no input's share: it is the same in all runs of a block, which share a seed.
    """
    sampling = str(data.metadata["sampling"])
    names = [f"values.{name}" for name in data.metadata["varied"]]
    inputs = input_arrays(rows)
    if sampling == "grid" or not names or any(name not in inputs for name in names):
        return {}
    problem = {"num_vars": len(names), "names": names, "bounds": [[0.0, 1.0]] * len(names)}
    if sampling == "saltelli":
        return _total(problem, rows, outputs)
    if any("grid" in text.partition(":")[0] for text in data.metadata["varied"].values()):
        return {}
    return _first_order(problem, inputs, outputs)


def _total(
    problem: Mapping[str, Any], rows: Sequence[ResultRow], outputs: Columns
) -> dict[tuple[str, str], SobolIndex]:
    size = len(problem["names"]) + 2
    if len(rows) < 8 * size or [row["run"] for row in rows] != list(range(len(rows))):
        return {}
    analyze = import_optional("SALib.analyze.sobol").analyze
    count = len(rows) // size
    seeds: Any = np.array([row.get("seed", 0) for row in rows[: count * size]]).reshape(count, size)
    is_alike = (seeds == seeds[:, :1]).all(axis=1)
    found: dict[tuple[str, str], SobolIndex] = {}
    for output, column in outputs.items():
        blocks = column[: len(column) // size * size].reshape(-1, size)
        whole = blocks[np.isfinite(blocks).all(axis=1) & is_alike]
        if len(whole) < 8 or float(np.ptp(whole)) == 0.0:
            continue
        made = analyze(problem, whole.ravel(), calc_second_order=False, num_resamples=50, seed=1)
        for place, name in enumerate(problem["names"]):
            words = ("S1", "S1_conf", "ST", "ST_conf")
            found[name, output] = SobolIndex(*(float(made[word][place]) for word in words))
    return found


def _first_order(problem: Mapping[str, Any], inputs: Columns, outputs: Columns) -> dict[tuple[str, str], SobolIndex]:
    analyze = import_optional("SALib.analyze.rbd_fast").analyze
    columns: Any = np.column_stack([inputs[name] for name in problem["names"]])
    found: dict[tuple[str, str], SobolIndex] = {}
    for output, column in outputs.items():
        good = np.isfinite(columns).all(axis=1) & np.isfinite(column)
        x, y = columns[good][:MOST_FIRST_ORDER], column[good][:MOST_FIRST_ORDER]
        if len(y) < LEAST_FIRST_ORDER or float(np.ptp(y)) == 0.0:
            continue
        made = analyze(problem, x, y, M=10, num_resamples=10, seed=1)
        for place, name in enumerate(problem["names"]):
            found[name, output] = SobolIndex(float(made["S1"][place]), float(made["S1_conf"][place]))
    return found
