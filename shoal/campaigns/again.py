"""Does one run of a campaign again, as it was or with other values."""

from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path

from shoal.campaigns.dataset import DataSet, DataSetError
from shoal.campaigns.draws import Make
from shoal.campaigns.jobs import Do, Job, Row
from shoal.campaigns.search import values_of
from shoal.campaigns.studies import UNNAMED, Study, load_study
from shoal.campaigns.versions import versions
from shoal.scenarios import ScenarioDocument, ScenarioResult


@dataclass(frozen=True)
class Rerun:
    """A run that was done again: its row then, its result now, and what is not as it was although it should be.

    `values` are those of now, by their place; `drawn` are those of then.
    """

    row: Row
    result: ScenarioResult
    values: Mapping[str, object]
    drawn: Mapping[str, object]
    differences: tuple[str, ...]


def study_of(data: DataSet, *, make: Make = ScenarioDocument, file: Path | None = None) -> Study:
    """The study that a data set is of, which may now be another `file`.

    Raises DataSetError if it has changed since, or is not there any more.
    """
    path = file or Path(str(data.about["file"]))
    if not path.is_file():
        raise DataSetError(f"{data.folder} is of the study {path}, which is not there; --study FILE says where it is")
    study = load_study(path, make=make, fixed=data.about["fixed"], runs=data.about["runs"] or None, has_begun=True)
    if study.digest != data.about["digest"]:
        raise DataSetError(f"{path}, or a file that it names, has changed since {data.folder} was made")
    return study


def rerun(
    data: DataSet,
    run: int,
    do: Do,
    *,
    changes: Mapping[str, object] | None = None,
    log_root: Path | None = None,
    make: Make = ScenarioDocument,
    file: Path | None = None,
) -> Rerun:
    """Do a run again; with `changes`, by path, some of its values are others, and nothing has to be as it was.
    `file` is the study's, if it is not where it was.

    Raises DataSetError, and what reading the study raises.
    """
    row, study = data.row(run), study_of(data, make=make, file=file)
    drawn = study.written(values_of(row, study.design.varied))
    values = {**drawn, **(changes or {})}
    result = do(Job(run, study.path, values, study.seed_of(run), log_root.absolute() if log_root else None))
    return Rerun(row, result, values, drawn, () if changes else tuple(_differences(row, result)))


def _differences(row: Row, result: ScenarioResult) -> list[str]:
    found: list[str] = []
    if row["fingerprint"] != result.fingerprint:
        found.append(f"fingerprint {result.fingerprint[:16] or '-'}, was {row['fingerprint'][:16] or '-'}")
    if result.error != row["error"].removesuffix(UNNAMED):
        found.append(f"error {result.error or 'none'!r}, was {row['error'] or 'none'!r}")
    for vehicle, digest in result.hashes.items():
        had = row.get(f"hashes.{vehicle}")
        if had is not None and had != digest:
            found.append(f"log of {vehicle} has hash {digest[:16]}, was {had[:16]}")
    if found and row["versions"] != versions():
        found.append(f"it was made with {row['versions']}, and this is {versions()}")
    return found
