"""What runs within a worker of Dask: keeps the files of a study there, and stations that do its jobs."""

import contextlib
import json
import os
import platform
import shutil
import subprocess
import sys
import tempfile
from pathlib import Path
from threading import Lock
from typing import Any

from shoal.campaigns.cluster.arithmetic import arithmetic
from shoal.campaigns.cluster.wire import Line, packed
from shoal.campaigns.studies import read_bundle
from shoal.campaigns.versions import versions

Reply = tuple[bytes, list[tuple[str, bytes]]]
"""A line, and the files of the logs by their path below the folder for logs."""
STATION = "from shoal.campaigns.cluster.station import main; main()"
GRACE = 5.0  # s


def probe(dask_worker: Any) -> tuple[str, str, str]:
    """What the worker is called, what it computes with, and how."""
    return f"{dask_worker.name} on {platform.node()}", versions(), arithmetic()


def camp(token: str, bundle: bytes, order: Line, dask_worker: Any) -> None:
    """Prepare a worker for the jobs of a study. Raises OSError, and BundleError."""
    if token not in dask_worker.extensions:  # which the worker closes with itself
        dask_worker.extensions[token] = Camp(bundle, order, Path(dask_worker.local_directory))


def leave(token: str, dask_worker: Any) -> None:
    """End what there is for a study on a worker, also jobs that are under way."""
    found = dask_worker.extensions.pop(token, None)
    if found is not None:
        found.close()


def do(token: str, job: bytes) -> Reply | None:
    """Do a job, as a task of Dask; None if the worker has started anew and knows nothing of the study.

    Raises OSError if the process that did it has ended.
    """
    from distributed import get_worker  # whoever calls this has it

    worker: Any = get_worker()
    found = worker.extensions.get(token)
    return found.do(job) if found is not None else None


class Camp:
    """The files of a study on a worker of Dask, and the stations for its threads. Close it."""

    def __init__(self, bundle: bytes, order: Line, folder: Path):
        self._folder = Path(tempfile.mkdtemp(prefix="shoal-", dir=folder)).resolve()
        site = read_bundle(bundle).unpack(self._folder)
        parts = {"folder": site.folder, "etc": site.etc, "code": site.code, "modules": site.modules}
        self._order = {**order, **parts, "root": str(site.root)}
        self._all = set[Station]()
        self._idle: list[Station] = []
        self._lock = Lock()
        self._is_open = True

    def do(self, job: bytes) -> Reply:
        """Do a job on a station that has none, or a new one. Raises OSError if it ends."""
        station, is_new = self._take()
        with tempfile.TemporaryDirectory(prefix="logs-", dir=self._folder, ignore_cleanup_errors=True) as logs:
            try:
                reply = station.ask(job, logs)
            except OSError:
                self._drop(station)
                if is_new:
                    raise
                return self.do(job)  # it had ended for want of jobs
            if b"refused" in reply[:12]:
                self._drop(station)
                return reply, []
            with self._lock:
                self._idle.append(station)
            return reply, _contents(Path(logs))

    def close(self) -> None:
        with self._lock:
            self._is_open = False
            stations = list(self._all)
        for station in stations:
            self._drop(station)
        shutil.rmtree(self._folder, ignore_errors=True)

    def _take(self) -> "tuple[Station, bool]":
        with self._lock:
            if not self._is_open:
                raise OSError("the campaign is over")
            if self._idle:
                return self._idle.pop(), False
            station = Station(self._order)
            self._all.add(station)
            return station, True

    def _drop(self, station: "Station") -> None:
        with self._lock:
            self._all.discard(station)
        station.end()


class Station:
    """The process of `station.main`, as it is seen from the worker of Dask."""

    def __init__(self, order: Line):
        path = os.pathsep.join(place or os.getcwd() for place in sys.path)
        self._process = subprocess.Popen(
            [sys.executable, "-P", "-c", STATION],
            stdin=subprocess.PIPE,
            stdout=subprocess.PIPE,
            env={**os.environ, "PYTHONPATH": path},
            start_new_session=True,  # Ctrl-C in the terminal of the worker is for the worker
        )
        self._greeting: bytes | None = None
        self._order = packed(order)

    def ask(self, job: bytes, logs: str) -> bytes:
        """The answer to a job, whose logs are to be in a folder. Raises OSError if the process ends."""
        if self._greeting is None:
            self._send(self._order)
            self._greeting = self._answer()
        if json.loads(self._greeting):
            return self._greeting
        self._send(packed({**json.loads(job), "log_root": logs}))
        return self._answer()

    def end(self) -> None:
        self._process.kill()
        with contextlib.suppress(subprocess.TimeoutExpired):
            self._process.wait(GRACE)

    def _send(self, line: bytes) -> None:
        assert self._process.stdin is not None
        self._process.stdin.write(line)
        self._process.stdin.flush()

    def _answer(self) -> bytes:
        assert self._process.stdout is not None
        line = self._process.stdout.readline()
        if not line.endswith(b"\n"):
            raise OSError(f"the process that does the runs has ended (exit status {self._process.wait()})")
        return line


def _contents(folder: Path) -> list[tuple[str, bytes]]:
    files = sorted(path for path in folder.rglob("*") if path.is_file())
    return [(path.relative_to(folder).as_posix(), path.read_bytes()) for path in files]
