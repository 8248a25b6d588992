"""Keeps what a search has found, as files beside its data set."""

from pathlib import Path

from shoal.campaigns.dataset import DataSet, DataSetError
from shoal.campaigns.jobs import Row
from shoal.campaigns.search import Findings, findings, write_options, write_scenario
from shoal.campaigns.studies import Study, load_study


def findings_of(data: DataSet) -> Findings | None:
    """What the runs of a search have shown; None for other campaigns."""
    return findings(data.about["search"], data.counted) if "search" in data.about else None


def keep_findings(study: Study, data: DataSet) -> list[Path]:
    """Write what a search has found: a scenario that fails, or the best one and its parameters.

    Raises DataSetError if the files of the study have changed since, and OSError.
    """
    shown = findings_of(data)
    if shown is None or shown.found is None:
        return []
    runs = study.design.runs
    if load_study(study.file, fixed=study.fixed, runs=runs, has_begun=True).digest != study.digest:
        raise DataSetError(f"{study.file}, or a file that it names, has changed: what was found cannot be written")
    numbers = shown.changes(shown.found)
    values = {**study.fixed, **study.written(numbers)}
    words = [f"Found by a search of {study.file.name}.", *told(shown, shown.found, data.about["units"])]
    written = [write_scenario(study.path, values, data.folder, words)]
    if not shown.goal.breaks:
        written += write_options(study.path, study.written(numbers), data.folder, words)
    return written


def told(shown: Findings, row: Row, units: dict[str, str]) -> list[str]:
    """Lines that say what came of a run of a search, and what it changes."""
    goal, before = shown.goal, shown.as_it_is
    was = f"; as it was: {goal.value(before):.4g}" if before is not None and before is not row else ""
    lines = [f"{goal.text}: {goal.value(row):.4g}{was}"]
    if goal.breaks and row["reason"]:
        lines.append(row["reason"])
    for place, value in shown.changes(row).items():
        unit = f" {units[place]}" if units.get(place) else ""
        default = shown.default(place)
        usual = "" if default is None else f", instead of {_short(default)}{unit}"
        lines.append(f"{place} = {_short(value)}{unit}{usual}")
    return lines


def _short(value: object) -> str:
    return f"{value:.10g}" if isinstance(value, float) else str(value)
