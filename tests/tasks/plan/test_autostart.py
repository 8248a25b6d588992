"""Autostart runs a plan once, and only if nothing else was started before."""

import re
from typing import Any

import pytest

import imc
from autonomy.plans import TEMPLATES
from runtime import ParameterError, State, consume
from runtime.testing import Run, simulate
from tasks.plan.autostart import Autostart

Phase = imc.PlanControlState.State
SERVICE, BOOT = imc.VehicleState.OpMode.SERVICE, imc.VehicleState.OpMode.BOOT


def run(*states: tuple[float, imc.Message], **values: Any) -> Run:
    return simulate(Autostart, feed=[m.replace(timestamp=t, src_ent=7) for t, m in states], seconds=10.0, **values)


def test_it_asks_once_when_the_vehicle_is_ready() -> None:
    ready = imc.PlanControlState(state=Phase.READY)
    done = run(
        (1.0, imc.PlanControlState(state=Phase.BLOCKED)),
        (2.0, ready),
        (3.0, imc.VehicleState(op_mode=BOOT)),
        (4.0, ready),
        (5.0, imc.VehicleState(op_mode=SERVICE)),
        (6.0, ready),
        (7.0, ready),
        template="dive",
        values=["depth=2", "radius=15"],
    )
    (request,) = done.of(imc.PlanGeneration)
    assert (request.plan_id, request.params, request.op) == ("dive", "depth=2;radius=15", imc.PlanGeneration.Op.REQUEST)
    assert request.cmd == imc.PlanGeneration.Cmd.EXECUTE
    assert request.timestamp == pytest.approx(done.vehicle.start_time + 6.0)
    assert request.dst == done.vehicle.system


class Restarting(Autostart):
    """Restarts once it has asked, as a task does that fails then."""

    @consume
    def begin(self, plan: imc.PlanControlState) -> None:
        super().start_when_ready(plan)
        self.start()


def test_it_does_not_ask_again_after_a_restart() -> None:
    times = (1.0, 3.0, 5.0)
    calm = [imc.VehicleState(op_mode=SERVICE, timestamp=t, src_ent=7) for t in times]
    ready = [imc.PlanControlState(state=Phase.READY, timestamp=t + 1.0, src_ent=7) for t in times]
    done = simulate(Restarting, feed=[*calm, *ready], seconds=10.0)
    assert len(done.of(imc.PlanGeneration)) == 1


@pytest.mark.parametrize("state", [Phase.INITIALIZING, Phase.EXECUTING])
def test_it_leaves_the_plan_of_somebody_else_alone(state: Phase) -> None:
    done = run(
        (1.0, imc.VehicleState(op_mode=SERVICE)),
        (2.0, imc.PlanControlState(state=state)),
        (3.0, imc.PlanControlState(state=Phase.READY)),
    )
    assert done.of(imc.PlanGeneration) == []
    assert done.task.entity.description == "another plan was started"


def test_a_refusal_is_reported() -> None:
    done = run(
        (1.0, imc.VehicleState(op_mode=SERVICE)),
        (2.0, imc.PlanControlState(state=Phase.READY)),
        (3.0, imc.PlanGeneration(op=imc.PlanGeneration.Op.ERROR, plan_id="sk", params="error=position is unknown")),
    )
    assert done.task.entity.state is State.NORMAL  # a reply to another task

    own = done.task.entity.id
    answer = imc.PlanGeneration(
        op=imc.PlanGeneration.Op.ERROR, plan_id="sk", params="error=none", dst=done.vehicle.system, dst_ent=own
    )
    done = run((1.0, imc.VehicleState(op_mode=SERVICE)), (2.0, imc.PlanControlState(state=Phase.READY)), (3.0, answer))
    assert (done.task.entity.state, done.task.entity.description) == (State.FAULT, "sk: error=none")


@pytest.mark.parametrize(
    ("values", "words"),
    [
        ({"template": "dyve"}, "Template: unknown template 'dyve'; did you mean 'dive'?"),
        ({"template": "circles"}, "known: go, sk, come_near, loiter, dive, surface, dislodge, flight"),
        ({"template": "dive", "values": ["radius=15", "depth=abc"]}, "Values: depth is not a number"),
        ({"template": "go", "values": ["lat=100"]}, "Values: lat and lon are not a position in degrees"),
    ],
)
def test_what_makes_no_plan_is_refused_at_once(values: dict[str, Any], words: str) -> None:
    with pytest.raises(ParameterError, match=re.escape(words)):
        run(**values)


@pytest.mark.parametrize("template", TEMPLATES)
def test_each_template_is_known(template: str) -> None:
    assert run(template=template).task.template == template
