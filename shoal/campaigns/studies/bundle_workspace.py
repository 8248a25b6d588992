"""Folder where a process finds the files of a study that it has by content."""

import os
import sys
from collections.abc import Generator, Iterable
from contextlib import closing
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import TypeVar

from runtime.vehicle import add_task_folder
from shoal.campaigns.jobs import Job, JobExecutor, RunJob
from shoal.campaigns.studies.user_module_dependencies import SHOAL
from shoal.scenarios import ScenarioResult, normalized_absolute_path

R = TypeVar("R", bound=ScenarioResult)
UNNAMED_FILE_HINT = "; a run has only the files of its study: is this one missing in `files`?"


class BundleError(ValueError):
    """Files that cannot travel, or bytes that are no bundle."""


@dataclass(frozen=True)
class Workspace:
    """The files of a `StudyBundle` in a folder `root`, below which each has the path that it had."""

    root: Path
    folder: str
    etc: str
    code: tuple[str, ...]
    modules: tuple[str, ...] = field(repr=False)

    def configure_process(self) -> None:
        """Let this process find the files of the bundle in place of those that it was made of."""
        for place in self.code:
            found = rebase_path(self.root, place)
            here = Path(place).resolve()
            at = next((i for i, name in enumerate(sys.path) if Path(name).resolve() == here), len(sys.path))
            sys.path[at : at + (here != SHOAL)] = [str(found)]
            add_task_folder(found)
        for name in self.modules:
            sys.modules.pop(name, None)
        os.environ["SHOAL_ROOT"] = str(self.root)
        os.environ["SHOAL_ETC"] = str(rebase_path(self.root, self.etc))
        os.chdir(rebase_path(self.root, self.folder))

    def local_path(self, path: Path) -> Path:
        """Path of a file on this computer; a relative path stays one."""
        return rebase_path(self.root, str(normalized_absolute_path(path))) if path.is_absolute() else path

    def with_original_paths(self, result: R) -> R:
        """A result that names the files by the paths that they had."""
        verdicts = tuple(
            replace(verdict, reason=self._named(verdict.reason), origin=self._named(verdict.origin))
            for verdict in result.verdicts
        )
        warnings = tuple(map(self._named, result.warnings))
        hint = UNNAMED_FILE_HINT if FileNotFoundError.__name__ in result.error else ""
        return replace(result, verdicts=verdicts, warnings=warnings, error=self._named(result.error) + hint)

    def _named(self, text: str) -> str:
        return text.replace(str(self.root), "")


@dataclass(frozen=True)
class WorkspaceRunner:
    """Runs jobs with the files of a workspace, in a process that has entered it."""

    workspace: Workspace
    run_job: RunJob

    def __call__(self, job: Job) -> ScenarioResult:
        return self.run_job(replace(job, path=self.workspace.local_path(job.path)))


@dataclass(frozen=True)
class OriginalPathsExecutor:
    """An engine whose results name the files of a workspace by the paths that they had."""

    executor: JobExecutor
    workspace: Workspace

    def run(self, jobs: Iterable[Job]) -> Generator[tuple[Job, ScenarioResult]]:
        with closing(self.executor.run(jobs)) as done:
            for job, result in done:
                yield job, self.workspace.with_original_paths(result)


def rebase_path(root: Path, path: str) -> Path:
    """The place of an absolute path below a folder. Raises BundleError if it leads out."""
    parts = Path(path).parts[1:]
    if not Path(path).is_absolute() or ".." in parts:
        raise BundleError(f"{path!r} is not an absolute path")
    return root.joinpath(*parts)
