"""What a kernel's watchdog says and does."""

import signal
import subprocess
import sys
import threading
import time

import pytest

from runtime.kernel import SECOND, HandlerError, Kernel, VirtualClock, WallClock, Watchdog, watchdog


@pytest.fixture(autouse=True)
def soon(monkeypatch):
    """Watchdogs with less patience."""
    for name, seconds in (("PERIOD", 0.02), ("NAMED_AFTER", 0.2), ("BROKEN_AFTER", 0.5), ("STANDSTILL", 0.3)):
        monkeypatch.setattr(watchdog, name, seconds)


class Endless:
    """Loops for ever, whatever is raised that is an Exception."""

    def __repr__(self):
        return "the endless one"

    def loop(self):
        while True:
            try:
                self.spin()
            except Exception:
                pass

    def spin(self):
        for number in range(1000):
            number * number


@pytest.mark.heavy
def test_an_endless_loop_is_named_with_its_line_and_broken(caplog):
    kernel, errors, after = Kernel(WallClock()), [], []
    kernel.on_error = lambda owner, error: errors.append((repr(owner), error))
    kernel.soon(Endless().loop)
    kernel.soon(after.append, "went on")
    with Watchdog(kernel):
        kernel.run(kernel.now_ns + 3 * SECOND)
    kernel.close()
    record = caplog.records[0]
    assert "the endless one has not returned from Endless.loop for 0." in record.message
    assert "test_watchdog.py:" in record.message
    assert any(line in record.message for line in ("number", "spin", "while True")), "one of the lines of the loop"
    ((owner, error),) = errors
    assert owner == "the endless one"
    assert isinstance(error, HandlerError)
    assert error.__traceback__ is not None
    assert after == ["went on"]


@pytest.mark.heavy
def test_a_virtual_clock_is_warned_but_never_interrupted(caplog):
    kernel = Kernel(VirtualClock())
    kernel.at(SECOND, time.sleep, 0.8)
    with Watchdog(kernel):
        kernel.run(2 * SECOND)
    kernel.close()
    assert "has not returned from sleep for 0." in caplog.text


@pytest.mark.heavy
def test_many_calls_at_one_moment_are_not_one_that_hangs(caplog):
    kernel = Kernel(VirtualClock())
    for _ in range(20):
        kernel.at(SECOND, time.sleep, 0.05)
    with Watchdog(kernel):
        kernel.run(2 * SECOND)
    kernel.close()
    assert not caplog.records


@pytest.mark.heavy
def test_a_simulator_that_does_not_step_its_clock_is_named(caplog):
    class Hung(VirtualClock):
        def advance(self, target, wait):
            time.sleep(0.8)  # the simulator does not answer
            return super().advance(target, wait)

    kernel = Kernel(Hung())
    kernel.at(SECOND, print)
    with Watchdog(kernel):
        kernel.run(SECOND)
    kernel.close()
    assert "the clock has not moved for" in caplog.text
    assert "the simulator does not answer" in caplog.text


@pytest.mark.heavy
def test_an_idle_kernel_is_left_alone(caplog):
    kernel = Kernel(WallClock())
    with Watchdog(kernel, pytest.fail):
        kernel.run(kernel.now_ns + SECOND)
    kernel.close()
    assert not caplog.records


def test_what_cannot_be_interrupted_is_given_up(monkeypatch):
    monkeypatch.setattr(watchdog, "HOPELESS_AFTER", 0.3)
    kernel, given_up = Kernel(WallClock()), []
    release = threading.Event()
    kernel.on_error = lambda owner, error: None
    kernel.soon(release.wait, 30.0)

    def leave(text):
        given_up.append(text)
        release.set()

    with Watchdog(kernel, leave):
        kernel.run(kernel.now_ns + SECOND // 10)
    kernel.close()
    assert "cannot be interrupted: in " in given_up[0]


@pytest.mark.parametrize("raised", [SystemExit(3), GeneratorExit()])
def test_a_handler_cannot_end_the_program(raised):
    kernel, errors = Kernel(VirtualClock()), []
    kernel.on_error = lambda owner, error: errors.append(error)

    def leave():
        raise raised

    kernel.soon(leave)
    kernel.run(SECOND)
    kernel.close()
    assert isinstance(errors[0], HandlerError)


def test_a_keyboard_interrupt_is_the_users():
    def press():
        raise KeyboardInterrupt

    kernel = Kernel(VirtualClock())
    kernel.soon(press)
    with pytest.raises(KeyboardInterrupt):
        kernel.run(SECOND)
    kernel.close()


HALTED = """
import logging, sys, threading
from runtime.kernel import SECOND, Kernel, WallClock, Watchdog, watchdog
logging.basicConfig(level=logging.WARNING)
watchdog.PERIOD, watchdog.NAMED_AFTER, watchdog.BROKEN_AFTER, watchdog.HOPELESS_AFTER = map(float, sys.argv[1:])
kernel = Kernel(WallClock())
def tick():
    kernel.at(kernel.now_ns + SECOND // 100, tick)
def read():
    sys.stdin.readline()
    kernel.post(kernel.stop)
tick()
kernel.after(1.5, lambda: print("ready", flush=True))
threading.Thread(target=read, daemon=True).start()
with Watchdog(kernel, lambda text: None):
    kernel.run()
"""


def run_halted(hopeless):
    """Halt a process for a second; returns what it writes to stderr."""
    command = [sys.executable, "-c", HALTED, "0.02", "0.5", "0.5", hopeless]
    pipes = {"stdin": subprocess.PIPE, "stdout": subprocess.PIPE, "stderr": subprocess.PIPE, "text": True}
    with subprocess.Popen(command, **pipes) as process:
        assert process.stdout.readline() == "ready\n"  # armed
        process.send_signal(signal.SIGSTOP)
        time.sleep(1.2)
        process.send_signal(signal.SIGCONT)
        return process.communicate("end\n", timeout=60.0)[1]


@pytest.mark.heavy
def test_a_process_that_was_halted_blames_no_handler():
    assert run_halted("30") == ""


@pytest.mark.heavy
def test_after_a_long_halt_the_list_of_threads_is_explained():
    written = run_halted("0.8")
    assert "the process was halted, or a library held the interpreter's lock" in written
    assert "has not returned" not in written


@pytest.mark.skipif(sys.platform != "linux", reason="Linux counts it")
def test_the_time_in_which_a_thread_waits_for_a_processor_is_known():
    end = time.monotonic() + 10.0
    while not watchdog._queued_for_processor(threading.get_native_id()) and time.monotonic() < end:
        time.sleep(0.001)
    assert 0.0 < watchdog._queued_for_processor(threading.get_native_id()) < 3600.0


@pytest.mark.heavy
def test_waiting_for_a_processor_is_not_the_handlers_fault(caplog, monkeypatch):
    began = time.monotonic()
    monkeypatch.setattr(watchdog, "_queued_for_processor", lambda task: time.monotonic() - began)
    kernel = Kernel(WallClock())
    kernel.soon(time.sleep, 0.8)
    with Watchdog(kernel):
        kernel.run(kernel.now_ns + SECOND)
    kernel.close()
    assert not caplog.records
