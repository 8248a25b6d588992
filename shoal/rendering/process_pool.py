"""Processes that render pictures beside this one."""

import multiprocessing
import pickle
from collections.abc import Callable, Iterable, Iterator
from dataclasses import dataclass
from multiprocessing.connection import Connection, wait
from typing import Any, Generic, TypeVar

T = TypeVar("T")


@dataclass(frozen=True)
class IndexedWork(Generic[T]):
    """A function of numbers from 0 to `count`, which may be called in any process."""

    function: Callable[[int], T]
    count: int


class RenderPool:
    """Processes that start at once, so that they are ready when there is work; each takes the next job.

    Close it to end them.
    """

    def __init__(self, helpers: int):
        fresh = multiprocessing.get_context("spawn")  # a copy of this one might lack its threads
        self._next = fresh.Value("Q", 0)
        self._running: dict[Connection, Any] = {}
        for _ in range(helpers):
            ours, theirs = fresh.Pipe()
            process = fresh.Process(target=_process_main, args=(theirs, self._next), daemon=True)
            process.start()
            theirs.close()
            self._running[ours] = process

    def run(self, work: IndexedWork[T]) -> Iterator[T]:
        """The results as they come, of this process, too. Raises what the work raises, and OSError."""
        packed = pickle.dumps(work)  # before it fills with what is kept from one picture to the next
        for number in _numbers(self._next, work.count):
            yield work.function(number)
            yield from self._receive(packed, 0.0)
        while self._running:
            yield from self._receive(packed, None)

    def close(self) -> None:
        for process in self._running.values():
            process.terminate()
            process.join()

    def _receive(self, packed: bytes, timeout: float | None) -> Iterator[Any]:
        for pipe in wait(list(self._running), timeout):
            assert isinstance(pipe, Connection)
            try:
                what, said = pipe.recv()
                if what == "ready":
                    pipe.send_bytes(packed)
            except (EOFError, BrokenPipeError):
                text = f"process {self._running[pipe].pid}, which renders, was ended from outside"
                raise OSError(text) from None
            if what == "failed":
                raise said
            if what == "done":
                yield said
            elif what == "over":
                self._running.pop(pipe).join()


def _numbers(following: Any, count: int) -> Iterable[int]:
    """The numbers below `count` that no other process has taken."""
    while True:
        with following.get_lock():
            number = following.value
            following.value = number + 1
        if number >= count:
            return
        yield number


def _process_main(pipe: Connection, following: Any) -> None:
    try:
        pipe.send(("ready", None))
        work: IndexedWork[Any] = pickle.loads(pipe.recv_bytes())
        for number in _numbers(following, work.count):
            pipe.send(("done", work.function(number)))
        pipe.send(("over", None))
    except (EOFError, BrokenPipeError):
        return  # the caller has given up
    except Exception as error:
        pipe.send(("failed", error))
