"""The part within a worker of Dask: the files of a study, and processes that do its jobs."""

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

from shoal.campaigns.cluster.float_fingerprint import compute_float_fingerprint
from shoal.campaigns.cluster.protocol import JsonLine, encode_line
from shoal.campaigns.provenance import software_versions
from shoal.campaigns.studies import parse_bundle

JobReply = tuple[bytes, list[tuple[str, bytes]]]
"""A line, and the files of the logs by their path below the folder for logs."""
JOB_PROCESS_CODE = "from shoal.campaigns.cluster.job_process import main; main()"
GRACE = 5.0  # s


def describe_worker(dask_worker: Any) -> tuple[str, str, str]:
    """Name of the worker, its packages, and its arithmetic."""
    return f"{dask_worker.name} on {platform.node()}", software_versions(), compute_float_fingerprint()


def install_study(token: str, bundle: bytes, order: JsonLine, dask_worker: Any) -> None:
    """Prepare a worker for the jobs of a study. Raises OSError, and BundleError."""
    if token not in dask_worker.extensions:  # which the worker closes with itself
        dask_worker.extensions[token] = WorkerWorkspace(bundle, order, Path(dask_worker.local_directory))


def uninstall_study(token: str, dask_worker: Any) -> None:
    """End what there is for a study on a worker, also jobs that are under way."""
    found = dask_worker.extensions.pop(token, None)
    if found is not None:
        found.close()


def run_job(token: str, job: bytes) -> JobReply | None:
    """Do a job, as a task of Dask; None if the worker has restarted without the study.

    Raises OSError if the process that did it has ended.
    """
    from distributed import get_worker  # every caller has it

    worker: Any = get_worker()
    found: WorkerWorkspace | None = worker.extensions.get(token)
    return found.run_job(job) if found is not None else None


class WorkerWorkspace:
    """The files of a study on a worker of Dask, and the processes for its threads. Close it."""

    def __init__(self, bundle: bytes, order: JsonLine, folder: Path):
        self._folder = Path(tempfile.mkdtemp(prefix="shoal-", dir=folder)).resolve()
        workspace = parse_bundle(bundle).unpack(self._folder)
        parts = {"folder": workspace.folder, "etc": workspace.etc, "code": workspace.code, "modules": workspace.modules}
        self._order = {**order, **parts, "root": str(workspace.root)}
        self._all = set[JobProcess]()
        self._idle: list[JobProcess] = []
        self._lock = Lock()
        self._is_open = True

    def run_job(self, job: bytes) -> JobReply:
        """Do a job on a process that has none, or a new one. Raises OSError if it ends."""
        process, is_new = self._idle_process()
        with tempfile.TemporaryDirectory(prefix="logs-", dir=self._folder, ignore_cleanup_errors=True) as logs:
            try:
                reply = process.run_job(job, logs)
            except OSError:
                self._end_process(process)
                if is_new:
                    raise
                return self.run_job(job)  # the idle process had exited
            if b"refused" in reply[:12]:
                self._end_process(process)
                return reply, []
            with self._lock:
                self._idle.append(process)
            return reply, _contents(Path(logs))

    def close(self) -> None:
        with self._lock:
            self._is_open = False
            processes = list(self._all)
        for process in processes:
            self._end_process(process)
        shutil.rmtree(self._folder, ignore_errors=True)

    def _idle_process(self) -> "tuple[JobProcess, bool]":
        with self._lock:
            if not self._is_open:
                raise OSError("the campaign is over")
            if self._idle:
                return self._idle.pop(), False
            process = JobProcess(self._order)
            self._all.add(process)
            return process, True

    def _end_process(self, process: "JobProcess") -> None:
        with self._lock:
            self._all.discard(process)
        process.kill()


class JobProcess:
    """The process of `job_process.main`, as it is seen from the worker of Dask."""

    def __init__(self, order: JsonLine):
        path = os.pathsep.join(place or os.getcwd() for place in sys.path)
        self._process = subprocess.Popen(
            [sys.executable, "-P", "-c", JOB_PROCESS_CODE],
            stdin=subprocess.PIPE,
            stdout=subprocess.PIPE,
            env={**os.environ, "PYTHONPATH": path},
            start_new_session=True,  # Ctrl-C in the terminal of the worker is for the worker
        )
        self._greeting: bytes | None = None
        self._order = encode_line(order)

    def run_job(self, job: bytes, logs: str) -> bytes:
        """The answer to a job, whose logs are to be in a folder. Raises OSError if the process ends."""
        if self._greeting is None:
            self._send(self._order)
            self._greeting = self._answer()
        if json.loads(self._greeting):
            return self._greeting
        self._send(encode_line({**json.loads(job), "log_root": logs}))
        return self._answer()

    def kill(self) -> None:
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
