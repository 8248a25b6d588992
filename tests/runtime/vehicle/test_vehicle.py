"""The vehicle: entities, parameters over the bus, activation, failures and restarts."""

import socket

import pytest

import imc
from runtime import ActivationError, ParameterError, State, Task, consume, param, periodic
from runtime.kernel import SECOND, ScaledClock, VirtualClock, WallClock
from runtime.task import Entities, EntityError
from runtime.testing import START, NoProfile, simulate
from runtime.vehicle import Vehicle

CONSOLE = 0x4001
Phase = imc.EntityActivationState.State


class Pump(Task):
    """Pumps."""

    flow: float = param(1.0, "l/s", "Flow.", minimum=0.0, maximum=10.0, visibility="user")
    head: float = param(2.0, "m", "Head.", scope="plan")
    serial: str = param("A1", "", "Serial number.", editable=False)

    def configure(self) -> None:
        if self.flow * self.head > 20.0:
            raise ParameterError("Flow", "more than the pump can do")


class Light(Task):
    """Shines."""

    activation = "global"
    active: bool = param(False, "", "Whether it shines.", scope="global")
    broken: bool = param(False, "", "Whether it cannot.")

    def activate(self) -> None:
        if self.broken:
            raise ActivationError("no bulb")


def ask(message, at=1.0):
    return message.replace(timestamp=at, src=CONSOLE, src_ent=7, dst=0x1A)


def setting(label, **values):
    params = tuple(imc.EntityParameter(name=name.replace("_", " "), value=value) for name, value in values.items())
    return imc.SetEntityParameters(name=label, params=params)


def pairs(message):
    return {p.name: p.value for p in message.params}


def answers(run, kind):
    return [m for m in run.messages if isinstance(m, kind) and m.dst == CONSOLE and m.dst_ent == 7]


def test_ids_follow_from_labels_and_not_from_the_others():
    first, second = Entities(1), Entities(1)
    second.reserve("Another", "x")
    assert first.reserve("GPS", "a").id == second.reserve("GPS", "a").id
    assert 1 <= first.find("GPS").id <= 254
    assert first.reserve("Daemon", "Daemon").id == 0


def test_all_ids_are_used_before_it_is_an_error():
    entities = Entities(1)
    ids = {entities.reserve(f"entity {n}", "x").id for n in range(254)}
    assert ids == set(range(1, 255))
    with pytest.raises(EntityError, match="at most 254"):
        entities.reserve("one more", "x")


def test_labels_are_unique_and_not_empty():
    entities = Entities(1)
    entities.reserve("GPS", "Simulators.GPS")
    with pytest.raises(EntityError, match=r"Sensors.GPS: .*'GPS' is taken by Simulators.GPS"):
        entities.reserve("GPS", "Sensors.GPS")
    with pytest.raises(EntityError, match="empty"):
        entities.reserve("", "Sensors.GPS")


def test_parameters_are_set_and_what_was_accepted_is_replied():
    run = simulate(Pump, [ask(setting("Pump", Flow="2.5", Head="3", Speed="1", Serial="B2"))], seconds=2)
    (reply,) = answers(run, imc.EntityParameters)
    assert (reply.name, pairs(reply)) == ("Pump", {"Flow": "2.5", "Head": "3.0"})
    assert (run.task.flow, run.task.head, run.task.serial) == (2.5, 3.0, "A1")
    assert any("Speed" in text and "0x4001" in text for text in run.log)
    assert any("Serial" in text and "cannot be changed" in text for text in run.log)


@pytest.mark.parametrize("value", ["11", "-1", "much", "nan", ""])
def test_a_bad_value_changes_nothing(value):
    run = simulate(Pump, [ask(setting("Pump", Flow=value))], seconds=2)
    assert run.task.flow == 1.0


def test_values_that_make_no_sense_together_are_taken_back():
    run = simulate(Pump, [ask(setting("Pump", Flow="9", Head="9"))], seconds=2)
    assert (run.task.flow, run.task.head) == (1.0, 2.0)
    assert answers(run, imc.EntityParameters) == []
    assert any("more than the pump can do" in text for text in run.log)


def test_parameters_are_queried_by_visibility_and_scope():
    def query(visibility, scope):
        wish = imc.QueryEntityParameters(name="Pump", visibility=visibility, scope=scope)
        return [list(pairs(m)) for m in answers(simulate(Pump, [ask(wish)], seconds=2), imc.EntityParameters)]

    assert query("user", "global") == [["Flow"]]
    assert query("developer", "plan") == [["Head"]]
    assert {"Flow", "Head", "Serial", "Debug Level"} <= set(query("developer", "global")[0])
    assert query("everybody", "global") == []


