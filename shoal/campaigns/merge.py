"""Makes one data set of several that have runs of the same study."""

import json
import shutil
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from shoal.campaigns.jobs import ResultRow, is_finished
from shoal.campaigns.results import (
    CampaignResults,
    ResultsError,
    ResultsWriter,
    explain_mismatch,
    has_results,
    open_results,
)
from shoal.campaigns.study_execution import run_log_folder

_APART = ("cpu", "finished")  # columns in which a run that was done twice may differ
_APART_GROUPS = ("logs.", "hashes.")  # a run has these with a log only


@dataclass(frozen=True)
class MergedResults:
    """A data set made of others, of `most` runs if it is whole.

    `missing` runs are in none of them, `unfinished` ones have not ended; `duplicates` is how many rows were not the
    first of their run.
    """

    data: CampaignResults
    most: int
    missing: tuple[int, ...]
    unfinished: tuple[int, ...]
    duplicates: int


def merge_results(folders: Sequence[CampaignResults], out: Path) -> MergedResults:
    """Put the runs of data sets of one study into the folder `out`, with their logs.

    If `out` is a data set already, its runs stay, and count as those of one more. A run that several have counts once,
    and they must agree on it; one that did not end gives way to one that did. Runs after the end of a campaign are left
    out. The result is what the campaign would have made alone: it can be resumed there. Raises ResultsError for data
    sets of another study or version, or runs that are not the same; OSError.
    """
    if not folders:
        raise ResultsError("there is no data set to merge")
    first = folders[0]
    for data in folders[1:]:
        if why := explain_mismatch(data.metadata, first.metadata):
            raise ResultsError(f"{data.folder} has, beside {first.folder}, {why}")
    there = [open_results(out)] if has_results(out) else []
    most = max(_most(data) for data in [*folders, *there])
    rows, sources, twice = _united(folders)
    with ResultsWriter(out, {**first.metadata, **_where(folders), "most": most}) as recording:
        kept = dict(recording.results.rows)
        for run in sorted(rows):
            row, source = rows[run], sources[run].folder
            if run in kept:
                _check_equal(kept[run], out, row, source)
            elif run < most:
                recording.add_row(_with_logs(row, source, out))
        data = recording.results
        missing = tuple(run for run in range(most) if run not in data.rows)
        unfinished = tuple(int(row["run"]) for row in data.counted_rows if not is_finished(row))
        if not missing:
            recording.mark_complete(most)
        data.write_parquet()
    return MergedResults(data, most, missing, unfinished, twice)


def _most(data: CampaignResults) -> int:
    """Number of runs of the whole campaign."""
    return data.end if data.end is not None else int(data.metadata.get("most", 0))


def _where(folders: Sequence[CampaignResults]) -> dict[str, Any]:
    """Study and code of a data set whose study's file is on this computer, else of the first one."""
    about = next((data.metadata for data in folders if Path(data.metadata["file"]).is_file()), folders[0].metadata)
    return {key: about[key] for key in ("file", "code") if key in about}


def _united(folders: Sequence[CampaignResults]) -> tuple[dict[int, ResultRow], dict[int, CampaignResults], int]:
    """The row of each run, and whose it is; and how often there was another one."""
    rows: dict[int, ResultRow] = {}
    sources: dict[int, CampaignResults] = {}
    twice = 0
    for data in folders:
        for row in data.counted_rows:
            run = int(row["run"])
            if run in rows:
                twice += 1
                _check_equal(rows[run], sources[run].folder, row, data.folder)
            if run not in rows or (is_finished(row) and not is_finished(rows[run])):
                rows[run], sources[run] = row, data
    return rows, sources, twice


def _check_equal(a: ResultRow, place: Path, b: ResultRow, other: Path) -> None:
    """Reject a run that went in two ways. Equal texts are equal numbers, also NaN."""
    if not (is_finished(a) and is_finished(b)):
        return
    differ = [name for name in sorted(a.keys() | b.keys()) if not _is_apart(name) and _text(a, name) != _text(b, name)]
    differ += [name for name in sorted(a.keys() & b.keys()) if name.startswith("hashes.") and a[name] != b[name]]
    if differ:
        raise ResultsError(f"run {a['run']} is not the same in {place} and in {other}: {', '.join(differ)}")


def _is_apart(name: str) -> bool:
    return name in _APART or name.startswith(_APART_GROUPS)


def _text(row: Mapping[str, Any], name: str) -> str | None:
    return json.dumps(row[name]) if name in row else None


def _with_logs(row: ResultRow, source: Path, out: Path) -> ResultRow:
    """The row, after its logs were copied; without them if they are not there."""
    run = int(row["run"])
    theirs, ours = run_log_folder(source, run), run_log_folder(out, run)
    if not any(name.startswith("logs.") for name in row) or theirs == ours:
        return row
    if not theirs.is_dir():
        return {name: value for name, value in row.items() if not name.startswith("logs.")}
    shutil.rmtree(ours, ignore_errors=True)  # of a merge that was not ended
    shutil.copytree(theirs, ours, symlinks=True)
    return row
