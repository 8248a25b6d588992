"""A shipped vehicle with a task that hangs: it is named, and signals end the run within a second."""

import re
import signal
import subprocess
import time

import pytest

import imc
from tests.shoal.cli.installed import SHOAL

HANGING = '''"""Hanging: does what no task may."""

import sys
import time

from runtime import Task, param, periodic


class Hanging(Task):
    """Hangs after two seconds."""

    how: str = param("", "", "How.")

    @periodic(0.5)
    def hang(self) -> None:
        self.calls = getattr(self, "calls", 0) + 1
        if self.calls == 2:
            print("hanging now", flush=True)
            getattr(self, self.how)()

    def loop(self) -> None:
        while True:
            try:
                time.time()
            except Exception:
                pass

    def library(self) -> None:
        time.sleep(1000.0)

    def offloaded(self) -> None:
        self.offload(time.sleep, 1000.0, then=print)

    def leave(self) -> None:
        sys.exit(0)

    def leave_offloaded(self) -> None:
        self.offload(sys.exit, 0, then=print)

    def nothing(self) -> None:
        pass
'''
COMMAND = [*SHOAL, "run", "lauv-noptilus-1", "-p", "Kinematic", "--log-dir", "log"]
COMMAND += ["--set", "Transports.MAVLink:Enabled=Never", "--set", "hanging.Hanging:Enabled=Always"]


def begin(folder, how, *more):
    (folder / "hanging.py").write_text(HANGING)
    pipe = subprocess.PIPE
    command = [*COMMAND, "--set", f"hanging.Hanging:How={how}", *more]
    return subprocess.Popen(command, cwd=folder, stdout=pipe, stderr=subprocess.STDOUT, text=True)


def until(process, word):
    """What the process writes until a line with `word`."""
    lines = []
    for line in process.stdout:
        lines.append(line)
        if word in line:
            return "".join(lines)
    raise AssertionError("".join(lines))


@pytest.mark.heavy
@pytest.mark.parametrize(
    ("how", "number"),
    [
        ("loop", signal.SIGINT),
        ("library", signal.SIGTERM),
        ("offloaded", signal.SIGINT),
        ("nothing", signal.SIGHUP),
    ],
)
def test_a_signal_ends_it_in_a_second_whatever_hangs_and_the_log_can_be_read(tmp_path, how, number):
    process = begin(tmp_path, how, "--set", "Transports.Logging:Flush Interval=0.2")
    until(process, "hanging now")
    time.sleep(0.5)
    asked = time.monotonic()
    process.send_signal(number)
    rest = process.communicate(timeout=20)[0]
    took = time.monotonic() - asked
    assert took < 1.5, rest  # 0.8 s and the end of the interpreter on a busy machine
    if how in ("loop", "library"):
        assert re.search(r"hanging\.py.*(line |:)\d+", rest)
        assert process.returncode == 1
    else:
        assert process.returncode == 0, rest
    if how == "offloaded":
        assert "sleep of hanging.Hanging is still running; it is abandoned" in rest
    (log,) = (tmp_path / "log").glob("*/*/*")
    assert imc.Log(log).counts()["SimulatedState"] > 100


@pytest.mark.heavy
def test_signals_of_the_same_moment_do_not_kill_a_run_that_has_stopped(tmp_path):
    process = begin(tmp_path, "nothing")
    until(process, "hanging now")
    end = time.monotonic() + 0.9
    while process.poll() is None and time.monotonic() < end:
        process.send_signal(signal.SIGTERM)
        time.sleep(0.001)
    rest = process.communicate(timeout=20)[0]
    assert process.returncode == 0, rest


@pytest.mark.heavy
@pytest.mark.parametrize("gap", [0.001, 0.1])
def test_signals_of_the_same_moment_are_one_stop(tmp_path, gap):
    """`timeout` signals its child, and then its group."""
    process = begin(tmp_path, "nothing")
    until(process, "hanging now")
    for _ in range(3):
        process.send_signal(signal.SIGTERM)
        time.sleep(gap)
    rest = process.communicate(timeout=20)[0]
    assert process.returncode == 0, rest
    assert "second signal" not in rest
    (log,) = (tmp_path / "log").glob("*/*/*")
    assert imc.Log(log).counts()["SimulatedState"] > 100


@pytest.mark.heavy
def test_an_endless_loop_is_named_and_its_task_restarts_on_a_vehicle(tmp_path):
    process = begin(tmp_path, "loop", "--keep-going", "--for", "8s")
    text = process.communicate(timeout=60)[0]
    assert process.returncode == 0, text
    assert re.search(r"hanging\.Hanging has not returned from Hanging\.hang for 2\.\d s: .*hanging\.py:\d+ \(", text)
    assert "the handler did not return: stopped after 5." in text
    assert "restarting in 1 s" in text
    assert "0x" not in text


@pytest.mark.heavy
@pytest.mark.parametrize("how", ["leave", "leave_offloaded"])
def test_sys_exit_in_a_handler_is_its_tasks_error(tmp_path, how):
    process = begin(tmp_path, how, "--clock", "virtual", "--for", "20s")
    text = process.communicate(timeout=60)[0]
    assert process.returncode == 1
    assert "the handler tried to end the program: sys.exit(0)" in text
    assert "in hanging.Hanging at 2.000 s of the run" in text


@pytest.mark.heavy
@pytest.mark.parametrize(("how", "number"), [("loop", signal.SIGINT), ("nothing", signal.SIGTERM)])
def test_a_signal_ends_a_mission_with_a_report(tmp_path, how, number):
    (tmp_path / "hanging.py").write_text(HANGING)
    (tmp_path / "long.yaml").write_text("plan: long\nmaneuvers:\n  - idle: {duration: 10h}\n")
    command = [*SHOAL, "mission", "lauv-noptilus-1", "long.yaml"]
    command += ["--set", "hanging.Hanging:Enabled=Always", "--set", f"hanging.Hanging:How={how}"]
    pipe = subprocess.PIPE
    process = subprocess.Popen(command, cwd=tmp_path, stdout=pipe, stderr=subprocess.STDOUT, text=True)
    until(process, "hanging now")
    before = until(process, "has not returned") if how == "loop" else ""
    time.sleep(0.5)
    asked = time.monotonic()
    process.send_signal(number)
    rest = before + process.communicate(timeout=20)[0]
    assert time.monotonic() - asked < 1.5, rest
    assert process.returncode == 1
    if how == "loop":
        assert re.search(
            r"hanging\.Hanging has not returned from Hanging\.hang for 2\.\d s: .*hanging\.py:\d+ \(", rest
        )
    else:
        assert "long: FAILURE, stopped by a signal" in rest
