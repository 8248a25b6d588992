"""What happens to a vehicle whose tasks fail."""

import socket

import pytest

import imc
from runtime import State, Task, consume, param, periodic
from runtime.kernel import ScaledClock, VirtualClock
from runtime.testing import START, NoProfile, simulate
from runtime.vehicle import Vehicle


class Fragile(Task):
    """Fails on a negative depth."""

    def start(self):
        self.starts = getattr(self, "starts", 0) + 1
        self.stops = getattr(self, "stops", 0)
        self.set_entity_state(State.NORMAL, "active")

    def stop(self):
        self.stops += 1

    @consume
    def look(self, depth: imc.Depth) -> None:
        if depth.value < 0.0:
            raise ValueError(f"depth {depth.value}")

    @periodic(10.0)
    def tick(self) -> None:
        self.publish(imc.Temperature(value=1.0))


class Steady(Task):
    """Counts temperatures."""

    def start(self):
        self.heard = 0

    @consume
    def hear(self, _: imc.Temperature) -> None:
        self.heard += 1


def test_in_simulation_an_exception_ends_the_run():
    with pytest.raises(ValueError, match="depth -1"):
        simulate(Fragile, [imc.Depth(value=-1.0, timestamp=2.0)], seconds=5)


def test_on_a_vehicle_the_task_restarts_with_back_off_and_the_others_go_on():
    feed = [imc.Depth(value=-1.0, timestamp=t) for t in (1.0, 3.0, 6.0)]
    run = simulate([Fragile, Steady], feed, seconds=20, keep_going=True)
    fragile, steady = run.tasks
    states = [
        (m.state, round(m.timestamp - START, 3)) for m in run.of(imc.EntityState) if m.src_ent == fragile.entity.id
    ]
    changes = [now for before, now in zip([(None, 0), *states], states, strict=False) if before[0] != now[0]]
    assert changes == [
        (State.NORMAL, 0.0),
        (State.FAILURE, 1.0),
        (State.NORMAL, 2.0),
        (State.FAILURE, 3.0),
        (State.NORMAL, 5.0),
        (State.FAILURE, 6.0),
        (State.NORMAL, 10.0),
    ]
    assert (fragile.starts, fragile.stops) == (4, 4)
    assert steady.heard == len(run.of(imc.Temperature)) > 100
    assert any("depth -1.0" in text and "test_failures.py" in text for text in run.log)


def test_a_task_that_fails_in_start_is_tried_again():
    class Stubborn(Task):
        """Starts at the third attempt."""

        def start(self):
            self.attempts = getattr(self, "attempts", 0) + 1
            if self.attempts < 3:
                raise OSError("port is taken")
            self.set_entity_state(State.NORMAL, "active")

    run = simulate(Stubborn, seconds=10, keep_going=True)
    assert run.task.attempts == 3
    assert run.task.entity.state is State.NORMAL


def test_tasks_are_stopped_at_the_end_and_recorders_hear_the_last_words():
    class Polite(Task):
        """Says goodbye."""

        def stop(self):
            self.publish(imc.Depth(value=42.0))

    class Recorder(Task):
        """Records."""

        def start(self):
            self.last = None

        @consume(others=True)
        def hear(self, message: imc.Message) -> None:
            self.last = message

    run = simulate([Recorder, Polite], seconds=1)
    assert isinstance(run.tasks[0].last, imc.Depth)


def failing(kind, text):
    class Failing(Task):
        """Cannot start."""

        def start(self):
            raise kind(text)

    return Failing


@pytest.mark.parametrize("text", ["x" * 100_000, "\ud800 lone surrogate", "line\nline", "\udcff byte"])
def test_whatever_an_exception_says_the_others_go_on(text):
    run = simulate([failing(ValueError, text), Steady, Fragile], seconds=5.0, keep_going=True)
    assert run.tasks[1].heard > 40
    failures = [m for m in run.of(imc.EntityState) if m.state == State.FAILURE]
    assert failures
    assert len(failures[0].description) < 1024


def test_a_task_that_never_works_is_tried_for_ever(monkeypatch):
    monkeypatch.setattr("runtime.vehicle.vehicle.LONGEST_BACKOFF", 0.001)
    run = simulate(failing(OSError, "no such port"), seconds=1.2, keep_going=True)
    assert len(run.log) > 1100


def test_a_task_that_works_again_says_so_even_where_it_says_nothing_else():
    class Silent(Task):
        """Fails once."""

        @consume
        def look(self, depth: imc.Depth) -> None:
            if depth.value < 0.0:
                raise ValueError("negative")

    run = simulate(Silent, [imc.Depth(value=-1.0, timestamp=1.0)], seconds=5.0, keep_going=True)
    states = dict.fromkeys((m.state, m.description) for m in run.of(imc.EntityState))
    assert list(states) == [(State.FAILURE, "ValueError: negative"), (State.NORMAL, "restarted")]


