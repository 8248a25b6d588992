"""The protocol of systemd with a real socket: ready, alive, hung, stopping; and clocks that are not set."""

import os
import signal
import socket
import subprocess
import sys
import time
from collections.abc import Iterator
from itertools import pairwise
from pathlib import Path
from typing import Any

import pytest

import imc
from runtime.kernel import ScaledClock, WallClock
from runtime.testing import NoProfile
from runtime.vehicle import Vehicle
from shoal.cli.systemd_notify import SystemdNotifier

PROFILE = """[General]
Vehicle = probe

[pausing.Pausing]
Enabled = Always
"""
PAUSING = '''"""Pausing: does not return for a while."""

import time

from runtime import State, Task, periodic


class Pausing(Task):
    """Hangs once, after a second."""

    def start(self) -> None:
        self.calls = 0
        self.set_entity_state(State.ERROR, "soon")

    @periodic(1.0)
    def pause(self) -> None:
        self.calls += 1
        if self.calls == 2:
            time.sleep(1.5)
'''


class Manager:
    """Listens as systemd does."""

    def __init__(self, address: str):
        self.socket = socket.socket(socket.AF_UNIX, socket.SOCK_DGRAM)
        self.socket.bind(address)
        self.socket.settimeout(30.0)

    def next(self) -> list[str]:
        return self.socket.recv(4096).decode().split("\n")

    def all(self) -> list[list[str]]:
        self.socket.settimeout(0.2)
        found: list[list[str]] = []
        try:
            while True:
                found.append(self.next())
        except TimeoutError:
            return found


@pytest.fixture
def manager(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Iterator[Manager]:
    made = Manager(str(tmp_path / "notify"))
    monkeypatch.setenv("NOTIFY_SOCKET", str(tmp_path / "notify"))
    yield made
    made.socket.close()


def started(folder: Path, **environment: str) -> subprocess.Popen[str]:
    (folder / "probe.ini").write_text(PROFILE)
    (folder / "pausing.py").write_text(PAUSING)
    return subprocess.Popen(
        [sys.executable, "-m", "shoal.cli", "run", "probe.ini"],
        cwd=folder,
        env={**os.environ, "PYTHONPATH": str(Path(__file__).parents[3]), **environment},
        stdout=subprocess.PIPE,
        stderr=subprocess.STDOUT,
        text=True,
    )


@pytest.mark.heavy
def test_a_run_says_that_it_is_ready_alive_and_stopping_and_nothing_while_it_hangs(
    tmp_path: Path, manager: Manager
) -> None:
    run = started(tmp_path, WATCHDOG_USEC="600000")
    try:
        assert manager.next() == ["READY=1", f"MAINPID={run.pid}"]
        alive: list[float] = []
        began = time.monotonic()
        while time.monotonic() < began + 3.5:
            lines = manager.next()
            assert lines[0] == "WATCHDOG=1"
            assert lines[1] == "STATUS=probe: Pausing: soon"
            alive.append(time.monotonic())
    finally:
        run.send_signal(signal.SIGTERM)
        output = run.communicate(timeout=30)[0]
    gaps = sorted(b - a for a, b in pairwise(alive))
    assert gaps[-1] > 1.2, "it hung for 1.5 s"
    assert gaps[len(gaps) // 2] < 0.6, "a third of the limit is 0.2 s"
    assert ["STOPPING=1"] in manager.all(), output
    assert run.returncode == 0, output


@pytest.mark.heavy
def test_a_run_that_systemd_ends_says_where_it_hung(tmp_path: Path, manager: Manager) -> None:
    run = started(tmp_path, WATCHDOG_USEC="30000000")
    while not any("WATCHDOG=1" in line for line in manager.next()):
        pass
    time.sleep(1.3)
    run.send_signal(signal.SIGABRT)
    output = run.communicate(timeout=30)[0]
    assert run.returncode == -signal.SIGABRT
    assert 'pausing.py", line 19 in pause' in output


def host(manager: Manager | None, **environment: Any) -> tuple[Vehicle, SystemdNotifier]:
    vehicle = Vehicle("probe", 1, clock=WallClock(), profile=NoProfile())
    return vehicle, SystemdNotifier(vehicle)


def told(vehicle: Vehicle, host: SystemdNotifier, seconds: float = 0.5) -> list[str]:
    """What the log book says in a run."""
    texts: list[str] = []
    vehicle.observe(imc.LogBookEntry, lambda entry: texts.append(entry.text))
    vehicle.start()
    vehicle.kernel.soon(host.notify_ready)
    vehicle.run(seconds)
    host.notify_stopping()
    vehicle.close()
    return texts


def test_without_a_watchdog_only_the_status_is_reported(manager: Manager) -> None:
    assert told(*host(manager)) == []
    assert manager.all() == [["READY=1", f"MAINPID={os.getpid()}"], ["STATUS=probe: all is well"], ["STOPPING=1"]]
    assert "NOTIFY_SOCKET" not in os.environ, "programs that a task starts must not speak for the run"


def test_a_watchdog_of_another_process_is_not_ours(manager: Manager, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("WATCHDOG_USEC", "300000")
    monkeypatch.setenv("WATCHDOG_PID", "1")
    told(*host(manager))
    assert not [lines for lines in manager.all() if "WATCHDOG=1" in lines]


@pytest.mark.heavy
def test_a_socket_without_a_file_and_one_that_nobody_reads(monkeypatch: pytest.MonkeyPatch) -> None:
    name = f"shoal-test-{os.getpid()}"
    listening = Manager(f"\0{name}")
    monkeypatch.setenv("NOTIFY_SOCKET", f"@{name}")
    told(*host(listening))
    assert listening.all()[0][0] == "READY=1"
    listening.socket.close()
    monkeypatch.setenv("NOTIFY_SOCKET", f"@{name}")
    told(*host(None))  # nobody listens: no error
    monkeypatch.setenv("NOTIFY_SOCKET", "x" * 300)
    told(*host(None))


@pytest.mark.heavy
def test_the_period_is_one_of_real_time(manager: Manager, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("WATCHDOG_USEC", "300000")
    vehicle = Vehicle("probe", 1, clock=ScaledClock(20.0), profile=NoProfile())
    told(vehicle, SystemdNotifier(vehicle), seconds=20.0)
    assert 5 <= len([lines for lines in manager.all() if "WATCHDOG=1" in lines]) <= 15


def test_a_clock_behind_the_last_log_is_named(tmp_path: Path) -> None:
    day = tmp_path / "log" / "probe" / "20990101"
    day.mkdir(parents=True)
    os.utime(day, (4070908800.0, 4070908800.0))
    vehicle = Vehicle("probe", 1, clock=WallClock(), profile=NoProfile(), log_root=tmp_path / "log")
    (text,) = told(vehicle, SystemdNotifier(vehicle))
    assert text.startswith("the computer's clock is not set: it shows 20")
    assert "but the last log: 2099-01-01 00:00" in text
