"""Processes that a fleet starts: how each ends, starts again, and cannot be started."""

import signal
import subprocess
import sys
import threading
import time
from pathlib import Path
from typing import Any

import pytest

from shoal.fleet import ManagedProcess, Supervisor
from tests.outside import until
from tests.runtime.zenoh.processes import PATIENCE


def script(text: str) -> list[str]:
    return [sys.executable, "-c", text]


@pytest.mark.heavy
def test_a_process_that_fails_starts_again_after_a_growing_pause_with_its_reason_told() -> None:
    child = ManagedProcess("bad", script("import sys; sys.exit('no cable')"))
    supervisor = Supervisor([child])
    told: list[str] = []

    def look() -> bool:
        told.extend(words for _, words in supervisor.poll())
        return len(told) >= 4

    until(look, every=0.01)
    assert told[0] == "started"
    assert told[1].startswith("has ended with status 1")
    assert told[1].endswith("it starts again in 1 s")
    assert told[2] == "started again"
    assert told[3].endswith("it starts again in 2 s")
    assert child.last_error_line == "no cable"
    supervisor.stop()


def test_who_is_killed_from_outside_has_not_said_why() -> None:
    child = ManagedProcess(
        "good", script("import sys, time; print('all well', file=sys.stderr, flush=True); time.sleep(60)")
    )
    supervisor = Supervisor([child], restart=False)
    supervisor.poll()
    until(lambda: child.last_error_line == "all well")
    assert child.popen is not None
    child.popen.kill()
    assert until(supervisor.poll) == [(child, "was killed by signal 9")]


def test_a_process_that_ends_well_or_must_not_start_again_stays_ended() -> None:
    good, bad = ManagedProcess("good", script("")), ManagedProcess("bad", script("raise SystemExit(3)"))
    supervisor = Supervisor([good, bad], restart=False)
    until(lambda: (supervisor.poll(), supervisor.is_over)[1])
    assert (good.failures, bad.failures) == (0, 1)
    assert supervisor.poll() == []


@pytest.mark.heavy
def test_a_process_that_cannot_be_started_is_tried_again_and_has_not_ended_well(tmp_path: Path) -> None:
    program = tmp_path / "program"
    child = ManagedProcess("late", [str(program)])
    supervisor = Supervisor([child])
    ((_, words),) = supervisor.poll()
    assert words.startswith("cannot be started: ")
    assert words.endswith("; it starts again in 1 s")
    assert (child.failures, child.ended_well, supervisor.is_over, supervisor.never_started) == (
        1,
        False,
        False,
        [child],
    )
    program.write_text("#!/bin/sh\n")
    program.chmod(0o755)
    assert until(supervisor.poll) == [(child, "started")]
    assert until(supervisor.poll) == [(child, "has ended")]
    assert (child.failures, child.restarts, child.ended_well, supervisor.is_over, supervisor.never_started) == (
        0,
        0,
        True,
        True,
        [],
    )


def test_what_must_not_start_again_is_over_without_having_ended_well(tmp_path: Path) -> None:
    absent, bad = (
        ManagedProcess("absent", [str(tmp_path / "none")]),
        ManagedProcess("bad", script("raise SystemExit(3)")),
    )
    supervisor = Supervisor([absent, bad], restart=False)
    until(lambda: (supervisor.poll(), supervisor.is_over)[1])
    assert [(child.failures, child.ended_well) for child in supervisor.processes] == [(1, False), (1, False)]
    assert supervisor.never_started == [absent]


@pytest.mark.heavy
def test_a_process_whose_errors_nobody_could_read_is_ended_and_tried_again(monkeypatch: pytest.MonkeyPatch) -> None:
    def refuse(thread: threading.Thread) -> None:
        raise RuntimeError("can't start new thread")

    begun: list[Any] = []
    popen = subprocess.Popen

    def start(*words: Any, **options: Any) -> Any:
        begun.append(popen(*words, **options))
        return begun[-1]

    monkeypatch.setattr(threading.Thread, "start", refuse)
    monkeypatch.setattr(subprocess, "Popen", start)
    child = ManagedProcess("chatty", script("import time; time.sleep(60)"))
    supervisor = Supervisor([child])
    ((_, words),) = supervisor.poll()
    assert "; it starts again in 1 s" in words
    assert begun[0].poll() == -signal.SIGKILL
    monkeypatch.undo()
    assert until(supervisor.poll) == [(child, "started")]
    supervisor.stop()


@pytest.mark.heavy
def test_all_processes_end_together_even_one_that_ignores_it() -> None:
    deaf = "import signal, sys, time; signal.signal(signal.SIGTERM, signal.SIG_IGN); print('deaf', file=sys.stderr);"
    supervisor = Supervisor(
        [
            ManagedProcess("deaf", script(f"{deaf} time.sleep(60)")),
            ManagedProcess("calm", script("import time; time.sleep(60)")),
        ]
    )
    supervisor.poll()
    until(lambda: supervisor.processes[0].last_error_line)
    processes = [child.popen for child in supervisor.processes]
    began = time.monotonic()
    supervisor.stop()
    assert 2.9 < time.monotonic() - began < PATIENCE
    assert all(popen is not None and popen.poll() is not None for popen in processes)
    assert supervisor.poll() == []
