"""The Daemon reports entities and their states, periodically and on request."""

import imc
from runtime import State, Task, consume, param
from runtime.testing import START, simulate

CONSOLE = 0x4001
ASKED = 1.25


class Lamp(Task):
    """Shines."""

    activation = "global"
    active: bool = param(True, "", "Whether it shines.")

    def start(self) -> None:
        self.set_entity_state(State.FAULT, "dim")


class Silent(Task):
    """Never reports its state."""


class Listener(Task):
    """Keeps what it receives."""

    def configure(self):
        self.heard = []

    @consume
    def hear(self, message: imc.Message) -> None:
        self.heard.append(message)


def ask(request, kind, dst=0x1A):
    """The run, and the messages of one type at the time of the request."""
    feed = [request.replace(timestamp=ASKED, src=CONSOLE, src_ent=7, dst=dst)]
    run = simulate([Lamp, Silent, Listener], feed, seconds=1.5)
    return run, [m for m in run.tasks[2].heard if isinstance(m, kind) and m.timestamp > START + 1.1]


def test_heartbeats_and_states_come_each_second_unasked():
    run = simulate([Lamp, Silent, Listener], seconds=5.0)
    heard = run.tasks[2].heard
    assert [m.timestamp - START for m in heard if isinstance(m, imc.Heartbeat)] == [0.0, 1.0, 2.0, 3.0, 4.0]
    dim = [m for m in heard if isinstance(m, imc.EntityState) and m.src_ent == run.task.entity.id]
    assert len(dim) == 6
    assert {(m.state, m.description) for m in dim} == {(State.FAULT, "dim")}
    assert run.tasks[1].entity.id not in {m.src_ent for m in heard}


def test_the_list_of_entities_is_reported_to_who_asks():
    run, (report,) = ask(imc.EntityList(op=imc.EntityList.Op.QUERY), imc.EntityList)
    labels = dict(entry.split("=") for entry in report.list.split(";"))
    assert labels == {entity.label: str(entity.id) for entity in run.vehicle.entities}
    assert {"Daemon", "Lamp", "Silent"} <= set(labels)
    assert (report.op, report.dst, report.dst_ent) == (imc.EntityList.Op.REPORT, CONSOLE, 7)


def test_states_are_reported_for_all_entities_or_for_one():
    run, states = ask(imc.QueryEntityState(), imc.EntityState)
    assert {m.src_ent for m in states} == {0, run.task.entity.id}
    run, (state,) = ask(imc.QueryEntityState(dst_ent=run.task.entity.id), imc.EntityState)
    assert (state.src_ent, state.dst, state.description) == (run.task.entity.id, CONSOLE, "dim")


def test_activation_is_reported_and_requests_for_other_vehicles_are_not_ours():
    run, (state,) = ask(imc.QueryEntityActivationState(), imc.EntityActivationState)
    assert (state.state, state.src_ent) == (imc.EntityActivationState.State.ACTIVE, run.task.entity.id)
    assert ask(imc.QueryEntityActivationState(), imc.EntityActivationState, dst=0x1B)[1] == []
    assert ask(imc.QueryEntityState(), imc.EntityState, dst=0x1B)[1] == []


def test_labels_that_others_tell_are_remembered():
    info = imc.EntityInfo(label="Their GPS", src=0x1B, src_ent=9)
    run = simulate(Silent, [info], seconds=1.0)
    assert run.vehicle.entities.label(0x1B, 9) == "Their GPS"


def test_who_sends_unknown_messages_is_named_once_for_each():
    feed = [
        imc.Unknown(id=number, src=CONSOLE + n, dst=dst, timestamp=1.0 + n / 1000)
        for n in (0, 1, 1, *range(2, 100))
        for number, dst in ((30001, 0x1A), (30002, 0x1A), (30003, 0xFFFF), (30004, 0x1B))
    ]
    run = simulate(Listener, feed, seconds=2.0)
    said = [m.text for m in run.task.heard if isinstance(m, imc.LogBookEntry)]
    dropped = "packet from 0x400{} dropped: there is no message with id {} here, see [General] Messages"
    assert said[:3] == [dropped.format(1, 30001), dropped.format(1, 30002), dropped.format(2, 30001)]
    assert (len(said), said[-1].endswith("; further ones are not named")) == (64, True)
