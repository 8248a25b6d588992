"""The folder of a campaign: what it is of, and a row for each run, whatever has ended the process that wrote it."""

import json
from collections.abc import Mapping
from dataclasses import dataclass, field
from pathlib import Path
from types import TracebackType
from typing import Any, cast

from runtime.problem import quoted
from shoal.campaigns.journal import Journal, Record, read_journal
from shoal.campaigns.rates import Rate
from shoal.campaigns.rows import Row
from shoal.campaigns.study import Study
from shoal.campaigns.table import frame_of, write_table
from shoal.campaigns.versions import versions

JOURNAL, TABLE, LOGS = "runs.journal", "runs.parquet", "logs"
_END = "end"


class DataSetError(ValueError):
    """A folder that is no data set, or that of another study."""


@dataclass
class DataSet:
    """The runs of a campaign, by number. `about` says what they are of, `damaged` how many lines could not be read.

    `end` is the number of runs after which it was complete; those with a higher number are not part of it.
    """

    folder: Path
    about: dict[str, Any]
    rows: dict[int, Row] = field(default_factory=dict[int, Row])
    end: int | None = None
    damaged: int = 0

    @property
    def counted(self) -> list[Row]:
        """The rows that belong to the campaign, ordered by run."""
        most = self.end if self.end is not None else max(self.rows, default=-1) + 1
        return [self.rows[run] for run in sorted(self.rows) if run < most]

    @property
    def rate(self) -> Rate:
        rows = self.counted
        passed = len([row for row in rows if row["passed"]])
        return Rate(passed, len(rows), float(self.about.get("confidence", 0.95)))

    @property
    def name(self) -> str:
        return str(self.about["study"])

    def row(self, run: int) -> Row:
        """The row of a run. Raises DataSetError that says which there are."""
        if run not in self.rows:
            known = f"it has runs 0 to {max(self.rows)}" if self.rows else "it has none"
            raise DataSetError(f"{self.folder} has no run {run}; {known}")
        return self.rows[run]

    def frame(self) -> Any:
        """The rows as a pandas data frame, with the number of the run as its index."""
        return frame_of(self.counted)

    def write(self) -> Path:
        """Write all rows as Parquet, in one step. Raises OSError; the older file stays."""
        words = {key: value if isinstance(value, str) else json.dumps(value) for key, value in self.about.items()}
        write_table(self.folder / TABLE, self.counted, words)
        return self.folder / TABLE

    def take(self, record: Record) -> None:
        """A record of the journal: that of a run, or the end."""
        if _END in record:
            self.end = record[_END]
        elif isinstance(record.get("run"), int):
            self.rows[record["run"]] = record


def open_data_set(folder: Path) -> DataSet:
    """The data set in a folder, also of a campaign that is not over. Raises DataSetError, and OSError."""
    path = folder / JOURNAL
    if not path.is_file():
        raise DataSetError(f"{folder} is not the data set of a campaign: it has no {JOURNAL}")
    return _data_set(folder, *read_journal(path))


def _data_set(folder: Path, records: list[Record], damaged: int) -> DataSet:
    if not records or "digest" not in records[0]:
        raise DataSetError(f"{folder / JOURNAL} does not say of which study it is: its first line is damaged")
    found = DataSet(folder, records[0], damaged=damaged)
    for record in records[1:]:
        found.take(record)
    return found


class Recording:
    """A data set that is being made; only one process can have it open. Close it.

    Raises DataSetError if the folder has runs of another study or of other versions, JournalInUse, and OSError.
    """

    def __init__(self, folder: Path, study: Study, *, confidence: float = 0.95):
        folder.mkdir(parents=True, exist_ok=True)
        about = about_study(study, confidence)
        self._journal = Journal(folder / JOURNAL)
        try:
            if self._journal.records:
                self.data = _data_set(folder, self._journal.records, self._journal.damaged)
                _check_same(self.data, about)
                if self.data.end is not None:
                    self._add({_END: None})
            else:
                self.data = DataSet(folder, about)
                self._journal.add(about)
        except BaseException:
            self._journal.close()
            raise

    def __enter__(self) -> "Recording":
        return self

    def __exit__(self, kind: type[BaseException] | None, error: BaseException | None, _: TracebackType | None) -> None:
        self._journal.close()

    def add(self, row: Row) -> None:
        """A run; it is on the disk, or OSError is raised."""
        self._add(row)

    def finish(self, end: int) -> None:
        """The campaign is over after `end` runs."""
        self._add({_END: end})
        self._journal.sync()

    def _add(self, record: Mapping[str, Any]) -> None:
        self._journal.add(record)
        self.data.take(dict(record))


def about_study(study: Study, confidence: float) -> dict[str, Any]:
    """What the first line of a journal says, and the metadata of the Parquet file."""
    varied = {name: found.text for name, found in study.design.varied.items()}
    return {
        "study": study.name,
        "description": study.description,
        "file": str(study.file.resolve()),
        "digest": study.digest,
        "seed": study.seed,
        "sampling": study.design.sampling,
        "runs": study.design.runs,
        "varied": varied,
        "units": {name: found.unit for name, found in study.design.varied.items()},
        "fixed": dict(study.fixed),
        "confidence": confidence,
        "versions": versions(),
    }


def _check_same(data: DataSet, about: Mapping[str, Any]) -> None:
    had = data.about
    if had["digest"] != about["digest"]:
        reasons = [
            key for key in ("study", "seed", "sampling", "runs", "varied", "fixed") if had.get(key) != about[key]
        ]
        why = f"{', '.join(reasons)} differ" if reasons else "the scenario or one of its files has changed"
        raise DataSetError(
            f"{data.folder} has runs of another study, {quoted(cast(str, had['study']))}: {why}; name another folder"
        )
    if had["versions"] != about["versions"]:
        raise DataSetError(
            f"{data.folder} was begun with {had['versions']}, and this is {about['versions']}; name another folder"
        )
