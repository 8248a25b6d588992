"""The kernel where much or endless work is due: livelock, errors in the middle of it, slow calls, calls put off."""

import socket
import time

import pytest

from runtime.kernel import SECOND, LivelockError


def test_livelock_is_an_error_that_names_the_owner(kernel):
    class Chatterbox:
        def __repr__(self):
            return "Simulators.Chatterbox"

        def talk(self):
            kernel.soon(self.talk)

    kernel.soon(Chatterbox().talk)
    with pytest.raises(LivelockError, match="Chatterbox"):
        kernel.run()


def test_livelock_on_a_wall_clock_is_reported_and_sockets_are_still_served(wall, monkeypatch):
    monkeypatch.setattr("runtime.kernel.kernel.LIVELOCK_PATIENCE", 0)
    reported, read = [], []
    left, right = socket.socketpair()
    wall.watch(right, lambda: read.append(right.recv(10)))
    left.send(b"hello")

    def talk():
        wall.soon(talk)

    def report(owner, error):
        reported.append(error)
        wall.stop()

    wall.on_error = report
    wall.soon(talk)
    wall.run(until=wall.now_ns + 30 * SECOND)
    assert isinstance(reported[0], LivelockError)
    assert read == [b"hello"]
    left.close()
    right.close()


def test_livelock_on_a_wall_clock_blames_who_is_in_it(wall, monkeypatch):
    monkeypatch.setattr("runtime.kernel.kernel.LIVELOCK_PATIENCE", 0)
    wall.livelock_events = 2000
    blamed = []

    class Chatterbox:
        def talk(self):
            wall.soon(self.talk)

    class Bystander:
        def tick(self):
            wall.after(1e-4, self.tick)

    chatterbox, bystanders = Chatterbox(), [Bystander() for _ in range(20)]
    wall.on_error = lambda owner, error: (blamed.append((owner, error.owner)), wall.stop())
    wall.soon(chatterbox.talk)
    for bystander in bystanders:
        wall.soon(bystander.tick)
    wall.run(until=wall.now_ns + 30 * SECOND)
    assert blamed == [(chatterbox, chatterbox)]


@pytest.mark.parametrize("late", [-1, 1])
def test_much_to_do_on_a_wall_clock_is_no_livelock(wall, monkeypatch, late):
    monkeypatch.setattr("runtime.kernel.kernel.LIVELOCK_PATIENCE", 0)
    wall.livelock_events = 2000
    seen = []

    def tick():
        seen.append(wall.now_ns)
        wall.at(wall.now_ns - late, tick)
        wall.soon(follow, 5)
        if len(seen) > 5000:
            wall.stop()

    def follow(more):
        if more:
            wall.soon(follow, more - 1)

    for _ in range(20):
        wall.soon(tick)
    wall.run(until=wall.now_ns + 30 * SECOND)
    assert len(seen) > 5000


def test_a_batch_from_which_an_error_takes_calls_goes_on(wall):
    class Box:
        def fail(self):
            raise ValueError("once")

    box, seen = Box(), []
    wall.on_error = lambda owner, _: wall.cancel_owner(owner)
    for _ in range(3):
        wall.soon(box.fail)
    wall.after(0.01, seen.append, "later")
    wall.run(until=wall.now_ns + SECOND // 20)
    assert seen == ["later"]


def test_a_call_that_computes_for_long_is_reported_with_its_owner_and_one_that_waits_is_not(wall):
    class Slow:
        def work(self):
            begun = time.thread_time()
            while time.thread_time() < begun + 0.05:
                pass

        def wait(self):
            time.sleep(0.05)

    slow, reports = Slow(), []
    wall.on_slow = lambda owner, seconds, handler: reports.append((owner, seconds, handler))
    wall.soon(slow.wait)
    wall.soon(slow.work)
    wall.soon(slow.wait)
    wall.run(until=wall.now_ns + SECOND // 5)
    assert [(owner, handler.rpartition(".")[2]) for owner, _, handler in reports] == [(slow, "work")]
    assert 0.049 <= reports[0][1] <= 0.06


def test_what_is_put_off_is_called_when_there_is_nothing_else_to_do(wall):
    began = time.monotonic()
    wall.after_or_idle(60.0, wall.stop)
    wall.after(70.0, print)
    wall.run()
    assert time.monotonic() - began < 30.0


def test_what_is_put_off_is_called_after_its_time_even_if_there_is_always_something_to_do(wall):
    began, called = wall.now_ns, []

    def work():
        wall.stop() if called else wall.soon(work)

    wall.soon(work)
    wall.after_or_idle(50.0, wall.stop)  # of another vehicle on this kernel
    wall.after_or_idle(0.05, lambda: called.append(wall.now_ns))
    wall.run(until=began + 60 * SECOND)
    assert 0.05 <= (called[0] - began) / SECOND < 30.0