def test_unknown_labels_and_other_vehicles_requests_are_met_with_silence():
    feed = [ask(setting("Rudder", Flow="2")), ask(setting("Pump", Flow="2")).replace(dst=0x1B)]
    run = simulate(Pump, feed, seconds=2)
    assert answers(run, imc.EntityParameters) == []
    assert run.task.flow == 1.0


def test_push_and_pop_bring_back_what_may_change_per_plan():
    feed = [
        ask(imc.PushEntityParameters(name="Pump"), 1.0),
        ask(setting("Pump", Flow="3", Head="5"), 2.0),
        ask(imc.PopEntityParameters(name="Pump"), 3.0),
    ]
    task = simulate(Pump, feed, seconds=4).task
    assert (task.flow, task.head) == (3.0, 2.0)


def test_typed_parameters_say_type_unit_and_limits():
    wish = imc.QueryTypedEntityParameters(op=0, request_id=5, entity_name="Pump")
    (reply,) = answers(simulate(Pump, [ask(wish)], seconds=2), imc.QueryTypedEntityParameters)
    flow = next(p for p in reply.parameters if p.name == "Flow")
    assert (flow.type, flow.units, flow.min_value, flow.max_value, flow.default_value) == (3, "l/s", 0.0, 10.0, "1.0")
    assert reply.request_id == 5


def test_entities_introduce_themselves():
    run = simulate(Pump, [ask(imc.EntityList(op=imc.EntityList.Op.QUERY)), ask(imc.QueryEntityInfo(), 2.0)], seconds=3)
    (info,) = [m for m in run.of(imc.EntityInfo) if m.label == "Pump"]
    assert (info.id, info.src_ent, info.component) == (run.task.entity.id, run.task.entity.id, run.task.name)


def test_activation_goes_through_its_states():
    run = simulate(
        Light, [ask(setting("Light", Active="true"), 1.0), ask(setting("Light", Active="false"), 2.0)], seconds=3
    )
    states = [m.state for m in run.of(imc.EntityActivationState)]
    assert states == [Phase.ACT_IP, Phase.ACT_DONE, Phase.ACTIVE, Phase.DEACT_IP, Phase.DEACT_DONE, Phase.INACTIVE]
    assert run.task.active is False


def test_a_failed_activation_says_why():
    run = simulate(Light, seconds=1, active=True, broken=True)
    states = [(m.state, m.error) for m in run.of(imc.EntityActivationState)]
    assert states == [(Phase.ACT_IP, ""), (Phase.ACT_FAIL, "no bulb"), (Phase.INACTIVE, "")]
    assert run.task.active is False


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
    assert any("depth -1.0" in text and "test_vehicle.py" in text for text in run.log)


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
            self.reserve("Spare")
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
            "script": lambda: self.run(failing_script),
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
    assert [note.split()[1] for note in caught.value.__notes__] == ["tests.runtime.vehicle.test_vehicle.Everywhere"]
    after = run(keep_going=True)
    assert after.task.starts == 2
    assert after.task.entity.state is State.NORMAL
    assert after.tasks[1].heard > 5
    assert after.vehicle.kernel._sources.count == 0


def test_a_run_lasts_as_long_as_was_asked_for_however_late_it_begins():
    class Ahead(WallClock):
        offset = 0

        def read(self):
            return super().read() + self.offset

    clock = Ahead()
    vehicle = Vehicle("late", 1, clock=clock, profile=NoProfile())
    clock.offset = 3 * SECOND
    vehicle.run(0.05)
    vehicle.close()
    assert vehicle.kernel.now_ns / SECOND - vehicle.start_time >= 3.05


def test_a_vehicle_that_runs_twice_on_one_bus_is_told_so_once():
    class Wire:
        """A transport whose other end is in this test."""

        def open(self, receive):
            self.receive = receive

        def send(self, message, packet):
            """No other process."""

        def close(self):
            """Nothing to close."""

    async def twin(script):
        wire, vehicle = Wire(), script.task.vehicle
        vehicle.bus.attach(wire)
        for entity in (0, vehicle.find("Pump").entity.id, vehicle.find("Pump").entity.id):
            wire.receive(imc.encode(imc.Temperature(src=0x1A, src_ent=entity, timestamp=script.now)))
            await script.sleep(0.1)
        assert vehicle.bus.refused == 2, "only what claims to be of an entity that runs here"

    run = simulate(Pump, seconds=2.0, script=twin)
    assert len([text for text in run.log if "another process publishes as Pump" in text]) == 1
