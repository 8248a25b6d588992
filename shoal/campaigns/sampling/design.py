"""Values of each run: drawn from the seed of the study, the name of the value and the number of the run."""

import hashlib
import math
import warnings
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from typing import Any

import numpy as np

from shoal.campaigns.optional_import import import_optional
from shoal.campaigns.sampling.distributions import Distribution, Scalar

SAMPLINGS = ("random", "latin hypercube", "sobol", "grid", "saltelli")
FIXED_SIZE_SAMPLINGS = ("latin hypercube", "grid", "saltelli")
"""Designs that depend on the number of runs, or that are worth nothing before the last one."""
_BLOCK = 1024  # runs
_BITS = 30  # of SciPy's Sobol numbers
_SECOND = "second matrix\0"


def hashed_uniform(seed: int, name: str, run: int) -> float:
    """A number above 0 and below 1 that depends on these three alone."""
    digest = hashlib.blake2b(f"{seed}\0{name}\0{run}".encode(), digest_size=8).digest()
    return ((int.from_bytes(digest) >> 11) + 0.5) * 2.0**-53


def run_seed(seed: int, run: int) -> int:
    """The seed of a run: what its sensors draw."""
    return int(hashed_uniform(seed, "", run) * 2**31)


@dataclass
class SamplingDesign:
    """The values of all runs. `runs` is their number as far as the sampling depends on it.

    A gridded value, and with sampling `grid` each one, goes through all its values while the others are drawn.
    """

    distributions: Mapping[str, Distribution]
    sampling: str
    seed: int
    runs: int
    _blocks: dict[int, list[dict[str, Scalar]]] = field(
        default_factory=dict[int, list[dict[str, Scalar]]], init=False, repr=False
    )
    _ranks: dict[str, Any] = field(default_factory=dict[str, Any], init=False, repr=False)

    @property
    def grid_names(self) -> list[str]:
        return [name for name, found in self.distributions.items() if found.is_grid or self.sampling == "grid"]

    @property
    def sampled_names(self) -> list[str]:
        gridded = set(self.grid_names)
        return [name for name in self.distributions if name not in gridded]

    @property
    def grid_size(self) -> int:
        """Number of combinations of the gridded values."""
        return math.prod(len(self.distributions[name].levels) for name in self.grid_names)

    @property
    def block_size(self) -> int:
        """The runs in a block of sampling `saltelli`."""
        return len(self.sampled_names) + 2

    def run_seed(self, run: int) -> int:
        """The seed of a run: what its sensors draw.

        The runs of a block of `saltelli` share one, so that their differences are due to the values alone: with a seed
        for each, the noise between runs would count as part of each total index.
        """
        return run_seed(self.seed, run // self.block_size if self.sampling == "saltelli" else run)

    def raw_values(self, run: int) -> dict[str, Scalar]:
        """The values of a run, by path, without their units."""
        start = run - run % _BLOCK
        if start not in self._blocks:
            while len(self._blocks) > 4:
                self._blocks.pop(next(iter(self._blocks)))
            self._blocks[start] = self._block(start)
        return self._blocks[start][run - start]

    def scenario_values(self, run: int) -> dict[str, Scalar]:
        """The values of a run as a scenario has them."""
        return {name: self.distributions[name].append_unit(number) for name, number in self.raw_values(run).items()}

    def extreme_runs(self, count: int) -> list[int]:
        """Numbers of the runs, of so many, that draw the smallest and the largest number of each value."""
        columns: dict[str, list[Any]] = {name: [] for name in self.distributions}
        for start in range(0, count, _BLOCK):
            stop = min(start + _BLOCK, count)
            for name, shares in self._quantile_columns(start, stop).items():
                found = self.distributions[name]
                columns[name] += found.quantiles(shares) if found.levels else list(shares)  # else both grow together
            for name, cells in self._grid_columns(range(start, stop)).items():
                columns[name] += cells
        numbers = [column for column in columns.values() if not any(isinstance(item, str) for item in column)]
        return list(dict.fromkeys(column.index(pick(column)) for column in numbers for pick in (min, max)))

    def _block(self, start: int) -> list[dict[str, Scalar]]:
        stop = start + _BLOCK
        columns = {
            name: self.distributions[name].quantiles(shares)
            for name, shares in self._quantile_columns(start, stop).items()
        }
        columns |= self._grid_columns(range(start, stop))
        return [{name: columns[name][place] for name in self.distributions} for place in range(_BLOCK)]

    def _grid_columns(self, runs: Sequence[int]) -> dict[str, list[Scalar]]:
        columns: dict[str, list[Scalar]] = {}
        stride = 1
        for name in reversed(self.grid_names):  # the last of the file changes from run to run
            cells = self.distributions[name].levels
            columns[name] = [cells[run // stride % len(cells)] for run in runs]
            stride *= len(cells)
        return columns

    def _quantile_columns(self, start: int, stop: int) -> dict[str, Sequence[float]]:
        names = self.sampled_names
        if self.sampling == "sobol" and names:
            return dict(zip(names, self._sobol(names, start, stop).T, strict=True))
        if self.sampling == "saltelli" and names:
            return self._saltelli(names, start, stop)
        if self.sampling == "latin hypercube":
            return {name: [self._latin_hypercube(name, run) for run in range(start, stop)] for name in names}
        return {name: [hashed_uniform(self.seed, name, run) for run in range(start, stop)] for name in names}

    def _latin_hypercube(self, name: str, run: int) -> float:
        """A share from the stratum of the run: of `runs` equal strata each run has another one."""
        if run >= self.runs:  # a block may end after the last run
            return 0.5
        if name not in self._ranks:
            keys = [hashed_uniform(self.seed, f"stratum\0{name}", number) for number in range(self.runs)]
            self._ranks[name] = np.argsort(np.argsort(keys))
        return (int(self._ranks[name][run]) + hashed_uniform(self.seed, name, run)) / self.runs

    def _sobol(self, names: Sequence[str], start: int, stop: int) -> Any:
        """Sobol numbers, the column of each name shifted by a number that depends on the seed and the name."""
        with warnings.catch_warnings():
            warnings.simplefilter("ignore", UserWarning)  # that blocks are no powers of 2
            engine = import_optional("scipy.stats.qmc").Sobol(len(names), scramble=False, bits=_BITS)
            points = engine.fast_forward(start).random(stop - start) if start else engine.random(stop)
        shifts = np.array([int(hashed_uniform(self.seed, name, -1) * 2**_BITS) for name in names], np.int64)
        return ((np.rint(points * 2**_BITS).astype(np.int64) ^ shifts) + 0.5) * 2.0**-_BITS

    def _saltelli(self, names: Sequence[str], start: int, stop: int) -> dict[str, Sequence[float]]:
        """Blocks of len(names) + 2 runs: a point, the point with one value of a second one each, the second one."""
        size = self.block_size
        first, last = start // size, -(-stop // size)
        points = self._sobol([*names, *(_SECOND + name for name in names)], first, last)
        runs = np.arange(start, stop)
        places, kinds = runs // size - first, runs % size
        taken: dict[str, Sequence[float]] = {}
        for column, name in enumerate(names):
            second = (kinds == column + 1) | (kinds == size - 1)
            taken[name] = np.where(second, points[places, len(names) + column], points[places, column])
        return taken
