"""Makes one data set of several that have runs of the same study."""

import json
import shutil
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from shoal.campaigns.campaign import log_folder
from shoal.campaigns.dataset import DataSet, DataSetError, Recording, difference, is_data_set, open_data_set
from shoal.campaigns.jobs import Row, is_finished

_APART = ("cpu", "finished")  # columns in which a run that was done twice may differ
_APART_GROUPS = ("logs.", "hashes.")  # a run has these with a log only


@dataclass(frozen=True)
class Merged:
    """A data set made of others, of `most` runs if it is whole.

    `missing` runs are in none of them, `unfinished` ones have not ended; `twice` is how many rows were not the first of
    their run.
    """

    data: DataSet
    most: int
    missing: tuple[int, ...]
    unfinished: tuple[int, ...]
    twice: int


def merge(folders: Sequence[DataSet], out: Path) -> Merged:
    """Put the runs of data sets of one study into the folder `out`, with their logs.

    If `out` is a data set already, its runs stay, and count as those of one more. A run that several have counts once,
    and they must agree on it; one that did not end gives way to one that did. Runs after the end of a campaign are left
    out. The result is what the campaign would have made alone: it can go on there. Raises DataSetError for data sets of
    another study or version, or runs that are not the same; OSError.
    """
    if not folders:
        raise DataSetError("there is no data set to merge")
    first = folders[0]
    for data in folders[1:]:
        if why := difference(data.about, first.about):
            raise DataSetError(f"{data.folder} has, beside {first.folder}, {why}")
    there = [open_data_set(out)] if is_data_set(out) else []
    most = max(_most(data) for data in [*folders, *there])
    rows, sources, twice = _united(folders)
    with Recording(out, {**first.about, **_where(folders), "most": most}) as recording:
        kept = dict(recording.data.rows)
        for run in sorted(rows):
            row, source = rows[run], sources[run].folder
            if run in kept:
                _check_equal(kept[run], out, row, source)
            elif run < most:
                recording.add(_with_logs(row, source, out))
        data = recording.data
        missing = tuple(run for run in range(most) if run not in data.rows)
        unfinished = tuple(int(row["run"]) for row in data.counted if not is_finished(row))
        if not missing:
            recording.finish(most)
        data.write()
    return Merged(data, most, missing, unfinished, twice)


def _most(data: DataSet) -> int:
    """How many runs the whole campaign has."""
    return data.end if data.end is not None else int(data.about.get("most", 0))


def _where(folders: Sequence[DataSet]) -> dict[str, Any]:
    """Study and code of a data set whose study's file is on this computer, else of the first one."""
    about = next((data.about for data in folders if Path(data.about["file"]).is_file()), folders[0].about)
    return {key: about[key] for key in ("file", "code") if key in about}


def _united(folders: Sequence[DataSet]) -> tuple[dict[int, Row], dict[int, DataSet], int]:
    """The row of each run, and whose it is; and how often there was another one."""
    rows: dict[int, Row] = {}
    sources: dict[int, DataSet] = {}
    twice = 0
    for data in folders:
        for row in data.counted:
            run = int(row["run"])
            if run in rows:
                twice += 1
                _check_equal(rows[run], sources[run].folder, row, data.folder)
            if run not in rows or (is_finished(row) and not is_finished(rows[run])):
                rows[run], sources[run] = row, data
    return rows, sources, twice


def _check_equal(a: Row, place: Path, b: Row, other: Path) -> None:
    """Refuse a run that went in two ways. Equal texts are equal numbers, also NaN."""
    if not (is_finished(a) and is_finished(b)):
        return
    differ = [name for name in sorted(a.keys() | b.keys()) if not _is_apart(name) and _text(a, name) != _text(b, name)]
    differ += [name for name in sorted(a.keys() & b.keys()) if name.startswith("hashes.") and a[name] != b[name]]
    if differ:
        raise DataSetError(f"run {a['run']} is not the same in {place} and in {other}: {', '.join(differ)}")


def _is_apart(name: str) -> bool:
    return name in _APART or name.startswith(_APART_GROUPS)


def _text(row: Mapping[str, Any], name: str) -> str | None:
    return json.dumps(row[name]) if name in row else None


def _with_logs(row: Row, source: Path, out: Path) -> Row:
    """The row, after its logs were copied; without them if they are not there."""
    run = int(row["run"])
    theirs, ours = log_folder(source, run), log_folder(out, run)
    if not any(name.startswith("logs.") for name in row) or theirs == ours:
        return row
    if not theirs.is_dir():
        return {name: value for name, value in row.items() if not name.startswith("logs.")}
    shutil.rmtree(ours, ignore_errors=True)  # of a merge that was not ended
    shutil.copytree(theirs, ours, symlinks=True)
    return row
