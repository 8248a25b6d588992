"""Starts a plan without an operator."""

import imc
from autonomy.plans import TEMPLATES, TemplateDefaults, TemplateError, plan_from_template
from imc.tuple_list import parse_tuple_list
from runtime import ParameterError, State, Task, consume, param
from support.terminal_text import quoted, suggestion

Op = imc.PlanGeneration.Op
Phase = imc.PlanControlState.State
CALM = imc.VehicleState.OpMode.SERVICE
SOMEWHERE = (0.0, 0.0)
USUAL = TemplateDefaults(travel_depth=1.0, dive_depth=1.0, dive_seconds=1, radius=1.0, rpm=1.0)


class Autostart(Task):
    """Starts the plan of a template once, as soon as the vehicle is ready, unless another plan was started first."""

    template: str = param("sk", "", "Template of Plan.Generator.")
    values: list[str] = param([], "", "Parameters of the template, such as depth=2, radius=15; lat and lon in degrees.")

    def configure(self) -> None:
        if self.template not in TEMPLATES:
            reason = f"unknown template {quoted(self.template)}; {suggestion(self.template, TEMPLATES)}"
            raise ParameterError("Template", reason)
        try:
            plan_from_template(self.template, parse_tuple_list(";".join(self.values)), SOMEWHERE, SOMEWHERE, USUAL)
        except TemplateError as error:
            raise ParameterError("Values", str(error)) from None

    def start(self) -> None:
        self._calm = False
        self._asked = getattr(self, "_asked", False)
        self.set_entity_state(State.NORMAL, "restarted" if self._asked else "waiting for the vehicle")

    @consume
    def on_vehicle_state(self, vehicle: imc.VehicleState) -> None:
        self._calm = vehicle.op_mode == CALM

    @consume
    def start_when_ready(self, plan: imc.PlanControlState) -> None:
        if self._asked or plan.state == Phase.BLOCKED or (plan.state == Phase.READY and not self._calm):
            return
        self._asked = True
        if plan.state != Phase.READY:
            self.set_entity_state(State.NORMAL, "another plan was started")
            return
        self.publish(
            imc.PlanGeneration(
                cmd=imc.PlanGeneration.Cmd.EXECUTE,
                plan_id=self.template,
                params=";".join(self.values),
                dst=self.system,
            )
        )

    @consume
    def report_generation_result(self, answer: imc.PlanGeneration) -> None:
        if not self.is_reply_to_me(answer) or answer.op == Op.REQUEST:
            return
        if answer.op == Op.SUCCESS:
            self.set_entity_state(State.NORMAL, f"requested {answer.plan_id}")
        else:
            self.set_entity_state(State.FAULT, f"{answer.plan_id}: {answer.params}")
