"""A campaign's result folder: its study, and one crash-safe row per run."""

import json
from collections.abc import Iterator, Mapping
from dataclasses import dataclass, field
from pathlib import Path
from types import TracebackType
from typing import Any, cast

from shoal.campaigns.jobs import ResultRow, is_finished
from shoal.campaigns.pass_rate import PassRate
from shoal.campaigns.provenance import software_versions
from shoal.campaigns.results.append_log import AppendLog, Record, read_append_log
from shoal.campaigns.results.arrow_parquet import pandas_frame, write_parquet
from shoal.campaigns.studies import Study
from support.terminal_text import quoted

JOURNAL, TABLE, LOGS = "runs.journal", "runs.parquet", "logs"
_END, _MOST, _UNTIL = "end", "most", "until"


class ResultsError(ValueError):
    """A folder that is no data set, or that of another study."""


@dataclass
class CampaignResults:
    """The runs of a campaign, by number. `metadata` describes the study.

    `damaged_lines` is how many lines could not be read.

    `end` is the number of runs after which it was complete; those with a higher number are not part of it. A part of
    a campaign, see `Shard`, has only some of the numbers below.
    """

    folder: Path
    metadata: dict[str, Any]
    rows: dict[int, ResultRow] = field(default_factory=dict[int, ResultRow])
    end: int | None = None
    damaged_lines: int = 0

    @property
    def counted_rows(self) -> list[ResultRow]:
        """The rows that belong to the campaign, ordered by run."""
        most = self.end if self.end is not None else max(self.rows, default=-1) + 1
        return [self.rows[run] for run in sorted(self.rows) if run < most]

    @property
    def pass_rate(self) -> PassRate:
        """Pass rate of the runs that ended; the results of the others are unknown."""
        rows = self.counted_rows
        known = [row for row in rows if is_finished(row)]
        passed = len([row for row in known if row["passed"]])
        return PassRate(passed, len(known), self.confidence, len(rows) - len(known), str(self.metadata["sampling"]))

    @property
    def confidence(self) -> float:
        return float(self.metadata.get("confidence", 0.95))

    @property
    def progress_text(self) -> str:
        """Number of finished runs, of an unfinished campaign; empty for a finished one."""
        if self.end is not None:
            return ""
        done = len([row for row in self.rows.values() if is_finished(row)])
        most = f"at most {self.metadata[_MOST]}" if self.metadata.get(_UNTIL) else str(self.metadata[_MOST])
        return f"{done} of {most} runs done"

    @property
    def name(self) -> str:
        return str(self.metadata["study"])

    def row(self, run: int) -> ResultRow:
        """The row of a run. Raises ResultsError that lists the runs there."""
        if run not in self.rows:
            last = max(self.rows, default=-1)
            known = f"it has runs 0 to {last}" if last > 0 else "it has run 0 only" if last == 0 else "it has none"
            raise ResultsError(f"{self.folder} has no run {run}; {known}")
        return self.rows[run]

    def data_frame(self) -> Any:
        """The rows as a pandas data frame, with the number of the run as its index."""
        return pandas_frame(self.counted_rows)

    def write_parquet(self) -> Path:
        """Write all rows as Parquet, in one step. Raises OSError; the older file stays."""
        words = {key: value if isinstance(value, str) else json.dumps(value) for key, value in self.metadata.items()}
        write_parquet(self.folder / TABLE, self.counted_rows, words)
        return self.folder / TABLE

    def apply_record(self, record: Record) -> None:
        """A record of the journal: that of a run, or the end."""
        if _END in record:
            self.end = record[_END]
        elif _MOST in record:
            self.metadata.update(record)
        elif isinstance(record.get("run"), int):
            self.rows[record["run"]] = record


def has_results(folder: Path) -> bool:
    """Whether a folder has a data set, also one without a run."""
    path = folder / JOURNAL
    return path.is_file() and path.stat().st_size > 0


def open_results(folder: Path) -> CampaignResults:
    """The data set in a folder, also of a campaign that is not over. Raises ResultsError, and OSError."""
    path = folder / JOURNAL
    if not path.is_file():
        raise ResultsError(f"{folder} is not the data set of a campaign: it has no {JOURNAL}")
    return _from_records(folder, *read_append_log(path))


def _from_records(folder: Path, records: list[Record], damaged: int) -> CampaignResults:
    if not records or "digest" not in records[0]:
        raise ResultsError(f"{folder / JOURNAL} does not name its study: its first line is damaged")
    found = CampaignResults(folder, records[0], damaged_lines=damaged)
    for record in records[1:]:
        found.apply_record(record)
    return found