class Rude(Task):
    """Fails to stop."""

    def stop(self):
        raise OSError("still open")


class Tidy(Task):
    """Stops in order."""

    stopped = False

    def stop(self):
        self.stopped = True


class Surprised(Task):
    """Fails on the last messages of others."""

    @consume(others=True)
    def hear(self, message: imc.Message) -> None:
        if isinstance(message, imc.Depth):
            raise ValueError("at the very end")


class Farewell(Task):
    """Publishes a message in stop()."""

    def stop(self):
        self.publish(imc.Depth(value=1.0))


def closing(tasks, keep_going):
    seen = []

    class Witness(Tidy):
        """Keeps a reference to each instance."""

        def start(self):
            seen.append(self)

    try:
        simulate([Witness, *tasks, (Witness, {"entity_label": "other"})], seconds=1.0, keep_going=keep_going)
    finally:
        assert [witness.stopped for witness in seen] == [True, True]


@pytest.mark.parametrize("tasks", [[Rude], [Surprised, Farewell]])
def test_an_error_at_the_end_is_raised_in_simulation_when_all_have_stopped(tasks):
    with pytest.raises((OSError, ValueError), match=r"still open|very end"):
        closing(tasks, keep_going=False)
    closing(tasks, keep_going=True)


def test_the_error_that_ends_a_run_is_not_hidden_by_those_that_follow():
    with pytest.raises(ValueError, match="depth -1"):
        simulate([Rude, Fragile], [imc.Depth(value=-1.0), imc.Depth(value=-2.0)], seconds=5)


def test_a_task_that_cannot_be_made_leaves_nothing_behind():
    class Careless(Task):
        """Fails in configure()."""

        def configure(self):
            self.reserve_entity("Spare")
            raise KeyError("what")

    vehicle = Vehicle("v", 1, clock=VirtualClock(0), profile=NoProfile())
    for _ in range(2):
        with pytest.raises(KeyError):
            vehicle.add(Careless, "Simulators.Careless")
    assert [entity.label for entity in vehicle.entities] == ["Daemon"]
    vehicle.close()


def fail(*_):
    raise ValueError("on purpose")


async def failing_script(script):
    await script.sleep(0.1)
    fail()


class Everywhere(Task):
    """Fails once, at the place that `hook` names."""

    activation = "global"
    active: bool = param(False, "", "Whether it is active.")
    hook: str = param("", "", "Where it fails.")

    def configure(self) -> None:
        self.starts = 0

    def start(self) -> None:
        self.starts += 1
        self.sockets = socket.socketpair()
        if self.starts > 1:
            self.after(0.5, self.vehicle.stop)
            return
        hooks = {
            "start": fail,
            "after": lambda: self.after(0.1, fail),
            "at": lambda: self.at(self.now + 0.1, lambda: fail(self)),
            "script": lambda: self.start_script(failing_script),
            "offload": lambda: self.offload(fail, then=print),
            "then": lambda: self.offload(int, then=fail),
            "watch": lambda: (self.watch(self.sockets[0], lambda: fail(self)), self.sockets[1].send(b"x")),
        }
        hooks.get(self.hook, int)()

    def stop(self) -> None:
        for end in self.sockets:
            end.close()

    def activate(self) -> None:
        if self.hook == "activate" and self.starts == 1:
            fail()

    @consume
    def hear(self, _: imc.Temperature) -> None:
        if self.hook == "consume" and self.starts == 1:
            fail()

    @periodic(10.0)
    def tick(self) -> None:
        if self.hook == "periodic" and self.starts == 1:
            fail()


HOOKS = ["start", "after", "at", "script", "offload", "then", "watch", "activate", "consume", "periodic"]


@pytest.mark.parametrize("speed", [0.0, 20.0])
@pytest.mark.parametrize("hook", HOOKS)
def test_wherever_a_task_fails_it_ends_a_simulation_and_restarts_on_a_vehicle(hook, speed):
    def run(keep_going):
        clock = ScaledClock(speed) if speed else None
        tasks = [(Everywhere, {"hook": hook, "active": True}), Steady, Fragile]
        return simulate(tasks, [imc.Temperature(timestamp=0.2)], seconds=60.0, clock=clock, keep_going=keep_going)

    with pytest.raises(ValueError, match="on purpose") as caught:
        run(keep_going=False)
    assert [note.split()[1] for note in caught.value.__notes__] == ["tests.runtime.vehicle.test_failures.Everywhere"]
    after = run(keep_going=True)
    assert after.task.starts == 2
    assert after.task.entity.state is State.NORMAL
    assert after.tasks[1].heard > 5
    assert after.vehicle.kernel._sources.count == 0
