"""Snapshots while scripts run: the task replays its journal, or the snapshot is refused."""

import functools
from typing import Any

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

import imc
from runtime import Script, State, Task, consume, param, periodic
from runtime.kernel import SECOND, VirtualClock
from runtime.snapshot import InputJournals, SnapshotError, load, restore, take_snapshot
from runtime.snapshot.input_journal import MANY
from runtime.testing import NoProfile
from runtime.vehicle import Vehicle

LENGTH = 8.0
Heard = list[tuple[int, bytes]]


class Weather(Task):
    """Publishes now and then, and changes the rate of the other task."""

    @periodic(7.0)
    def tell(self) -> None:
        self.publish(imc.Temperature(value=self.random.random()))

    @periodic(0.6)
    def meddle(self) -> None:
        rate = imc.EntityParameter(name="Rate", value=f"{self.random.integers(1, 9)}")
        self.publish(imc.PushEntityParameters(name="Walker", dst=self.system))
        self.publish(imc.SetEntityParameters(name="Walker", params=(rate,), dst=self.system))


class Walker(Task):
    """Waits in every way, with state in locals, attributes, timers and random numbers."""

    rate: float = param(3.0, "Hz", "How often it ticks.", scope="plan")

    def start(self) -> None:
        self.latest: imc.Temperature | None = None
        self.steps = 0
        self.walking = self.start_script(self.walk, "on")
        self.reaction: Script | None = None
        self.set_entity_state(State.NORMAL, "walking")

    def configure(self) -> None:
        self.changes = getattr(self, "changes", 0) + 1

    @consume
    def keep(self, message: imc.Temperature) -> None:
        self.latest = message
        if message.value > 0.8 and (self.reaction is None or self.reaction.done):
            self.reaction = self.start_script(self.react, message)
        elif message.value < 0.1 and self.reaction is not None:
            self.reaction.cancel()

    @periodic("rate")
    def tick(self) -> None:
        self.steps += self.changes

    def say(self, text: str) -> None:
        self.publish(imc.LogBookEntry(text=f"{text} {self.steps} {self.random.integers(1000)}"))

    async def walk(self, script: Script, word: str) -> None:
        inbox = script.listen(imc.Temperature)
        for turn in iter(int, 1):
            first = await inbox.next()
            assert isinstance(first, imc.Temperature)
            await script.sleep(self.random.uniform(0.01, 0.4))
            self.after(self.random.uniform(0.0, 0.7), self.say, f"{word} {turn} {first.value}")
            try:
                high = await script.receive(
                    imc.Temperature, where=lambda m, low=first: m.value > low.value, timeout=0.3
                )
                self.set_entity_state(State.NORMAL, f"{high.value}" + (" still" if high is self.latest else ""))
            except TimeoutError as error:
                self.say(str(error))

    async def react(self, script: Script, message: imc.Temperature) -> None:
        try:
            for number in range(5):
                await script.sleep(0.11)
                self.say(f"{number} {message.value}")
        finally:
            self.steps += 1


def vehicle_of(*tasks: type[Task], seed: int = 0, time: int = 0, heard: Heard | None = None) -> Vehicle:
    vehicle = Vehicle("walking", 0x1A, clock=VirtualClock(time), profile=NoProfile(), seed=seed)
    for task in tasks:
        vehicle.add(task, task.__name__)
    if heard is not None:
        vehicle.observe(imc.Message, lambda _, packet: heard.append((vehicle.kernel.now_ns, packet)), packets=True)
    return vehicle


def go_on(snapshot: bytes, *tasks: type[Task], seed: int = 0, until: float = LENGTH, again: bool = False) -> Any:
    """The packets from a snapshot on; with `again` also the next snapshot."""
    heard: Heard = []
    vehicle = vehicle_of(*tasks, seed=seed, time=load(snapshot).time, heard=heard)
    try:
        if again:
            InputJournals(vehicle)
        restore(vehicle, load(snapshot))
        vehicle.kernel.run(until=round(until * SECOND))
        return take_snapshot(vehicle) if again else list(heard)
    finally:
        vehicle.close()


@pytest.mark.heavy
@given(st.lists(st.floats(0.001, LENGTH), min_size=2, max_size=4, unique=True), st.integers(0, 2**32))
@settings(max_examples=15)
def test_scripts_go_on_from_any_moment(times: list[float], seed: int) -> None:
    heard: Heard = []
    vehicle = vehicle_of(Weather, Walker, seed=seed, heard=heard)
    InputJournals(vehicle)
    vehicle.start()
    saved: list[bytes] = []
    for time in sorted(times):
        vehicle.kernel.run(until=round(time * SECOND))
        saved.append(take_snapshot(vehicle))
    vehicle.kernel.run(until=round(LENGTH * SECOND))
    whole = list(heard)
    vehicle.close()
    plain: Heard = []
    other = vehicle_of(Weather, Walker, seed=seed, heard=plain)
    other.start()
    other.kernel.run(until=round(LENGTH * SECOND))
    assert plain == whole
    other.close()
    for snapshot in saved:
        assert go_on(snapshot, Weather, Walker, seed=seed) == [p for p in whole if p[0] >= load(snapshot).time]
    later = go_on(saved[0], Weather, Walker, seed=seed, until=sorted(times)[1], again=True)
    assert go_on(later, Weather, Walker, seed=seed) == [p for p in whole if p[0] >= load(later).time]


