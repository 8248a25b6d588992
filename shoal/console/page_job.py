"""A program that does one job beside the page, and ends with the console, however that ends."""

import asyncio
import json
import os
import sys
import threading
from asyncio.subprocess import PIPE
from collections.abc import Callable, Mapping
from typing import Any

from support.file_errors import describe_os_error

MOST_ANSWER = 16 << 20  # bytes
LOWER_PRIORITY = 10
FAILED = 1
PART = "part"  # the key of a part of an answer


class PageJobError(Exception):
    """A job that gives no answer; the text is for the operator."""


class PageJob:
    """Runs a module of Shoal that calls `answer_job`, for one job at a time."""

    def __init__(self, module: str) -> None:
        self._module = module
        self._process: asyncio.subprocess.Process | None = None
        self._is_busy = self._is_cancelled = False

    @property
    def is_busy(self) -> bool:
        """Whether a job runs."""
        return self._is_busy

    async def run(
        self, job: Mapping[str, Any], on_part: Callable[[dict[str, Any]], object] = lambda _: None
    ) -> dict[str, Any]:
        """The answer to a job; `on_part` gets the parts that come before it.

        Raises PageJobError if another job runs, this one is cancelled, or it fails.
        """
        if self._is_busy:
            raise PageJobError("the one before is not finished: wait, or cancel it")
        self._is_busy, self._is_cancelled = True, False
        try:
            command = sys.executable, "-m", self._module
            process = self._process = await asyncio.create_subprocess_exec(
                *command, stdin=PIPE, stdout=PIPE, limit=MOST_ANSWER
            )
            assert process.stdin is not None
            assert process.stdout is not None
            try:
                if self._is_cancelled:
                    process.kill()
                process.stdin.write(json.dumps(job).encode() + b"\n")  # its end stays open: the worker ends with it
                line = await process.stdout.readline()
                while PART in (found := _read(line)) and not self._is_cancelled:
                    on_part(found[PART])
                    line = await process.stdout.readline()
            finally:
                if process.returncode is None:
                    process.kill()
                status = await process.wait()
            return self._answer(line, status)
        except (OSError, ValueError) as error:
            raise PageJobError(f"no answer of the worker: {error}") from None
        finally:
            self._is_busy, self._process = False, None

    def _answer(self, line: bytes, status: int) -> dict[str, Any]:
        if self._is_cancelled:
            raise PageJobError("cancelled")
        if not line:
            raise PageJobError(f"the worker has ended with status {status}, without an answer")
        return _read(line)

    def cancel(self) -> None:
        """End the job that runs."""
        self._is_cancelled = True
        if self._process is not None and self._process.returncode is None:
            self._process.kill()


def _read(line: bytes) -> dict[str, Any]:
    """Raises ValueError for what is no JSON."""
    found: dict[str, Any] = json.loads(line) if line else {}
    return found


Work = Callable[[dict[str, Any]], dict[str, Any]]
PartialWork = Callable[[dict[str, Any], Callable[[dict[str, Any]], None]], dict[str, Any]]
"""Work that gives parts of its answer to a function while it goes on."""


def answer_job(work: Work, name: str, *refusals: type[Exception]) -> None:
    """Read a job, do it, write its answer. Ends at once when the one who has given it is gone.

    Errors are answers, too: `refusals` by their own text, those of a task of the vehicle as a failure of `name`.
    """
    answer_job_in_parts(lambda job, _: work(job), name, *refusals)


def answer_job_in_parts(work: PartialWork, name: str, *refusals: type[Exception]) -> None:
    """Do the same as `answer_job`, with parts before the answer."""
    answers = os.fdopen(os.dup(1), "wb")
    os.dup2(2, 1)  # what the work prints is no answer
    line = sys.stdin.buffer.readline()
    if not line:
        return
    os.nice(LOWER_PRIORITY)
    threading.Thread(target=_end_with_parent, daemon=True).start()

    def write(answer: dict[str, Any]) -> None:
        answers.write(json.dumps(answer).encode() + b"\n")
        answers.flush()

    job = json.loads(line)
    write(_answer(lambda: work(job, lambda part: write({PART: part})), name, refusals))


def _answer(work: Callable[[], dict[str, Any]], name: str, refusals: tuple[type[Exception], ...]) -> dict[str, Any]:
    try:
        return work()
    except refusals as error:
        return {"ok": False, "text": str(error)}
    except OSError as error:
        return {"ok": False, "text": describe_os_error(error)}
    except Exception as error:  # a task has failed: the operator sees why
        return {"ok": False, "text": f"{name} has failed: {type(error).__name__}: {error}"}


def _end_with_parent() -> None:
    os.read(0, 1)  # returns when nobody can write any more
    os._exit(FAILED)
