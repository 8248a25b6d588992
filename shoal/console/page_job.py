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


class PageJobError(Exception):
    """A job that gives no answer; the text is for the operator."""


class PageJob:
    """Runs a module of Shoal that calls `answer_job`, for one job at a time."""

    def __init__(self, module: str) -> None:
        self._module = module
        self._process: asyncio.subprocess.Process | None = None
        self._is_busy = self._is_cancelled = False

    async def run(self, job: Mapping[str, Any]) -> dict[str, Any]:
        """The answer to a job. Raises PageJobError if another one runs, it is cancelled, or it fails."""
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
        found: dict[str, Any] = json.loads(line)
        return found

    def cancel(self) -> None:
        """End the job that runs."""
        self._is_cancelled = True
        if self._process is not None and self._process.returncode is None:
            self._process.kill()


Work = Callable[[dict[str, Any]], dict[str, Any]]


def answer_job(work: Work, name: str, *refusals: type[Exception]) -> None:
    """Read a job, do it, write its answer. Ends at once when the one who has given it is gone.

    Errors are answers, too: `refusals` by their own text, those of a task of the vehicle as a failure of `name`.
    """
    answers = os.fdopen(os.dup(1), "wb")
    os.dup2(2, 1)  # what the work prints is no answer
    line = sys.stdin.buffer.readline()
    if not line:
        return
    os.nice(LOWER_PRIORITY)
    threading.Thread(target=_end_with_parent, daemon=True).start()
    answers.write(json.dumps(_answer(work, name, refusals, json.loads(line))).encode() + b"\n")
    answers.flush()


def _answer(work: Work, name: str, refusals: tuple[type[Exception], ...], job: dict[str, Any]) -> dict[str, Any]:
    try:
        return work(job)
    except refusals as error:
        return {"ok": False, "text": str(error)}
    except OSError as error:
        return {"ok": False, "text": describe_os_error(error)}
    except Exception as error:  # a task has failed: the operator sees why
        return {"ok": False, "text": f"{name} has failed: {type(error).__name__}: {error}"}


def _end_with_parent() -> None:
    os.read(0, 1)  # returns when nobody can write any more
    os._exit(FAILED)