class Sleeper(Task):
    """Receives a lot, and seldom runs a script."""

    count = 0

    @consume
    def keep(self, message: imc.Temperature) -> None:
        self.count += 1
        if self.count == 4 * MANY:
            self.start_script(self.nap)

    async def nap(self, script: Script) -> None:
        await script.sleep(2.0)
        self.publish(imc.LogBookEntry(text=f"{self.count}"))


def test_a_journal_begins_anew_while_no_script_runs() -> None:
    heard: Heard = []
    vehicle = vehicle_of(Weather, Sleeper, heard=heard)
    journals = InputJournals(vehicle)
    vehicle.start()
    vehicle.run(4 * MANY / 7 + 1.0)
    journal = journals.journal_of(vehicle.task("Sleeper"))
    assert journal.past is not None
    assert len(journal.entries) < 2 * MANY
    assert len(journal.past.chunks) <= 1
    snapshot = take_snapshot(vehicle)
    assert len(snapshot) < 20_000
    vehicle.run(2.0)
    end = vehicle.kernel.now_ns
    vehicle.close()
    after = go_on(snapshot, Weather, Sleeper, until=end / SECOND)
    assert after == [p for p in heard if load(snapshot).time <= p[0] < end]
    assert sum(imc.header(packet).id == imc.LogBookEntry.ID for _, packet in after) == 1


class Moody(Task):
    """Depends on state outside the task."""

    mood = 5.0

    def start(self) -> None:
        self.start_script(self.brood)

    async def brood(self, script: Script) -> None:
        await script.sleep(Moody.mood)


class Hoarder(Task):
    """Has an attribute that cannot be saved when its script begins."""

    def start(self) -> None:
        self.hoard = iter([1])
        self.after(50.0, self.begin)

    def begin(self) -> None:
        self.start_script(self.wait)

    async def wait(self, script: Script) -> None:
        await script.sleep(5.0)

    @consume
    def keep(self, _: imc.Temperature) -> None:
        """Makes its journal long."""


class Roundabout(Task):
    """Schedules a callable that has no name."""

    def start(self) -> None:
        self.start_script(self.wait)

    @periodic(1.0)
    def tick(self) -> None:
        self.vehicle.kernel.soon(functools.partial(self.hear, 1))

    def hear(self, number: int) -> None:
        self.number = number

    async def wait(self, script: Script) -> None:
        await script.sleep(5.0)


class Stranger:
    """An object that a snapshot cannot save."""

    def __init__(self) -> None:
        self.me = iter([self])


class Confidant(Roundabout):
    """Receives objects that cannot be saved."""

    @periodic(200.0)
    def tick(self) -> None:
        self.vehicle.kernel.soon(self.learn, Stranger())

    def learn(self, _: Stranger) -> None:
        """Ignore it."""


async def elsewhere(script: Script) -> None:
    await script.sleep(5.0)


def saved_after(seconds: float, *tasks: type[Task], journals: bool = True) -> bytes:
    vehicle = vehicle_of(*tasks)
    try:
        if journals:
            InputJournals(vehicle)
        vehicle.start()
        vehicle.run(seconds)
        return take_snapshot(vehicle)
    finally:
        vehicle.close()


def test_a_script_that_depends_on_the_outside_is_refused(monkeypatch: pytest.MonkeyPatch) -> None:
    snapshot = saved_after(1.0, Moody)
    assert go_on(snapshot, Moody, until=2.0)
    monkeypatch.setattr(Moody, "mood", 7.0)
    with pytest.raises(SnapshotError, match="Moody cannot be restored: the replay of its journal ended in another"):
        go_on(snapshot, Moody)


def test_what_cannot_be_saved_before_a_script_is_named() -> None:
    with pytest.raises(SnapshotError, match=r"Hoarder runs a script, .*hoard is a list_iterator"):
        saved_after(52.0, Weather, Hoarder)


def test_a_journal_that_misses_a_call_is_of_no_use() -> None:
    with pytest.raises(SnapshotError, match=r"Roundabout runs a script, and its journal was lost: it was called by"):
        saved_after(1.5, Roundabout)


@pytest.mark.parametrize("seconds", [1.0, 4.0])
def test_a_journal_of_what_cannot_be_saved_is_of_no_use(seconds: float) -> None:
    with pytest.raises(SnapshotError, match=r"Confidant.*me is a list_iterator"):
        saved_after(seconds, Confidant)


def test_a_script_without_a_journal_is_refused() -> None:
    with pytest.raises(SnapshotError, match="Walker runs a script, and no journals are kept"):
        saved_after(1.0, Walker, journals=False)


def test_a_script_of_somebody_else_is_refused() -> None:
    vehicle = vehicle_of(Weather)
    InputJournals(vehicle)
    vehicle.start()
    vehicle.task("Weather").start_script(elsewhere)
    vehicle.run(1.0)
    with pytest.raises(SnapshotError, match="Weather runs a script that is not a method of its class"):
        take_snapshot(vehicle)
    vehicle.close()


@pytest.mark.parametrize("place", [0.01, 0.3, 0.6, 0.99])
def test_a_damaged_snapshot_is_refused(place: float) -> None:
    snapshot = bytearray(saved_after(1.5, Weather, Walker))
    snapshot[int(place * len(snapshot))] ^= 0x10
    with pytest.raises(SnapshotError):
        load(bytes(snapshot))


def test_what_is_cut_off_is_refused() -> None:
    with pytest.raises(SnapshotError):
        load(saved_after(1.5, Weather, Walker)[:-1])
