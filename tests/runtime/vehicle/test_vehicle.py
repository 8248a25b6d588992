"""The vehicle: entities, parameters over the bus, and activation."""

import pytest

import imc
from runtime import ActivationError, ParameterError, Task, param
from runtime.kernel import SECOND, WallClock
from runtime.task import EntityError, EntityTable
from runtime.testing import NoProfile, simulate
from runtime.vehicle import Vehicle, section_name

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
    first, second = EntityTable(1), EntityTable(1)
    second.reserve("Another", "x")
    assert first.reserve("GPS", "a").id == second.reserve("GPS", "a").id
    assert 1 <= first.find("GPS").id <= 254
    assert first.reserve("Daemon", "Daemon").id == 0


def test_all_ids_are_used_before_it_is_an_error():
    entities = EntityTable(1)
    ids = {entities.reserve(f"entity {n}", "x").id for n in range(254)}
    assert ids == set(range(1, 255))
    with pytest.raises(EntityError, match="at most 254"):
        entities.reserve("one more", "x")


def test_labels_are_unique_and_not_empty():
    entities = EntityTable(1)
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


def test_a_vehicle_that_runs_twice_on_one_bus_is_reported_so_once():
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
        vehicle.bus.attach_transport(wire)
        for entity in (0, vehicle.task_by_label("Pump").entity.id, vehicle.task_by_label("Pump").entity.id):
            wire.receive(imc.encode(imc.Temperature(src=0x1A, src_ent=entity, timestamp=script.now)))
            await script.sleep(0.1)
        assert vehicle.bus.refused == 2, "only what claims to be of an entity that runs here"

    run = simulate(Pump, seconds=2.0, script=twin)
    assert len([text for text in run.log if "another process publishes as Pump" in text]) == 1


def test_tasks_share_what_they_make_of_the_profile_until_a_parameter_changes():
    run = simulate(Pump, settings={"Pool": {"Depth": "3"}}, flow=1.5)
    changes, made = run.vehicle.effective_config, []

    def pool(profile):
        made.append((profile.value("Pool", "Depth"), profile.value(section_name(Pump), "Flow")))
        return made[-1]

    assert [changes.shared_object(pool), changes.shared_object(pool)] == [("3", "1.5")] * 2
    changes.update_from_task(run.task)
    changes.shared_object(pool)
    assert len(made) == 1
    run.task.flow = 4.0
    changes.update_from_task(run.task)
    changes.shared_object(pool)
    assert len(made) == 2
