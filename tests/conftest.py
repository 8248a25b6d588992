"""What all tests share: signals, hypothesis without a deadline, and fixtures that write logs."""

import contextlib
import gc
import os
import shutil
import signal
import subprocess
from collections.abc import Callable, Generator, Iterable, Iterator
from pathlib import Path
from typing import TYPE_CHECKING

import pytest
from hypothesis import settings

import imc
from imc.lsf import LsfWriter, gzip_schema
from tests.outside import lacking

if TYPE_CHECKING:
    from tests.runtime.zenoh.processes import Network

DEFINITIONS = gzip_schema(imc.builtin())

NEW_NAMESPACE = ["unshare", "-n"] if os.name == "posix" and os.geteuid() == 0 else ["unshare", "-rn"]

settings.register_profile("shoal", deadline=None)
settings.load_profile("shoal")


def pytest_configure() -> None:
    """What processes that tests start inherit: no ignored signals, with which they would never end (under nohup), and
    leave to keep compiled modules, without which each of them would spend half a second on compiling Shoal.
    """
    os.environ.pop("PYTHONDONTWRITEBYTECODE", None)
    signal.signal(signal.SIGINT, signal.default_int_handler)
    if hasattr(signal, "SIGHUP"):
        signal.signal(signal.SIGHUP, signal.SIG_DFL)


@pytest.hookimpl(wrapper=True)
def pytest_collection() -> Generator[None, object, object]:
    """Python looks for garbage neither while thousands of tests are collected nor, later, among them: all of them stay,
    and a tenth of the time would go into it.
    """
    gc.disable()
    try:
        return (yield)
    finally:
        gc.freeze()
        gc.enable()


@pytest.fixture
def openssl() -> str:
    """The path of openssl, which makes certificates."""
    return shutil.which("openssl") or lacking("openssl is not installed")


@pytest.fixture
def systemd_analyze() -> str:
    """The path of systemd's program that judges units."""
    return shutil.which("systemd-analyze") or lacking("systemd is not installed")


@pytest.fixture(scope="session")
def namespace() -> list[str]:
    """The command that runs another one in a network namespace of its own, in which it may create cables."""
    try:
        probe = [*NEW_NAMESPACE, "sh", "-c", "ip link add cable0 type veth peer name cable1 && unshare -n true"]
        done = subprocess.run(probe, capture_output=True, text=True)
        trouble = done.stderr
    except OSError as error:
        done, trouble = None, str(error)
    if done is None or done.returncode:
        lacking(f"no network namespaces on this machine: {trouble.strip()}")
    return NEW_NAMESPACE


@pytest.fixture(scope="session")
def apart() -> list[str]:
    """The command that runs another one where it meets no other program of this computer; empty if that cannot be."""
    command = [*NEW_NAMESPACE, "sh", "-c", 'ip link set lo up && ip route add 224.0.0.0/4 dev lo && exec "$@"', "sh"]
    with contextlib.suppress(OSError):
        if not subprocess.run([*command, "true"], capture_output=True).returncode:
            return command
    return []


@pytest.fixture
def network() -> "Iterator[Network]":
    """A zenoh network of its own; the processes that a test starts in it end with the test."""
    from tests.runtime.zenoh.processes import Network  # imports zenoh

    network = Network()
    yield network
    for process in network.processes:
        process.end()


@pytest.fixture
def make_log(tmp_path: Path) -> Callable[..., Path]:
    """Writes messages or packets to a log folder in the test's temporary folder."""

    def make(
        content: Iterable[imc.Message | bytes],
        name: str = "log",
        schema: bytes | None = DEFINITIONS,
        compression: str = "gzip",
        block: int = 1 << 17,
    ) -> Path:
        folder = tmp_path / name
        folder.mkdir(parents=True)
        if schema is not None:
            (folder / "IMC.xml.gz").write_bytes(schema)
        suffix = {"gzip": ".gz", "bzip2": ".bz2", "zlib": ".z", "none": ""}[compression]
        writer = LsfWriter(folder / f"Data.lsf{suffix}", compression, block)
        for item in content:
            writer.write(item if isinstance(item, bytes) else imc.encode(item))
        writer.close()
        return folder

    return make
