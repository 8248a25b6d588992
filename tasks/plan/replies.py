"""What the plan engine answers to who asks."""

import imc
from runtime import Task

Type = imc.PlanControl.Type


class Replies:
    """Answers PlanControl requests, each with its own number, operation and flags, in the name of a task."""

    def __init__(self, task: Task):
        self._task = task

    def succeed(self, request: imc.PlanControl, info: str, arg: imc.Message | None = None, plan_id: str = "") -> None:
        """SUCCESS; `plan_id` is that of the request where it is empty."""
        self._answer(request, Type.SUCCESS, info, arg, plan_id)

    def fail(self, request: imc.PlanControl, info: str, arg: imc.Message | None = None) -> None:
        """FAILURE of what had begun."""
        self._task.log.error(info)
        self._answer(request, Type.FAILURE, info, arg)

    def refuse(self, request: imc.PlanControl, info: str) -> None:
        """FAILURE at once; the log says whose request it was."""
        self._task.log.error(f"{self._task.vehicle.systems.name(request.src)}: {info}")
        self._answer(request, Type.FAILURE, info)

    def _answer(
        self, request: imc.PlanControl, kind: Type, info: str, arg: imc.Message | None = None, plan_id: str = ""
    ) -> None:
        answer = imc.PlanControl(
            type=kind,
            op=request.op,
            request_id=request.request_id,
            plan_id=plan_id or request.plan_id,
            flags=request.flags,
            arg=arg,
            info=info,
        )
        self._task.reply(request, answer)
