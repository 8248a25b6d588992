"""Tasks in time: ticks, offloaded work, restarts, and times to the nanosecond."""

import threading
import time

import pytest

import imc
from runtime import Task, consume, periodic
from runtime.kernel import WallClock
from runtime.testing import START, simulate
from tests.runtime.task.clockwork import Clockwork


def test_ticks_come_at_start_plus_n_over_rate_without_drift():
    run = simulate(Clockwork, seconds=100.0, rate=3.0)
    assert run.task.ticks == [START * 10**9 + round(n * 1e9 / 3.0) for n in range(300)]


def test_a_rate_of_zero_pauses():
    assert simulate(Clockwork, seconds=5.0, rate=0.0).task.ticks == []


def test_late_ticks_become_one_on_a_wall_clock():
    class Stalling(Clockwork):
        """Stalls once."""

        @periodic(100.0)
        def stall(self) -> None:
            self.calls = getattr(self, "calls", 0) + 1
            if self.calls == 3:
                time.sleep(0.25)

    run = simulate(Stalling, seconds=0.5, rate=100.0, clock=WallClock())
    assert len(run.task.ticks) <= 30
    assert run.task._tickers == []
    assert not run.log  # what developers should do is not for operators


def test_offloaded_work_arrives_after_its_latency_on_a_virtual_clock():
    class Thinker(Task):
        """Thinks."""

        def start(self):
            self.threads = []
            self.offload(self.think, 20, then=self.use, latency=0.5)

        def think(self, number):
            self.threads.append(threading.current_thread())
            return number + 1

        def use(self, result):
            self.publish(imc.Depth(value=result))

    run = simulate(Thinker, seconds=1.0)
    assert [(d.value, d.timestamp) for d in run.of(imc.Depth)] == [(21.0, START + 0.5)]
    run = simulate(Thinker, seconds=0.5, clock=WallClock())
    assert [d.value for d in run.of(imc.Depth)] == [21.0]
    assert run.task.threads[0] is not threading.main_thread()


def fail():
    raise ValueError("no thought")


@pytest.mark.parametrize("clock", [None, WallClock()])
def test_an_error_in_offloaded_work_is_the_tasks_error(clock):
    class Thinker(Task):
        """Fails to think."""

        def start(self):
            self.offload(fail, then=print)

    with pytest.raises(ValueError, match="no thought"):
        simulate(Thinker, seconds=1.0, clock=clock)


def test_a_changed_rate_counts_from_the_moment_of_the_change():
    wish = imc.SetEntityParameters(
        name="Clockwork", params=(imc.EntityParameter(name="Rate", value="2"),), timestamp=1.03
    )

    class Lasting(Clockwork):
        """Keeps its ticks when it is configured."""

        def configure(self):
            self.ticks = getattr(self, "ticks", [])

    run = simulate(Lasting, [wish.replace(name="Lasting")], seconds=3.0, rate=4.0)
    assert [round(t / 1e9 - START, 3) for t in run.task.ticks] == [0.0, 0.25, 0.5, 0.75, 1.0, 1.03, 1.53, 2.03, 2.53]


def test_nothing_from_before_a_restart_reaches_the_task_after_it():
    class Restarting(Task):
        """Fails once, with a timer, a script and offloaded work on their way."""

        def start(self):
            self.starts = getattr(self, "starts", 0) + 1
            self.seen = getattr(self, "seen", [])
            self.after(2.0, self.seen.append, ("timer", self.starts))
            self.offload(int, then=self.offloaded(self.starts), latency=2.0)
            self.start_script(self.wait, self.starts)
            if self.starts == 1:
                self.after(1.5, int, "no number")

        def offloaded(self, starts):
            return lambda _: self.seen.append(("offloaded", starts))

        async def wait(self, script, starts):
            await script.sleep(2.0)
            self.seen.append(("script", starts))

        @periodic(1.0)
        def tick(self) -> None:
            self.seen.append(("tick", self.starts))

    seen = simulate(Restarting, seconds=5.0, keep_going=True).task.seen
    assert seen.count(("tick", 1)) == 2
    assert [what for what, starts in seen if starts == 1 and what != "tick"] == []
    assert sorted(what for what, starts in seen if starts == 2) == [
        "offloaded",
        "script",
        "tick",
        "tick",
        "tick",
        "timer",
    ]


def test_times_that_a_float_can_carry_are_kept_to_the_nanosecond():
    class Punctual(Task):
        """Notes the times of timers and messages."""

        def start(self):
            self.times = []
            for n in range(1, 16):
                self.at(START + n / 8, self.note)

        def note(self) -> None:
            self.times.append(self.now_ns - START * 10**9)

        @consume
        def hear(self, _: imc.Depth) -> None:
            self.note()

    feed = [imc.Depth(timestamp=n / 8) for n in range(1, 16)]
    times = simulate(Punctual, feed, seconds=2.0).task.times
    assert times == [n * 10**9 // 8 for n in range(1, 16) for _ in range(2)]
