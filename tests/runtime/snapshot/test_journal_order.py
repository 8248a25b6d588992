"""Snapshots of a task with scripts that gets messages at exactly the times of its ticks."""

from random import Random

import pytest

import imc
from runtime import Script, Task, consume, periodic
from runtime.kernel import SECOND
from runtime.snapshot import InputJournals, load, restore, take_snapshot
from runtime.snapshot.input_journal import MANY
from tests.runtime.snapshot.test_input_journal import vehicle_of


class Replier(Task):
    """Has a script for each message, a timer that follows it at once, and a tick that cancels the timer."""

    def start(self) -> None:
        self.steps, self.timer = 0, self.after(1.0, self.respond)

    @periodic(10.0)
    def tick(self) -> None:
        self.steps += 1
        self.timer.cancel()

    @consume
    def begin(self, _: imc.Temperature) -> None:
        self.timer.cancel()
        self.timer = self.after(0.0, self.respond)
        self.start_script(self.work)

    def respond(self) -> None:
        self.steps += 100
        self.after(0.0, self.finish)

    def finish(self) -> None:
        self.steps *= 3

    async def work(self, script: Script) -> None:
        await script.sleep(0.1)
        self.steps += 1000
        await script.sleep(0.15)


class Ticker(Task):
    """Publishes at the same times as others tick."""

    @periodic(10.0)
    def tick(self) -> None:
        if self.random.random() < 0.3:
            self.publish(imc.Temperature(value=1.0))


@pytest.mark.parametrize("order", [(Ticker, Replier), (Replier, Ticker)])
@pytest.mark.parametrize("seed", range(5))
def test_a_message_at_the_time_of_a_tick_is_replayed_before_or_after_it_as_it_was(
    order: tuple[type[Task], ...], seed: int
) -> None:
    """Also one that came between two runs, which is before all timers of its time."""
    pick = Random(seed)
    vehicle = vehicle_of(*order, seed=seed)
    InputJournals(vehicle)
    vehicle.start()
    saved: list[tuple[bytes, int]] = []
    (replier,) = (task for task in vehicle.tasks if isinstance(task, Replier))
    for _ in range(20):
        at = pick.choice(sorted({timer.time for timer in vehicle.kernel.timers() if timer.function}))
        vehicle.kernel.run(until=at)
        if pick.random() < 0.7:
            for _ in range(pick.choice((1, 1, 2))):
                vehicle.daemon.publish(imc.Temperature(value=0.0))
        vehicle.kernel.run(until=at + pick.choice((1, SECOND // 50)))
        saved.append((take_snapshot(vehicle), replier.steps))
    vehicle.close()
    for snapshot, steps in saved:
        other = vehicle_of(*order, seed=seed, time=load(snapshot).time)
        restore(other, load(snapshot))
        assert [task.steps for task in other.tasks if isinstance(task, Replier)] == [steps]
        other.close()


@pytest.mark.parametrize("seed", range(5))
def test_a_restored_run_can_be_saved_again_after_a_message_at_the_time_of_a_tick(seed: int) -> None:
    """The first snapshot is taken between that message and the ticks of its time."""
    vehicle = vehicle_of(Ticker, Replier, seed=seed)
    InputJournals(vehicle)
    vehicle.start()
    for _ in range(5):
        at = min(timer.time for timer in vehicle.kernel.timers() if timer.function)
        vehicle.kernel.run(until=at)
        vehicle.daemon.publish(imc.Temperature(value=0.0))
        vehicle.kernel.run(until=at)
    snapshot = load(take_snapshot(vehicle))
    vehicle.close()
    restored = vehicle_of(Ticker, Replier, seed=seed, time=snapshot.time)
    InputJournals(restored)
    restore(restored, snapshot)
    restored.kernel.run(until=restored.kernel.now_ns + SECOND // 50)
    again = load(take_snapshot(restored))
    steps = [task.steps for task in restored.tasks if isinstance(task, Replier)]
    restored.close()
    other = vehicle_of(Ticker, Replier, seed=seed, time=again.time)
    restore(other, again)
    assert [task.steps for task in other.tasks if isinstance(task, Replier)] == steps
    other.close()


class Counter(Task):
    """Counts ticks and messages, and has a script that lasts."""

    def start(self) -> None:
        self.count = 0
        self.start_script(self.work)

    @periodic(10.0)
    def tick(self) -> None:
        self.count += 1

    @consume
    def add(self, _: imc.Temperature) -> None:
        self.count *= 2
        self.count %= 1001

    async def work(self, script: Script) -> None:
        await script.sleep(1e6)


def test_a_journal_stays_short_where_each_message_comes_at_the_time_of_a_tick() -> None:
    vehicle = vehicle_of(Counter)
    journals = InputJournals(vehicle)
    vehicle.start()
    for tick in range(1, MANY):
        vehicle.kernel.run(until=tick * SECOND // 10)
        vehicle.daemon.publish(imc.Temperature(value=0.0))
    counter = vehicle.task("Counter")
    assert isinstance(counter, Counter)
    assert len(journals.journal_of(counter).entries) < 2 * MANY
    vehicle.kernel.run(until=vehicle.kernel.now_ns + 1)
    snapshot, count = load(take_snapshot(vehicle)), counter.count
    vehicle.close()
    other = vehicle_of(Counter, time=snapshot.time)
    restore(other, snapshot)
    restored = other.task("Counter")
    assert isinstance(restored, Counter)
    assert restored.count == count
    other.close()
