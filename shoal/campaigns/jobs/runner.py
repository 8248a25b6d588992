"""Runs jobs in the calling process."""

import contextlib
from pathlib import Path

from shoal.campaigns.jobs.job import Job, UnreadableResult
from shoal.campaigns.sampling import describe_value_error, load_template
from shoal.scenarios import ScenarioDocument, ScenarioFileError, ScenarioResult, load_document, run
from support.file_errors import describe_os_error

MAX_CACHED_DRAFTS = 16  # drafts


class ScenarioRunner:
    """Runs scenarios. The file of one is read once, also for many jobs.

    If the values of jobs are those of `--set`, by `is_set`, an error names it instead of a line of the file.
    """

    def __init__(self, *, is_set: bool = False) -> None:
        self._is_set = is_set
        self._drafts: dict[Path, ScenarioDocument] = {}

    def __call__(self, job: Job) -> ScenarioResult:
        """Run a job's scenario; a file or a value that is wrong is an `UnreadableResult`."""
        try:
            scenario = self._draft(job.path).scenario(job.values)
        except OSError as error:
            return job.failed_result(describe_os_error(error, job.path), UnreadableResult)
        except ScenarioFileError as error:
            return job.failed_result(f"{self._error_text(job, error)}{self.error_hint(job.path)}", UnreadableResult)
        try:
            return run(scenario, seed=job.seed, log_root=job.log_root)
        except ScenarioFileError as error:
            return job.failed_result(str(error), UnreadableResult)

    def load_document(self, path: Path) -> ScenarioDocument:
        """The draft of a file."""
        return load_document(path)

    def error_hint(self, path: Path) -> str:
        """Suggestion for a file that is wrong; empty without one."""
        with contextlib.suppress(ScenarioFileError, OSError):
            if not path.is_file():
                return ""
            for place in load_template(path, ScenarioDocument).distributions:
                return f" (a value that varies, as {place} does, is for `shoal campaign`)"
        return ""

    def _error_text(self, job: Job, error: ScenarioFileError) -> str:
        draft = self._drafts.get(job.path)
        return describe_value_error(draft, job.values, error) if self._is_set and draft is not None else str(error)

    def _draft(self, path: Path) -> ScenarioDocument:
        if path not in self._drafts:
            if path.exists() and not path.is_file():
                raise ScenarioFileError("a scenario is a file", path)  # a pipe would never end
            if len(self._drafts) >= MAX_CACHED_DRAFTS:
                del self._drafts[next(iter(self._drafts))]
            self._drafts[path] = self.load_document(path)
        return self._drafts[path]


class StudyRunner(ScenarioRunner):
    """Runs scenarios, also those that are inside a study or have distributions in place of values."""

    def load_document(self, path: Path) -> ScenarioDocument:
        """The draft of a scenario's file or of a study's."""
        return load_template(path, ScenarioDocument).draft

    def error_hint(self, path: Path) -> str:
        """The hint is empty: values may vary here."""
        return ""
