"""Replies of the plan engine to PlanControl requests."""

import imc
from imc.reserved_ids import UNKNOWN_SYSTEM
from runtime import Task
from support.log_limit import LogLimit
from support.token_bucket import TokenBuckets
from tasks.plan.duplicate_requests import DuplicateRequests

Op = imc.PlanControl.Op
Type = imc.PlanControl.Type
LONGEST = 1023  # bytes of a text in a reply
STARTS, AT_ONCE = 2.0, 10.0  # plans that one system may have checked: per second, at once; a long one takes 40 ms
MOST_SYSTEMS = 64


class Replies:
    """Answers PlanControl requests for a task; a reply has the number, operation and flags of its request.

    An `arg` that cannot be encoded is dropped. A copy of a request is not carried out, but gets the last answer again.
    """

    def __init__(self, task: Task):
        self._task = task
        self._copies = DuplicateRequests(task.system)
        self._refusals = LogLimit("more requests are rejected")
        self._starts = TokenBuckets(STARTS, AT_ONCE, MOST_SYSTEMS)

    def admits(self, request: imc.PlanControl) -> bool:
        """Whether to look at a request; one that would check more plans than a system may is rejected here."""
        if request.op not in (Op.START, Op.LOAD) or request.src in (self._task.system, UNKNOWN_SYSTEM):
            return True
        if self._starts[request.src].try_acquire(self._task.now):
            return True
        self.refuse(request, f"too many requests: {STARTS:g} plans per second are checked for each system")
        return False

    def answer_duplicate(self, request: imc.PlanControl) -> bool:
        """Whether a request came before; if it is, it is answered here."""
        if not self._copies.is_duplicate(request):
            return False
        answer = self._copies.last_answer(request)
        if answer is not None:
            self._task.reply(request, answer)
        return True

    def succeed(self, request: imc.PlanControl, info: str, arg: imc.Message | None = None, plan_id: str = "") -> None:
        """SUCCESS; an empty `plan_id` is replaced by that of the request."""
        self._answer(request, Type.SUCCESS, info, arg, plan_id)

    def fail(self, request: imc.PlanControl, info: str, arg: imc.Message | None = None) -> None:
        """FAILURE of a plan that had started."""
        self._answer(request, Type.FAILURE, info, arg)

    def refuse(self, request: imc.PlanControl, info: str) -> None:
        """FAILURE of the request; the log book names its sender."""
        text = f"{self._task.vehicle.systems.name(request.src)}: {info}"
        self._refusals.write(self._task.log.error, text, self._task.now)
        self._answer(request, Type.FAILURE, info)

    def _answer(
        self, request: imc.PlanControl, kind: Type, info: str, arg: imc.Message | None = None, plan_id: str = ""
    ) -> None:
        answer = imc.PlanControl(
            type=kind,
            op=request.op,
            request_id=request.request_id,
            plan_id=truncate_reply(plan_id or request.plan_id),
            flags=request.flags,
            arg=arg,
            info=truncate_reply(info),
        )
        try:
            self._task.reply(request, answer)
        except imc.EncodeError:
            answer = answer.replace(arg=None)
            self._task.reply(request, answer)
        self._copies.remember_answer(request, answer)


def truncate_reply(text: str) -> str:
    """A text cut to the 1023 bytes that a reply may have."""
    return text.encode(errors="surrogateescape")[:LONGEST].decode(errors="surrogateescape")
