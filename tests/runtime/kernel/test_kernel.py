"""The kernel: order, time, threads, and what it watches."""

import functools
import socket
import threading
import time

import pytest
from hypothesis import given
from hypothesis import strategies as st

from runtime.kernel import SECOND, Kernel, ScaledClock, Timer, VirtualClock, WallClock, parse_clock


@given(st.lists(st.integers(0, 5), max_size=40))
def test_events_run_by_time_and_then_in_the_order_they_were_asked_for(times):
    kernel, seen = Kernel(VirtualClock(0)), []
    for number, at in enumerate(times):
        kernel.at(at, lambda n, t: seen.append((kernel.now_ns, t, n)), number, at)
    kernel.run()
    kernel.close()
    assert [(t, n) for _, t, n in seen] == sorted((t, n) for n, t in enumerate(times))
    assert all(now == t for now, t, _ in seen)


def test_an_event_asked_for_in_a_handler_comes_behind_what_is_already_due(kernel):
    seen = []

    def first():
        seen.append("first")
        kernel.soon(seen.append, "nested")

    kernel.at(5, first)
    kernel.at(5, seen.append, "second")
    kernel.run()
    assert seen == ["first", "second", "nested"]


def test_a_run_ends_at_its_time_to_the_nanosecond_and_goes_on_from_there(kernel):
    seen = []
    kernel.at(SECOND, seen.append, "at the end")
    kernel.run(until=SECOND)
    assert (kernel.now_ns, seen) == (SECOND, [])
    kernel.run(until=2 * SECOND)
    assert (kernel.now_ns, seen) == (2 * SECOND, ["at the end"])


def test_a_cancelled_timer_never_fires_even_when_it_was_already_due(kernel):
    seen = []
    timer = kernel.at(5, seen.append, "late")
    kernel.at(4, timer.cancel)
    other = kernel.at(5, seen.append, "same moment")
    kernel.at(5, other.cancel)
    kernel.run()
    assert seen == ["same moment"]


def test_a_time_in_the_past_is_now(kernel):
    seen = []
    kernel.at(10, lambda: kernel.at(3, lambda: seen.append(kernel.now_ns)))
    kernel.run()
    assert seen == [10]


def test_an_error_goes_to_on_error_with_its_owner_and_the_others_run(kernel):
    class Faulty:
        def fail(self):
            raise ValueError("broken")

    faulty, errors, seen = Faulty(), [], []
    kernel.on_error = lambda owner, error: errors.append((owner, str(error)))
    kernel.soon(faulty.fail)
    kernel.at(0, faulty.fail)
    kernel.soon(seen.append, "other")
    kernel.run()
    assert errors == [(faulty, "broken"), (faulty, "broken")]
    assert seen == ["other"]


def test_discard_forgets_the_calls_and_timers_of_one_owner(kernel):
    class Box:
        def __init__(self):
            self.seen = []

        def see(self, what):
            self.seen.append(what)

    gone, kept = Box(), Box()
    for box in (gone, kept):
        kernel.soon(box.see, "due")
        kernel.at(7, box.see, "later")
    kernel.cancel_owner(gone)
    kernel.run()
    assert (gone.seen, kept.seen) == ([], ["due", "later"])


