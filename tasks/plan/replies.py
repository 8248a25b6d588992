"""What the plan engine answers to who asks."""

import imc
from runtime import Task

Type = imc.PlanControl.Type
LONGEST = 1023  # bytes of a text of an answer


class Replies:
    """Answers PlanControl requests, each with its own number, operation and flags, in the name of a task.

    An `arg` that no message can carry is left out.
    """

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
            plan_id=shortened(plan_id or request.plan_id),
            flags=request.flags,
            arg=arg,
            info=shortened(info),
        )
        try:
            self._task.reply(request, answer)
        except imc.EncodeError:
            self._task.reply(request, answer.replace(arg=None))


def shortened(text: str) -> str:
    """What an answer has of a text, which may be as long as a message: 1023 bytes at most."""
    return text.encode(errors="surrogateescape")[:LONGEST].decode(errors="surrogateescape")
