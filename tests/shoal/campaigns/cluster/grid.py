"""A real Dask cluster on the loopback address: a scheduler and workers, each a process of its own."""

import contextlib
import os
import signal
import socket
import subprocess
import sys
from pathlib import Path

from tests.outside import free_port, until

ROOT = Path(__file__).parents[4]
HIDDEN = """
import sys

class Nowhere:
    def find_spec(self, name, path=None, target=None):
        if name.split(".")[0] == "shoal":
            raise ModuleNotFoundError(f"No module named {name!r}", name=name)

sys.meta_path.insert(0, Nowhere())
"""


class Grid:
    """A scheduler, and workers with one thread each; close it."""

    def __init__(self, folder):
        folder.mkdir(parents=True, exist_ok=True)
        self.folder = folder
        self.port = free_port()
        self.address = f"dask://127.0.0.1:{self.port}"
        self.processes = []
        self.scheduler = self._start("scheduler", "--host", "127.0.0.1", "--port", str(self.port))
        until(self._listens, 60.0, told=self._said)

    def worker(self, name, *words, count=1, **environment):
        """Start workers with one thread; returns the process that keeps them."""
        place = f"tcp://127.0.0.1:{self.port}"
        more = ("--nworkers", str(count), "--nthreads", "1", "--local-directory", str(self.folder), *words)
        before = self._said().count("Register worker")
        found = self._start("worker", place, "--name", name, *more, **environment)
        until(lambda: self._said().count("Register worker") >= before + count, 60.0, told=self._said)
        return found

    def bare_worker(self, name):
        """A worker on which Shoal is not installed."""
        (self.folder / "bare").mkdir(exist_ok=True)
        (self.folder / "bare" / "sitecustomize.py").write_text(HIDDEN)
        return self.worker(name, PYTHONPATH=str(self.folder / "bare"))

    def kill(self, process):
        """End a process and all below it at once."""
        for pid in [*descendants(process.pid), process.pid]:
            with contextlib.suppress(ProcessLookupError):
                os.kill(pid, signal.SIGKILL)
        process.wait()

    def close(self):
        for process in reversed(self.processes):
            if process.poll() is None:
                self.kill(process)

    def _start(self, *words, **environment):
        with (self.folder / "said.txt").open("ab") as said:
            process = subprocess.Popen(
                [sys.executable, "-m", "dask", *words, "--no-dashboard"],
                cwd=self.folder,
                env={**os.environ, "PYTHONPATH": str(ROOT), **environment},
                stdout=said,
                stderr=said,
            )
        self.processes.append(process)
        return process

    def _said(self):
        return (self.folder / "said.txt").read_text(errors="replace")

    def _listens(self):
        with contextlib.suppress(OSError), socket.create_connection(("127.0.0.1", self.port), 1.0):
            return True


def descendants(pid):
    """All processes below one, those that its threads have started, too."""
    below = []
    for threads in Path(f"/proc/{pid}/task").glob("*/children"):
        with contextlib.suppress(OSError):
            below += [int(word) for word in threads.read_text().split()]
    return [found for child in below for found in (*descendants(child), child)]


def job_processes(pid):
    """The processes for jobs below a process."""
    return [child for child in descendants(pid) if "cluster.job_process" in _command(child)]


def _command(pid):
    with contextlib.suppress(OSError):
        return Path(f"/proc/{pid}/cmdline").read_text()
    return ""