def test_a_source_that_is_let_go_is_not_read_even_where_it_was_ready(wall):
    ours, theirs = socket.socketpair()
    theirs.send(b"hello")
    seen = []
    wall.watch(ours, lambda: seen.append(ours.recv(10)))
    wall._poll(0)
    wall.unwatch(ours)
    wall.unwatch(ours)
    wall.run(until=wall.now_ns + SECOND // 50)
    wall.watch(ours, lambda: seen.append("again"))
    ours.close()
    theirs.close()
    assert seen == []


def test_a_source_is_read_once_however_often_it_is_found_ready(wall):
    ours, theirs = socket.socketpair()
    ours.setblocking(False)
    theirs.send(b"hello")
    seen = []
    wall.watch(ours, lambda: seen.append(ours.recv(10)))
    for _ in range(3):
        wall._poll(0)
    wall.run(until=wall.now_ns + SECOND // 50)
    ours.close()
    theirs.close()
    assert seen == [b"hello"]


def test_discard_lets_go_of_what_the_owner_watches_and_of_what_was_posted_for_it(wall):
    class Reader:
        def __init__(self):
            self.seen = []

        def read(self):
            self.seen.append("read")

    reader, (ours, theirs) = Reader(), socket.socketpair()
    theirs.send(b"hello")
    wall.watch(ours, reader.read)
    wall.post(reader.read)
    wall.post(functools.partial(reader.read))
    wall.cancel_owner(reader)
    wall.run(until=wall.now_ns + SECOND // 50)
    wall.watch(ours, reader.read)
    ours.close()
    theirs.close()
    assert reader.seen == []


def test_cancelled_timers_do_not_pile_up(kernel):
    for _ in range(10_000):
        kernel.after(3600.0, print).cancel()
    assert len(kernel._later) < 2000
    seen = []
    for number in range(3000):
        kernel.after(number, seen.append, number)
    kernel.run()
    assert seen == list(range(3000))


def test_a_timer_that_is_a_year_away_is_waited_for(wall):
    wall.after(365 * 86400.0, print)
    worker = threading.Timer(0.02, wall.post, (wall.stop,))
    worker.start()
    wall.run()
    worker.join()


def test_post_from_a_thread_wakes_a_kernel_that_sleeps(wall):
    seen = []

    def work():
        time.sleep(0.05)
        wall.post(lambda: (seen.append(threading.current_thread()), wall.stop()))

    worker = threading.Thread(target=work)
    worker.start()
    wall.run(until=wall.now_ns + 30 * SECOND)
    worker.join()
    assert seen == [threading.current_thread()]


def test_every_post_arrives_once_and_in_order_per_thread(wall):
    seen, each = [], 500

    def work(name):
        for number in range(each):
            wall.post(lambda n=number: seen.append((name, n)))

    workers = [threading.Thread(target=work, args=(name,)) for name in "abc"]
    for worker in workers:
        worker.start()

    def poll():
        if len(seen) < 3 * each:
            wall.after(0.01, poll)
        else:
            wall.stop()

    wall.after(0.01, poll)
    wall.run(until=wall.now_ns + 30 * SECOND)
    for worker in workers:
        worker.join()
    for name in "abc":
        assert [n for who, n in seen if who == name] == list(range(each))


def test_a_scaled_clock_passes_faster():
    kernel = Kernel(ScaledClock(50.0))
    began = time.monotonic()
    kernel.run(until=kernel.now_ns + 5 * SECOND)
    kernel.close()
    assert 0.09 < time.monotonic() - began < 5.0


@pytest.mark.parametrize(("text", "kind"), [("real", WallClock), ("virtual", VirtualClock), ("10x", ScaledClock)])
def test_clocks_by_name(text, kind):
    assert isinstance(parse_clock(text, 0), kind)


@pytest.mark.parametrize("text", ["", "fast", "0x", "-3x", "x", "nanx", "infx"])
def test_other_clocks_are_refused(text):
    with pytest.raises(ValueError, match="clock"):
        parse_clock(text, 0)


def test_every_instrument_sees_every_call_before_it_is_made(kernel):
    class Recorder:
        def __init__(self, name):
            self.name = name

        def before_call(self, function, args):
            seen.append((self.name, args[0].args if isinstance(args[0], Timer) else args))

    seen = []
    kernel.observers += [Recorder("a"), Recorder("b")]
    kernel.soon(seen.append, "now")
    kernel.at(5, seen.append, "later")
    kernel.run()
    assert seen == [("a", ("now",)), ("b", ("now",)), "now", ("a", ("later",)), ("b", ("later",)), "later"]
