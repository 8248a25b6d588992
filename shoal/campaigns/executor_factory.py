"""Executors of the runs of a study: processes of this computer, or on a cluster."""

from collections.abc import Callable, Generator
from contextlib import contextmanager
from functools import partial
from pathlib import Path
from tempfile import TemporaryDirectory

from shoal.campaigns.jobs import JobExecutor, ProcessPool, RunJob, StudyRunner, TimedRunner, make_timed_runner
from shoal.campaigns.studies import OriginalPathsExecutor, Study, Workspace, WorkspaceRunner


@contextmanager
def open_executor(
    study: Study,
    *,
    make_runner: Callable[[], RunJob] = StudyRunner,
    workers: int | None = None,
    wall_limit: float,
    on: str = "",
    on_notice: Callable[[str], None] = lambda _: None,
) -> Generator[JobExecutor]:
    """An engine for the runs of a study, until the end of the block.

    Processes use the files of the study as they were when it was read; with `workers` 0 this process uses them as they
    are. `on` is the address of a cluster, such as dask://scheduler:8786, of which `on_notice` receives the workers that
    are rejected; `make_runner` and `workers` are for this computer.
    Raises OSError, also if nothing is at the address, ModuleNotFoundError without the extra, ValueError for others.
    """
    if on:
        from shoal.campaigns.cluster import DaskExecutor  # which needs this module

        with DaskExecutor(on, study, wall_limit=wall_limit, on_notice=on_notice) as cluster:
            yield cluster
        return
    only_failed = study.logs == "failed"
    if workers == 0:
        with ProcessPool(0, make_runner=partial(make_timed_runner, make_runner, only_failed)) as pool:
            yield pool
        return
    with TemporaryDirectory(prefix="shoal-", ignore_cleanup_errors=True) as folder:
        workspace = study.bundle.unpack(Path(folder, "site"))
        settled = partial(make_workspace_runner, workspace, make_runner, only_failed)
        with ProcessPool(workers, make_runner=settled, wall_limit=wall_limit, folder=Path(folder)) as pool:
            yield OriginalPathsExecutor(pool, workspace)


def make_workspace_runner(workspace: Workspace, make_runner: Callable[[], RunJob], only_failed: bool) -> TimedRunner:
    """Makes in a process what does the jobs there, with the files of a workspace."""
    workspace.configure_process()
    return TimedRunner(WorkspaceRunner(workspace, make_runner()), only_failed)
