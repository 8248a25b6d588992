"""Keeps what a search has found, as files beside its data set."""

from pathlib import Path

from shoal.campaigns.jobs import ResultRow
from shoal.campaigns.results import CampaignResults, ResultsError
from shoal.campaigns.search import SearchFindings, summarize_search, write_scenario, write_tuned_options
from shoal.campaigns.studies import Study, load_study


def compute_findings(data: CampaignResults) -> SearchFindings | None:
    """Compute the findings of a search from its runs; None for other campaigns."""
    return summarize_search(data.metadata["search"], data.counted_rows) if "search" in data.metadata else None


def write_findings(study: Study, data: CampaignResults) -> list[Path]:
    """Write what a search has found: a scenario that fails, or the best one and its parameters.

    Raises ResultsError if the files of the study have changed since, and OSError.
    """
    shown = compute_findings(data)
    if shown is None or shown.row_to_keep is None:
        return []
    runs = study.design.runs
    if load_study(study.file, fixed=study.fixed, runs=runs, has_begun=True).digest != study.digest:
        raise ResultsError(f"{study.file}, or a file that it names, has changed: what was found cannot be written")
    numbers = shown.changed_values_of_run(shown.row_to_keep)
    values = {**study.fixed, **study.with_units(numbers)}
    words = [
        f"Found by a search of {study.file.name}.",
        *describe_run(shown, shown.row_to_keep, data.metadata["units"]),
    ]
    written = [write_scenario(study.scenario_path, values, data.folder, words)]
    if not shown.objective.seeks_failure:
        written += write_tuned_options(study.scenario_path, study.with_units(numbers), data.folder, words)
    return written


def describe_run(shown: SearchFindings, row: ResultRow, units: dict[str, str]) -> list[str]:
    """Lines with the result of a run of a search, and its changes."""
    goal, before = shown.objective, shown.baseline
    was = f"; as it was: {goal.value(before):.4g}" if before is not None and before is not row else ""
    lines = [f"{goal.text}: {goal.value(row):.4g}{was}"]
    if goal.seeks_failure and row["reason"]:
        lines.append(row["reason"])
    for place, value in shown.changed_values_of_run(row).items():
        unit = f" {units[place]}" if units.get(place) else ""
        default = shown.default_scenario_value(place)
        usual = "" if default is None else f", instead of {_short(default)}{unit}"
        lines.append(f"{place} = {_short(value)}{unit}{usual}")
    return lines


def _short(value: object) -> str:
    return f"{value:.10g}" if isinstance(value, float) else str(value)
