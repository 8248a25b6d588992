"""Times in which a kernel does not run although it should."""

import math

import pytest

import imc
from runtime import State, Task, consume, expect, periodic
from runtime.kernel import SECOND, Kernel, WallClock
from runtime.testing import simulate
from tests.tasks.mission.stalling_clock import StallingClock

START = 1_750_000_000 * SECOND


def every_tenth(kernel):
    """A call at 10 Hz, so that the kernel is always due."""

    def tick():
        kernel.at(kernel.now_ns + SECOND // 10, tick)

    tick()


@pytest.fixture
def kernel():
    made = Kernel(StallingClock(START, [(2.0, 5.0)]))
    every_tenth(made)
    yield made
    made.close()


def test_a_stall_is_what_comes_later_than_a_tenth_of_a_second(kernel):
    kernel.run(until=START + 10 * SECOND)
    stalls = kernel.stalls
    assert stalls.total == pytest.approx(4.9 * SECOND)
    assert stalls.left_out_since(START) == stalls.total
    assert stalls.left_out_since(-math.inf) == stalls.total
    assert stalls.left_out_since(START + 4 * SECOND) == 3 * SECOND
    assert stalls.left_out_since(START + 7 * SECOND) == 0
    assert stalls.longest_since(START) == stalls.total
    assert stalls.longest_since(START + 7 * SECOND) == 0


def test_punctual_calls_are_no_stall():
    kernel = Kernel(StallingClock(START, [(n / 2, 0.09) for n in range(1, 20)]))
    every_tenth(kernel)
    kernel.run(until=START + 10 * SECOND)
    assert kernel.stalls.total == 0
    kernel.close()


def test_all_calls_of_a_turn_that_is_late_are_one_stall():
    kernel = Kernel(StallingClock(START, overload=(1.0, 100.0), cost=0.001))
    for n in range(5000):
        kernel.at(START + SECOND + n, str)
    kernel.run(until=START + 2 * SECOND)
    assert kernel.stalls.left_out_since(START) == kernel.stalls.total == pytest.approx(4.9 * SECOND, rel=1e-3)
    assert kernel.stalls.longest_since(START) == kernel.stalls.total
    kernel.close()


@pytest.mark.parametrize("clock", [StallingClock(START, overload=(1.0, 100.0), cost=0.2), WallClock()])
def test_what_a_tick_causes_comes_before_the_next_tick_however_slow_the_computer_is(clock):
    kernel, order = Kernel(clock), []

    def tick():
        kernel.at(kernel.now_ns - SECOND // 10, tick)  # overdue at once
        order.append("tick")
        kernel.soon(measure)

    def measure():
        kernel.soon(control)

    def control():
        kernel.soon(move)

    def move():
        order.append("move")
        if len(order) == 20:
            kernel.stop()

    kernel.at(kernel.now_ns + SECOND // 100, tick)
    kernel.run(until=kernel.now_ns + 60 * SECOND)
    assert order == ["tick", "move"] * 10
    kernel.close()


def test_calls_that_never_end_let_ticks_through():
    kernel, ticks = Kernel(StallingClock(START, overload=(0.0, 100.0), cost=0.001)), []

    def talk():
        kernel.soon(talk)

    def tick():
        ticks.append(kernel.now_ns)
        kernel.at(kernel.now_ns + SECOND // 10, tick)

    kernel.soon(talk)
    tick()
    kernel.run(until=START + 4 * SECOND)
    assert len(ticks) > 20
    kernel.close()


def test_on_a_computer_that_is_always_late_only_the_latest_stalls_are_left_out_of_an_age():
    kernel = Kernel(StallingClock(START, overload=(1.0, 10_000.0), delay=0.9))
    every_tenth(kernel)
    kernel.run(until=START + 600 * SECOND)
    late = kernel.stalls.total
    assert late > 450 * SECOND
    assert 2 * SECOND < kernel.stalls.left_out_since(START) < 6 * SECOND
    kernel.close()


@pytest.mark.parametrize(("delay", "counts"), [(0.4, 1.0), (0.9, 0.7), (3.9, 0.7 / 4.0)])
def test_where_one_stall_follows_the_other_a_clock_without_stalls_counts_half_a_second_of_each(delay, counts):
    kernel = Kernel(StallingClock(START, overload=(1.0, 10_000.0), delay=delay))
    every_tenth(kernel)
    kernel.run(until=START + 30 * SECOND)
    began, left_out = kernel.now_ns, kernel.stalls.left_out
    assert left_out > 4 * (delay - 0.1) * SECOND, "the first ones may be all"
    kernel.run(until=START + 130 * SECOND)
    passed = kernel.now_ns - began
    assert passed - (kernel.stalls.left_out - left_out) == pytest.approx(counts * passed, rel=0.05)
    kernel.close()


def test_a_clock_without_stalls_leaves_all_of_a_stall_out_after_a_second_without_any():
    kernel = Kernel(StallingClock(START, [(5.0 + 1.2 * n, 1.0 if n % 5 else 4.0) for n in range(40)]))
    every_tenth(kernel)
    kernel.run(until=START + 200 * SECOND)
    assert kernel.stalls.left_out == kernel.stalls.total
    kernel.close()


def test_a_long_stall_is_left_out_for_as_long_as_it_lasted_whatever_follows():
    kernel = Kernel(StallingClock(START, [(5.0, 60.0)], overload=(66.0, 10_000.0), delay=0.9))
    every_tenth(kernel)
    kernel.run(until=START + 100 * SECOND)
    assert kernel.stalls.left_out_since(START) > 60 * SECOND
    kernel.run(until=START + 130 * SECOND)
    assert kernel.stalls.left_out_since(START) < 6 * SECOND
    kernel.close()


def test_what_waits_for_a_span_of_time_gets_the_rest_of_it_after_a_stall_but_a_second_at_most(kernel):
    begun, found = kernel.now_ns, {}

    def note(name):
        found[name] = (kernel.now_ns - begun) / SECOND

    kernel.after(2.4, note, "runs out soon")
    kernel.after(6.5, note, "runs out late")
    kernel.after(7.5, note, "runs out afterward")
    kernel.at(begun + 3 * SECOND, note, "time of day")
    kernel.run(until=START + 10 * SECOND)
    assert found["runs out soon"] == pytest.approx(7.4, abs=0.15)
    assert found["runs out late"] == pytest.approx(8.0)
    assert found["runs out afterward"] == pytest.approx(8.0)
    assert found["time of day"] == pytest.approx(7.0)


def test_a_wait_that_begins_in_a_turn_that_is_late_is_not_made_longer_by_what_was_before():
    clock = StallingClock(START, overload=(1.0, 3.0), cost=0.25)
    kernel, found = Kernel(clock), []
    for _ in range(6):
        kernel.at(START + SECOND, str)
    kernel.at(START + SECOND, lambda: kernel.after(0.7, lambda: found.append((kernel.now_ns - START) / SECOND)))
    kernel.run(until=START + 6 * SECOND)
    assert found[0] < 4.0
    kernel.close()


class Sounder(Task):
    """Expects a depth at least every second."""

    def start(self) -> None:
        self.ages: list[tuple[float, float]] = []
        self.heard = self.now

    @expect(every=1.0)
    @consume
    def take(self, depth: imc.Depth) -> None:
        self.heard = self.now

    @periodic(5.0)
    def look(self) -> None:
        self.ages.append((self.now - self.vehicle.start_time, self.age(self.heard)))


class Sensor(Task):
    """Measures for 6 s and is silent then."""

    @periodic(2.0)
    def measure(self) -> None:
        if self.now - self.vehicle.start_time < 12.0:
            self.publish(imc.Depth(value=1.0))


def test_the_age_of_data_does_not_count_a_stall_and_expected_data_are_missed_only_when_they_are_silent():
    seen = []

    class Watched(Sounder):
        def stop(self) -> None:
            seen.extend(self.ages)

    run = simulate([Watched, Sensor], seconds=16.0, clock=StallingClock(START, [(3.2, 4.0)]))
    assert max(age for time, age in seen if time < 12.0) < 0.8
    errors = [m.timestamp for m in run.of(imc.EntityState) if m.state == State.ERROR]
    assert errors
    assert min(errors) - START / SECOND > 12.0
