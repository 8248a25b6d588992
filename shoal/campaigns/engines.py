"""Where the runs of a study are done: in processes of this computer, or on a cluster."""

from collections.abc import Callable, Generator
from contextlib import contextmanager
from functools import partial
from pathlib import Path
from tempfile import TemporaryDirectory

from shoal.campaigns.jobs import Do, Engine, Pool, StudyRunner, Timing, timing
from shoal.campaigns.studies import Named, OnSite, Site, Study


@contextmanager
def open_engine(
    study: Study,
    *,
    make: Callable[[], Do] = StudyRunner,
    workers: int | None = None,
    wall_limit: float,
    on: str = "",
    note: Callable[[str], None] = lambda _: None,
) -> Generator[Engine]:
    """An engine for the runs of a study, until the end of the block.

    Processes use the files of the study as they were when it was read; with `workers` 0 this process uses them as they
    are. `on` is the address of a cluster, such as dask://scheduler:8786, of which `note` hears the workers that are
    refused; `make` and `workers` are for this computer.
    Raises OSError, also if nothing is at the address, ModuleNotFoundError without the extra, ValueError for others.
    """
    if on:
        from shoal.campaigns.cluster import Cluster  # which needs this module

        with Cluster(on, study, wall_limit=wall_limit, note=note) as cluster:
            yield cluster
        return
    only_failed = study.logs == "failed"
    if workers == 0:
        with Pool(0, make=partial(timing, make, only_failed)) as pool:
            yield pool
        return
    with TemporaryDirectory(prefix="shoal-", ignore_cleanup_errors=True) as folder:
        site = study.bundle.unpack(Path(folder, "site"))
        settled = partial(settle, site, make, only_failed)
        with Pool(workers, make=settled, wall_limit=wall_limit, folder=Path(folder)) as pool:
            yield Named(pool, site)


def settle(site: Site, make: Callable[[], Do], only_failed: bool) -> Timing:
    """Makes in a process what does the jobs there, with the files of a site."""
    site.enter()
    return Timing(OnSite(site, make()), only_failed)
