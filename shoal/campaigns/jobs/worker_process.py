"""A process beside this one that does jobs, and how it is seen from here."""

import contextlib
import faulthandler
import gc
import os
import re
import shutil
import signal
import tempfile
import threading
import time
import traceback
from collections.abc import Callable, Generator, Sequence
from multiprocessing import get_context, parent_process
from multiprocessing.connection import Connection, wait
from pathlib import Path

from shoal.campaigns.jobs.job import Job, RunJob
from shoal.scenarios import ScenarioResult

GRACE = 1.0  # s from the limit, at which the process notes where it hangs, to its end
FOLDER_PREFIX = "worker-"  # of the folders of processes
HANG_FILE = "hung.txt"  # in the folder of the process
READY, BEGUN = "ready", "begun"  # first line of a process, before results
GARBAGE = 20_000  # new objects after which Python looks for garbage; by default 700, which takes a tenth of a run
KERNEL = os.path.join("runtime", "kernel", "")
_FRAME = re.compile(r'^  File "(.*)", line (\d+) in (\w+|<\w+>)$')


class WorkerProcess:
    """A process that does one job after another. `deaths` and `job` are the caller's to read, `assign` sets them.

    It is spawned, since a copy of this process might lack its threads. Ctrl-C does not reach it, and it ends when this
    process does, however that ends. What its runs leave in the folder of temporary files is removed with it.
    """

    def __init__(self, make_runner: Callable[[], RunJob], code: Sequence[Path], folder: Path, wall_limit: float):
        self.job: Job | None = None
        self.deaths: int = 0
        self.is_ready: bool = False
        self.has_begun: bool = False
        self._wall_limit, self._deadline = wall_limit, float("inf")
        self._folder = Path(tempfile.mkdtemp(prefix=FOLDER_PREFIX, dir=folder))
        fresh = get_context("spawn")
        self.pipe: Connection
        self.pipe, theirs = fresh.Pipe()
        self._process = fresh.Process(
            target=_process_main, args=(theirs, make_runner, tuple(code), self._folder, wall_limit), daemon=True
        )
        with _without_interrupts():
            self._process.start()
        theirs.close()

    @property
    def seconds_left(self) -> float:
        """Time (s) until the process has to be ended."""
        return max(0.0, self._deadline - time.monotonic())

    def assign(self, job: Job, deaths: int) -> None:
        """A job for it; it begins once the process is ready. `deaths` is how many processes the job has ended."""
        self.job, self.deaths, self.has_begun = job, deaths, False
        if self.is_ready:
            self._send()

    def receive(self) -> ScenarioResult | None:
        """The result of its job, or None if it reports to be ready or to begin. Raises EOFError if it has ended."""
        try:
            said = self.pipe.recv()
        except OSError:
            raise EOFError from None
        if said == BEGUN:
            self.has_begun = True
            return None
        self._deadline = float("inf")
        if isinstance(said, ScenarioResult):
            self.job = None
            return said
        self.is_ready = True
        if self.job is not None:
            self._send()
        return None

    def hang_location(self) -> str:
        """Place in the code where it hangs, as far as is known."""
        try:
            return _innermost_line((self._folder / HANG_FILE).read_text(errors="replace"))
        except OSError:
            return ""

    def kill(self) -> str:
        """End the process, if it has not ended, and return how it ended."""
        self._process.kill()
        self._process.join()
        code = self._process.exitcode or 0
        self._process.close()
        self.pipe.close()
        shutil.rmtree(self._folder, ignore_errors=True)
        with contextlib.suppress(ValueError):
            return signal.Signals(-code).name if code < 0 else f"exit status {code}"
        return f"signal {-code}"

    def _send(self) -> None:
        self._deadline = time.monotonic() + self._wall_limit + GRACE
        with contextlib.suppress(OSError):  # it has ended: `receive` will report that
            self.pipe.send(self.job)


@contextlib.contextmanager
def _without_interrupts() -> Generator[None]:
    """Processes that start meanwhile do not receive Ctrl-C of the terminal, nor while it imports."""
    if not hasattr(signal, "pthread_sigmask"):
        yield
        return
    from multiprocessing import resource_tracker  # there is none where there are no signals

    resource_tracker.ensure_running()  # its own start would unblock the signal
    before = signal.pthread_sigmask(signal.SIG_BLOCK, {signal.SIGINT})
    try:
        yield
    finally:
        signal.pthread_sigmask(signal.SIG_SETMASK, before)


def _process_main(
    pipe: Connection, make_runner: Callable[[], RunJob], code: Sequence[Path], folder: Path, wall_limit: float
) -> None:
    """Serve jobs until the parent process is gone."""
    signal.signal(signal.SIGINT, signal.SIG_IGN)
    tempfile.tempdir = str(folder)
    threading.Thread(target=_end_with_parent, args=(folder,), daemon=True).start()
    if code:
        from runtime.vehicle import add_task_folder

        for place in code:
            add_task_folder(place)
    do = make_runner()
    gc.set_threshold(GARBAGE)
    with contextlib.suppress(EOFError, OSError), (folder / HANG_FILE).open("w") as hung:
        pipe.send(READY)
        is_warm = False
        while True:
            job = pipe.recv()
            pipe.send(BEGUN)
            faulthandler.dump_traceback_later(wall_limit, file=hung)
            result = run_job_catching_errors(do, job)
            faulthandler.cancel_dump_traceback_later()
            pipe.send(result)
            del job, result
            gc.collect()  # vehicles are cycles: else those of many runs would wait for the next time
            if not is_warm:
                is_warm = True
                gc.freeze()  # what a first run has imported stays, and is not looked at again
    _remove_folder(folder)


def run_job_catching_errors(run_job: RunJob, job: Job) -> ScenarioResult:
    """Do a job; an error is its result: a line with the error, then its place."""
    try:
        return run_job(job)
    except (Exception, SystemExit) as error:
        where = "".join(traceback.format_exception(error)).rstrip()
        return job.failed_result(f"{type(error).__name__}: {error}\n{where}")


def _end_with_parent(folder: Path) -> None:
    parent = parent_process()
    if parent is not None:
        wait([parent.sentinel])
        _remove_folder(folder)
        os._exit(1)


def _remove_folder(folder: Path) -> None:
    """Remove what the parent cannot, since it has ended."""
    shutil.rmtree(folder, ignore_errors=True)
    if not any(folder.parent.glob(f"{FOLDER_PREFIX}*")):  # this is the last process
        shutil.rmtree(folder.parent, ignore_errors=True)


def _innermost_line(stacks: str) -> str:
    """The innermost line of the last stack in a dump of all threads, and the line of the handler that led there."""
    *_, main = stacks.split("most recent call first):\n")
    frames = [found.groups() for line in main.splitlines() if (found := _FRAME.match(line))]
    called = next((number for number, frame in enumerate(frames) if KERNEL in frame[0]), 0)
    own = [frame for frame in frames[:called] if f"{os.sep}runtime{os.sep}" not in frame[0]]
    lines = [f"{path}:{number} ({name})" for path, number, name in dict.fromkeys([*frames[:1], *own[-1:]])]
    return ", called from ".join(lines)
