"""A vehicle begins by itself, once, and only where nobody else was quicker."""

from typing import Any

import pytest

import imc
from runtime import State
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


@pytest.mark.parametrize("state", [Phase.INITIALIZING, Phase.EXECUTING])
def test_it_leaves_the_plan_of_somebody_else_alone(state: Phase) -> None:
    done = run(
        (1.0, imc.VehicleState(op_mode=SERVICE)),
        (2.0, imc.PlanControlState(state=state)),
        (3.0, imc.PlanControlState(state=Phase.READY)),
    )
    assert done.of(imc.PlanGeneration) == []
    assert done.task.entity.description == "another plan was started"


def test_a_refusal_is_told() -> None:
    done = run(
        (1.0, imc.VehicleState(op_mode=SERVICE)),
        (2.0, imc.PlanControlState(state=Phase.READY)),
        (3.0, imc.PlanGeneration(op=imc.PlanGeneration.Op.ERROR, plan_id="sk", params="error=position is unknown")),
    )
    assert done.task.entity.state is State.NORMAL  # the answer is not for this task

    own = done.task.entity.id
    answer = imc.PlanGeneration(
        op=imc.PlanGeneration.Op.ERROR, plan_id="sk", params="error=none", dst=done.vehicle.system, dst_ent=own
    )
    done = run((1.0, imc.VehicleState(op_mode=SERVICE)), (2.0, imc.PlanControlState(state=Phase.READY)), (3.0, answer))
    assert (done.task.entity.state, done.task.entity.description) == (State.FAULT, "sk: error=none")
