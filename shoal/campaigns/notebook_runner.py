"""Campaigns from a notebook."""

import warnings
from collections.abc import Mapping
from pathlib import Path
from typing import Any

from shoal.campaigns.studies import load_study
from shoal.campaigns.study_execution import run_study


def run(
    study: str | Path,
    folder: str | Path | None = None,
    *,
    fixed: Mapping[str, object] | None = None,
    runs: int | None = None,
    workers: int | None = None,
    on: str = "",
) -> Any:
    """Do what is left of a study, and return a pandas data frame with a row per run, its number as the index.

    Columns are `passed`, `margin`, `error`, `seconds`, `seed` ..., and by group `values.PATH`, `metrics.NAME`,
    `margins.NAME`, `verdicts.NAME`, `outcomes.VEHICLE`. The data set is in `folder`, by default campaigns/NAME.
    `fixed` and `runs` are as for `load_study`. With `workers` 0 all is done in this process, with `on` on a cluster,
    such as dask://scheduler:8786. Raises ValueError with file and line for a mistake in the study, OSError if nothing
    is at the address, ModuleNotFoundError without the extra `campaigns`, or `cluster`.
    """
    plan = load_study(Path(study), fixed=fixed, runs=runs)
    for text in plan.search.deprecations if plan.search else ():
        warnings.warn(text, DeprecationWarning, stacklevel=2)
    return run_study(plan, Path(folder or Path("campaigns") / plan.name), workers=workers, on=on).data_frame()
