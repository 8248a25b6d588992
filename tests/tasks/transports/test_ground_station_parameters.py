"""What a console asks a vehicle about its parameters, on the bus of the shipped vehicles."""

import math

import pytest

import imc
from tests.tasks.transports.console import PROFILES, Console


def parameters(answer):
    return {item.name: item.value for item in answer.params}


def test_parameters_are_read_and_set(console):
    label, name = "Operational Limits", "Hysteresis Threshold - Maximum Depth"
    for visibility, scope in (("developer", "global"), ("user", "global"), ("developer", "idle"), ("user", "plan")):
        query = imc.QueryEntityParameters(name=label, visibility=visibility, scope=scope)
        console.send(query)
        answers = [m for m in console.run(0.1) if isinstance(m, imc.EntityParameters)]
        expected = (visibility, scope) == ("developer", "global")
        assert [console.entity(m) for m in answers] == [label] * expected
    before = parameters(console.ask(imc.QueryEntityParameters(name=label), imc.EntityParameters))
    assert before[name] == "0.3"
    wishes = [(name, "0.5"), ("Nonsense", "1"), ("Minimum Depth to Check Altitude", "-1")]
    params = tuple(imc.EntityParameter(name=key, value=value) for key, value in wishes)
    accepted = console.ask(imc.SetEntityParameters(name=label, params=params), imc.EntityParameters)
    assert parameters(accepted) == {name: "0.5"}
    assert parameters(console.ask(imc.QueryEntityParameters(name=label), imc.EntityParameters)) == before | {
        name: "0.5"
    }


def test_every_parameter_that_a_console_edits_is_answered_by_its_entity(console):
    for task in console.vehicle.tasks:
        query = imc.QueryEntityParameters(name=task.entity.label, visibility="developer", scope="global")
        answer = console.ask(query, imc.EntityParameters)
        assert (console.entity(answer), answer.name) == (task.entity.label, task.entity.label)
        assert list(parameters(answer)) == sorted(task.parameter_set.declarations)
        console.run(0.2)  # a console does not ask for all at once


def test_parameters_have_types(console):
    kind = imc.QueryTypedEntityParameters
    answer = console.ask(kind(op=kind.Op.REQUEST, request_id=3, entity_name="Operational Limits"), kind)
    assert (answer.op, answer.request_id, answer.entity_name) == (kind.Op.REPLY, 3, "Operational Limits")
    depth = next(p for p in answer.parameters if p.name == "Hysteresis Threshold - Maximum Depth")
    assert (depth.units, depth.min_value) == ("m", -math.inf)  # as in DUNE


@pytest.mark.parametrize("profile", PROFILES)
def test_saved_parameters_are_there_after_a_restart(profile, tmp_path):
    label, name = "Operational Limits", "Initial Setting - Maximum Depth"
    first = Console(profile, tmp_path)
    first.run(1.0)
    wish = imc.EntityParameter(name=name, value="33")
    first.ask(imc.SetEntityParameters(name=label, params=(wish,)), imc.EntityParameters)
    first.send(imc.SaveEntityParameters(name=label))
    first.run(0.1)
    first.vehicle.close()
    second = Console(profile, tmp_path)
    found = second.ask(imc.QueryEntityParameters(name=label), imc.EntityParameters)
    limits = second.ask(imc.GetOperationalLimits(), imc.OperationalLimits)
    second.vehicle.close()
    assert float(parameters(found)[name]) == 33
    assert limits.max_depth == 33


@pytest.mark.heavy
def test_pushed_parameters_come_back(noptilus):
    label = next(
        task.entity.label
        for task in noptilus.vehicle.tasks
        if any(p.scope != "global" and p.type is not str for p in task.parameter_set.declarations.values())
    )
    task = noptilus.vehicle.task_by_label(label)
    chosen = next(p for p in task.parameter_set.declarations.values() if p.scope != "global")
    before = task.parameter_set.text(chosen)
    after = {"true": "false", "false": "true"}.get(before) or str(float(before) + 1)
    noptilus.send(imc.PushEntityParameters(name=label))
    wish = imc.EntityParameter(name=chosen.name, value=after)
    noptilus.ask(imc.SetEntityParameters(name=label, params=(wish,)), imc.EntityParameters)
    noptilus.send(imc.PopEntityParameters(name=label))
    noptilus.run(0.1)
    now = parameters(noptilus.ask(imc.QueryEntityParameters(name=label), imc.EntityParameters))
    assert now[chosen.name] == before
