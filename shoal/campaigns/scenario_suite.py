"""Runs scenario files once each, and those that failed again with a log."""

import os
import time
from collections.abc import Generator, Iterable, Iterator, Mapping
from contextlib import suppress
from dataclasses import dataclass, replace
from pathlib import Path

from shoal.campaigns.jobs import SCENARIO_SUFFIX, Job, ProcessPool, UnfinishedResult, UnreadableResult
from shoal.campaigns.results import JOURNAL, TABLE
from shoal.scenarios import ScenarioFileError, ScenarioResult, load_document

SKIPPED_IF_CONTAINS = ("pyvenv.cfg", "CACHEDIR.TAG", JOURNAL, TABLE)
"""A folder below with one of these has files of other programs, or what a search has found, which fails by design."""


@dataclass(frozen=True)
class ScenarioOutcome:
    """Result of a job. `wall_time` is its duration (s).

    `is_reproducible` is False if the run with a log went otherwise than the one before, so that something in it does
    not depend on file and seed alone.
    """

    job: Job
    result: ScenarioResult
    wall_time: float
    is_reproducible: bool = True

    @property
    def is_unreadable(self) -> bool:
        """Whether the file cannot be read, so that there was no run."""
        return isinstance(self.result, UnreadableResult)


def find_scenario_files(paths: Iterable[Path]) -> list[Path]:
    """The files given, and all `*.scenario.yaml` below the folders given, each once, sorted within a folder.

    Folders below that are hidden, a virtual environment or the data set of a campaign are left out. Raises
    FileNotFoundError.
    """
    found: dict[Path, Path] = {}
    for path in paths:
        if not path.exists():
            raise FileNotFoundError(2, "no such file or folder", str(path))
        for file in _below(path) if path.is_dir() else [path]:
            found.setdefault(file.resolve(), file)
    return list(found.values())


def _below(folder: Path) -> Iterator[Path]:
    for place, folders, files in os.walk(folder):
        folders[:] = sorted(name for name in folders if not _is_left_out(Path(place, name)))
        yield from (Path(place, name) for name in sorted(files) if name.endswith(SCENARIO_SUFFIX))


def _is_left_out(folder: Path) -> bool:
    return folder.name.startswith(".") or any((folder / name).exists() for name in SKIPPED_IF_CONTAINS)


def variants_of(path: Path, values: Mapping[str, object]) -> list[dict[str, object]]:
    """The values of each run of a file: one for each of its variants, unless a value or the file chooses one.

    Mistakes of the file are reported by its run.
    """
    if "variant" not in values:
        with suppress(OSError, ScenarioFileError):
            names = load_document(path).variant_names if path.is_file() else []
            return [{**values, "variant": name} for name in names] or [dict(values)]
    return [dict(values)]


def run_jobs(pool: ProcessPool, jobs: Iterable[Job]) -> Generator[ScenarioOutcome]:
    """Do jobs, and measure the time of each. Raises OSError if no process can be started."""
    began: dict[int | str, float] = {}

    def given() -> Iterator[Job]:
        for job in jobs:
            began[job.key] = time.monotonic()
            yield job

    for job, result in pool.run(given()):
        yield ScenarioOutcome(job, result, time.monotonic() - began[job.key])


def rerun_with_logs(
    pool: ProcessPool, outcomes: Iterable[ScenarioOutcome], log_root: Path
) -> Generator[ScenarioOutcome]:
    """Repeat, with logs in `log_root`/<name of the file>, the runs that have ended: their results then.

    The outcome is otherwise the first one.
    """
    first = {
        outcome.job.key: outcome
        for outcome in outcomes
        if not isinstance(outcome.result, UnreadableResult | UnfinishedResult)
    }
    jobs = (replace(outcome.job, log_root=log_root / outcome.job.name) for outcome in first.values())
    for job, result in pool.run(jobs):
        before = first[job.key]
        kept = replace(before.result, logs=result.logs, hashes=result.hashes)
        yield replace(before, result=kept, is_reproducible=result.fingerprint == before.result.fingerprint)
