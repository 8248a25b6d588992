"""Repeats one run of a campaign, unchanged or with other values."""

from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path

from shoal.campaigns.jobs import Job, ResultRow, RunJob
from shoal.campaigns.provenance import software_versions
from shoal.campaigns.results import CampaignResults, ResultsError
from shoal.campaigns.sampling import DraftFactory
from shoal.campaigns.search import changed_values
from shoal.campaigns.studies import UNNAMED_FILE_HINT, Study, load_study
from shoal.scenarios import ScenarioDocument, ScenarioResult


@dataclass(frozen=True)
class RepeatedRun:
    """A run that was done again: its row then, its result now, and what is not as it was although it should be.

    `values` are those of now, by their place; `original_values` are those of then.
    """

    row: ResultRow
    result: ScenarioResult
    values: Mapping[str, object]
    original_values: Mapping[str, object]
    differences: tuple[str, ...]


def reload_study(
    data: CampaignResults, *, make_draft: DraftFactory = ScenarioDocument, file: Path | None = None
) -> Study:
    """The study that a data set is of, which may now be another `file`.

    Raises ResultsError if it has changed since, or is not there any more.
    """
    path = file or Path(str(data.metadata["file"]))
    if not path.is_file():
        raise ResultsError(f"{data.folder} is of the study {path}, which is not there; --study FILE gives its place")
    study = load_study(
        path, make_draft=make_draft, fixed=data.metadata["fixed"], runs=data.metadata["runs"] or None, has_begun=True
    )
    if study.digest != data.metadata["digest"]:
        raise ResultsError(f"{path}, or a file that it names, has changed since {data.folder} was made")
    return study


def repeat_run(
    data: CampaignResults,
    run: int,
    run_job: RunJob,
    *,
    changes: Mapping[str, object] | None = None,
    log_root: Path | None = None,
    make_draft: DraftFactory = ScenarioDocument,
    file: Path | None = None,
) -> RepeatedRun:
    """Do a run again; with `changes`, by path, some of its values are others, and nothing has to be as it was.
    `file` is the study's, if it is not where it was.

    Raises ResultsError, and what reading the study raises.
    """
    row, study = data.row(run), reload_study(data, make_draft=make_draft, file=file)
    drawn = study.with_units(changed_values(row, study.design.distributions))
    values = {**drawn, **(changes or {})}
    result = run_job(
        Job(run, study.scenario_path, values, study.run_seed(run), log_root.absolute() if log_root else None)
    )
    return RepeatedRun(row, result, values, drawn, () if changes else tuple(_differences(row, result)))


def _differences(row: ResultRow, result: ScenarioResult) -> list[str]:
    found: list[str] = []
    if row["fingerprint"] != result.fingerprint:
        found.append(f"fingerprint {result.fingerprint[:16] or '-'}, was {row['fingerprint'][:16] or '-'}")
    if result.error != row["error"].removesuffix(UNNAMED_FILE_HINT):
        found.append(f"error {result.error or 'none'!r}, was {row['error'] or 'none'!r}")
    for vehicle, digest in result.hashes.items():
        had = row.get(f"hashes.{vehicle}")
        if had is not None and had != digest:
            found.append(f"log of {vehicle} has hash {digest[:16]}, was {had[:16]}")
    if found and row["versions"] != software_versions():
        found.append(f"it was made with {row['versions']}, and this is {software_versions()}")
    return found