class ResultsWriter:
    """A data set that is being made, described by `about`; only one process can have it open. Close it.

    Runs that did not end are left out of what it has, so that they are done again. Raises ResultsError if the folder
    has runs of another study or of other versions, AppendLogInUse, and OSError.
    """

    def __init__(self, folder: Path, about: Mapping[str, Any]):
        folder.mkdir(parents=True, exist_ok=True)
        self._journal = AppendLog(folder / JOURNAL)
        try:
            if self._journal.records:
                self.results: CampaignResults = _from_records(
                    folder, self._journal.records, self._journal.damaged_lines
                )
                if why := explain_mismatch(self.results.metadata, about):
                    raise ResultsError(f"{folder} has {why}; name another folder with -o")
                self.results.rows = {run: row for run, row in self.results.rows.items() if is_finished(row)}
                wanted = {key: about.get(key) for key in (_MOST, _UNTIL)}
                if wanted != {key: self.results.metadata.get(key) for key in wanted}:
                    self._add(wanted)
                if self.results.end is not None:
                    self._add({_END: None})
            else:
                self.results = CampaignResults(folder, dict(about))
                self._journal.append(about)
        except BaseException:
            self._journal.close()
            raise

    def __enter__(self) -> "ResultsWriter":
        return self

    def __exit__(self, kind: type[BaseException] | None, error: BaseException | None, _: TracebackType | None) -> None:
        self._journal.close()

    def add_row(self, row: ResultRow) -> None:
        """A run; it is on the disk, or OSError is raised."""
        self._add(row)

    def mark_complete(self, end: int) -> None:
        """The campaign is over after `end` runs."""
        self._add({_END: end})
        self._journal.sync()

    def _add(self, record: Mapping[str, Any]) -> None:
        self._journal.append(record)
        self.results.apply_record(dict(record))


def study_metadata(study: Study) -> dict[str, Any]:
    """Content of the first line of a journal, and of the metadata of the Parquet file.

    `runs` are those that all draws depend on, if they do; `most` is how many there are to be, or fewer if it has an
    `until`; `code` are folders with the user's modules.
    """
    varied = {name: found.text for name, found in study.design.distributions.items()}
    search = study.search
    return {
        "study": study.name,
        "description": study.description,
        "file": str(study.file.resolve()),
        "digest": study.digest,
        "seed": study.seed,
        "sampling": "search" if search is not None else study.design.sampling,
        "runs": study.design.runs,
        "varied": varied,
        "units": {name: found.unit for name, found in study.design.distributions.items()},
        "fixed": dict(study.fixed),
        "logs": study.logs,
        "code": list(study.bundle.code),
        "most": study.stopping_rule.max_runs,
        _UNTIL: study.stopping_rule.target_width is not None,
        "confidence": study.stopping_rule.confidence,
        "versions": f"{software_versions()}, {search.sampler_version}" if search is not None else software_versions(),
        **({"search": search.to_dict()} if search is not None else {}),
    }


def explain_mismatch(had: Mapping[str, Any], about: Mapping[str, Any]) -> str:
    """Reason why runs of one study and version cannot be among those of another, after "it has"; empty if they can."""
    if had["digest"] != about["digest"]:
        name = quoted(cast(str, had["study"]))
        differ = list(_differing(had, about))
        if not differ and had["runs"] != about["runs"]:
            kind = "of a search" if about["sampling"] == "search" else f"with sampling: {about['sampling']}"
            counts = f"{had['runs']} runs, not {about['runs']}"
            return f"study {name} with {counts}: the number of runs {kind} cannot be changed"
        search = ", or a key of the search," if "search" in about else ""
        why = f"the scenario or one of its files{search} has changed"
        if differ:
            why = f"{' and '.join(differ)} {'differs' if len(differ) == 1 else 'differ'}"
        return f"runs of another study, {name}: {why}"
    if had["versions"] != about["versions"]:
        return f"runs of another version: they were made with {had['versions']}, others with {about['versions']}"
    return ""


def _differing(had: Mapping[str, Any], about: Mapping[str, Any]) -> Iterator[str]:
    for key in ("study", "seed", "sampling"):
        if had.get(key) != about.get(key):
            yield f"{key} ({had.get(key)}, not {about.get(key)})"
    for key, words in (("varied", "what varies"), ("fixed", "--set")):
        before, now = had.get(key, {}), about.get(key, {})
        if places := [place for place in {**before, **now} if before.get(place) != now.get(place)]:
            yield f"{words} ({', '.join(places)})"
    if had.get("search") != about.get("search"):
        yield "search"
