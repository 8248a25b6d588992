"""What tests need of the world outside them: to wait for it, ports that nobody uses, processes, how busy it is."""

import contextlib
import errno
import itertools
import os
import random
import resource
import socket
import sys
import tempfile
import time
from collections.abc import Callable, Generator, Iterable, Iterator
from pathlib import Path
from typing import NoReturn, TypeVar
from unittest.mock import patch

import pytest

PATIENCE = 60.0  # s; what comes at all comes sooner, also on a busy machine; only what fails waits so long

ALONE = tuple(
    f"Transports.{name}:Enabled=Never"
    for name in ("Announce", "Console", "Discovery", "FTP", "MAVLink", "TCP.Server", "UDP")
)
"""Settings of a vehicle in real time that must hear nobody on this computer, where other tests run."""
ALONE_WORDS = tuple(word for setting in ALONE for word in ("--set", setting))

# What this system says: the words are its own.
NO_FILE, NO_FOLDER = os.strerror(errno.ENOENT), os.strerror(errno.ENOTDIR)
NO_SPACE, TOO_LARGE = os.strerror(errno.ENOSPC), os.strerror(errno.EFBIG)
REFUSED, IN_USE = os.strerror(errno.ECONNREFUSED), os.strerror(errno.EADDRINUSE)
TIMED_OUT, FILE_EXISTS = os.strerror(errno.ETIMEDOUT), os.strerror(errno.EEXIST)

WORKER, WORKERS = (
    os.environ.get(f"PYTEST_XDIST_WORKER{name}", number) for name, number in (("", "0"), ("_COUNT", "1"))
)


def in_turn(ports: Iterable[int]) -> Iterator[int]:
    """The ports of this worker in random order, so that two are never the same, also not in two workers of a run.

    They must be outside the range from which systems choose by themselves, for the client of another test at any time.
    """
    ours = list(ports)[int(WORKER.removeprefix("gw")) :: int(WORKERS)]
    return itertools.cycle(random.SystemRandom().sample(ours, len(ours)))


PORTS = in_turn(range(8_100, 11_000))

T = TypeVar("T")


def until(
    condition: Callable[[], T], patience: float = PATIENCE, *, every: float = 0.02, told: Callable[[], object] = str
) -> T:
    """Wait until a condition holds; returns what made it true. If it does not come, `told` gives what to show."""
    end = time.monotonic() + patience
    while not (found := condition()):
        assert time.monotonic() < end, f"waited {patience} s; {told()}"
        time.sleep(every)
    return found


def free_ports(count: int, address: str = "127.0.0.1") -> list[int]:
    """Ports that nobody uses now, neither with UDP nor with TCP; others each time."""
    family = socket.AF_INET6 if ":" in address else socket.AF_INET
    found: list[int] = []
    while len(found) < count:
        port = next(PORTS)
        try:
            with socket.socket(family, socket.SOCK_DGRAM) as udp, socket.socket(family) as tcp:
                udp.bind((address, port))
                tcp.bind((address, port))
        except OSError:
            continue
        found.append(port)
    return found


def free_port(address: str = "127.0.0.1") -> int:
    (port,) = free_ports(1, address)
    return port


def children(process: int) -> list[int]:
    """The processes that a process has started; none if it has ended."""
    with contextlib.suppress(OSError):
        return [int(word) for word in Path(f"/proc/{process}/task/{process}/children").read_text().split()]
    return []


@contextlib.contextmanager
def largest_file(size: int | None = None) -> Generator[Callable[[int | None], None]]:
    """Limit files of this process and of those that it starts to `size` bytes, until the end or another limit is set.

    The limit counts for all that a process writes, so that what others share (compiled modules, caches of the user)
    is not written meanwhile, or elsewhere: Python would keep the part of a `.pyc` that fits.
    """
    soft, hard = resource.getrlimit(resource.RLIMIT_FSIZE)

    def limit(size: int | None) -> None:
        resource.setrlimit(resource.RLIMIT_FSIZE, (soft if size is None else size, hard))

    with tempfile.TemporaryDirectory() as caches:
        own = {"PYTHONDONTWRITEBYTECODE": "1"} | dict.fromkeys(("XDG_CACHE_HOME", "MPLCONFIGDIR"), caches)
        with patch.dict(os.environ, own), patch.object(sys, "dont_write_bytecode", True):
            try:
                limit(size)
                yield limit
            finally:
                limit(None)


def slowness() -> float:
    """How much slower than alone a process may be here; other work on the computer is not its fault."""
    return max(1.0, 2.0 * os.getloadavg()[0] / (os.cpu_count() or 1))


def lacking(words: str) -> NoReturn:
    """Skip a test, since this machine lacks something; CI has all, so there it fails."""
    if os.environ.get("CI"):
        pytest.fail(words)
    pytest.skip(words)
