"""Parameters that a plan sets, and payloads that it activates."""

from flying import START, fly, last, modes, replies, start

import imc
from runtime import ActivationError, Task, param
from runtime.fault_injection import Injection, Silent


class Payload(Task):
    """A payload that a plan activates."""

    activation = "plan"
    active: bool = param(False, "", "Whether it works.", scope="plan")
    gain: int = param(1, "1", "Its gain.", scope="plan")
    broken: bool = param(False, "", "Whether it fails.")

    def activate(self) -> None:
        if self.broken:
            raise ActivationError("no power")


def setting(**values):
    parameters = [imc.EntityParameter(name=name.title(), value=value) for name, value in values.items()]
    return imc.SetEntityParameters(name="Payload", params=parameters)


def with_actions():
    items = [
        imc.PlanManeuver(maneuver_id="m0", data=imc.IdleManeuver(duration=20)),
        imc.PlanManeuver(
            maneuver_id="m1",
            data=imc.IdleManeuver(duration=5),
            start_actions=[setting(active="true", gain="3")],
            end_actions=[setting(active="false")],
        ),
    ]
    arrow = imc.PlanTransition(source_man="m0", dest_man="m1")
    return imc.PlanSpecification(
        plan_id="test", start_man_id="m0", maneuvers=items, transitions=[arrow], start_actions=[setting(gain="2")]
    )


def test_actions_set_parameters_ahead_and_bring_them_back():
    run = fly(start(with_actions()), seconds=40, more=((Payload, {"activation_time": 8}),))
    begin = run.vehicle.start_time + START
    steps = [
        (round(m.timestamp - begin), [(p.name, p.value) for p in m.params]) for m in run.of(imc.SetEntityParameters)
    ]
    assert steps == [
        (0, [("Gain", "2")]),
        (12, [("Active", "true")]),
        (20, [("Gain", "3")]),
        (25, [("Active", "false")]),
    ]
    assert [m.name for m in run.of(imc.PushEntityParameters)] == ["Payload"]
    assert [m.name for m in run.of(imc.PopEntityParameters)] == ["Payload"]
    (payload,) = (task for task in run.tasks if isinstance(task, Payload))
    assert payload.gain == 1
    assert last(run) == ("READY", "SUCCESS")


def test_a_fault_that_begins_in_a_plan_concerns_its_actions():
    fault = Injection(Silent(("SetEntityParameters",)), start=START + 10.0, task="Plan.Engine")
    run = fly(start(with_actions()), seconds=40, more=((Payload, {"activation_time": 8}),), faults=[fault])
    assert [[p.name for p in m.params] for m in run.of(imc.SetEntityParameters)] == [["Gain"]]


def test_a_payload_that_cannot_be_activated_ends_the_plan():
    run = fly(start(with_actions()), seconds=40, more=((Payload, {"broken": True}),))
    assert replies(run)[-1] == ("FAILURE", "failed to activate Payload: no power")
    assert modes(run)[-1] == "SERVICE"


def test_actions_off_the_expected_way_come_when_it_is_taken():
    plan = with_actions()
    elsewhere = [imc.PlanManeuver(maneuver_id=name, data=imc.IdleManeuver(duration=3)) for name in ("m2", "m3")]
    arrows = [("m0", "m2", "FuelLevel.value < 0"), ("m0", "m3", ""), ("m3", "m1", "")]
    transitions = [imc.PlanTransition(source_man=a, dest_man=b, conditions=when) for a, b, when in arrows]
    plan = plan.replace(maneuvers=(*plan.maneuvers, *elsewhere), transitions=transitions)
    run = fly(start(plan), seconds=40, more=((Payload, {"activation_time": 8}),))
    assert ("Active", "true") in [(p.name, p.value) for m in run.of(imc.SetEntityParameters) for p in m.params]
    assert last(run) == ("READY", "SUCCESS")
