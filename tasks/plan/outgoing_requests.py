"""Requests of plan tasks: commands to the supervisor, plans from the database, latest messages of the bus."""

from collections.abc import Iterable
from typing import TypeVar

import imc
from autonomy.plans import PlanError
from runtime import Script, Task
from runtime.bus import Bus, Subscription
from runtime.task import Inbox

M = TypeVar("M", bound=imc.Message)
Type = imc.PlanDB.Type
COMMAND_TIMEOUT = 2.5  # s for the supervisor
DATABASE_TIMEOUT = 1.0  # s


class OutgoingRequests:
    """Numbers the requests of a task, to match each with its answer."""

    def __init__(self, task: Task):
        self._task = task
        self._count = 0
        self._command = 0

    def command(self, command: imc.VehicleCommand.Command, **fields: object) -> None:
        """Send a command to the supervisor."""
        self._command = self._next()
        request = imc.VehicleCommand(command=command, request_id=self._command)
        self._task.publish(request.replace(**fields))

    def stop_without_supervisor(self, latest: imc.ControlLoops | None) -> None:
        """Stop the vehicle without its supervisor; `latest` has the newest scope of control."""
        loops, scope = imc.ControlLoops, latest.scope_ref if latest is not None else 0
        self._task.publish(imc.StopManeuver())
        self._task.publish(loops(enable=loops.Enable.DISABLE, mask=imc.CLoopsMask.ALL, scope_ref=scope + 1))
        self._task.publish(imc.Abort(dst=self._task.system))

    def is_from_entity(self, label: str, request: imc.Message) -> bool:
        """Whether a request comes from the entity with this label on board."""
        task = self._task
        return request.src == task.system and task.vehicle.entities.label(task.system, request.src_ent) == label

    async def wait_until_accepted(self, inbox: Inbox) -> None:
        """Wait for the answer to the last command. Raises PlanError if it is rejected or not answered."""
        task, deadline = self._task, self._task.now + COMMAND_TIMEOUT
        while True:
            try:
                answer = await inbox.next(max(0.0, deadline - task.now))
            except TimeoutError:
                raise PlanError("vehicle command timeout") from None
            if not isinstance(answer, imc.VehicleCommand) or answer.request_id != self._command:
                continue
            if not task.is_reply_to_me(answer):
                continue
            if answer.type == imc.VehicleCommand.Type.FAILURE:
                raise PlanError(answer.info)
            if answer.type == imc.VehicleCommand.Type.SUCCESS:
                return

    async def resolve_requested_plan(self, script: Script, request: imc.PlanControl) -> imc.PlanSpecification:
        """The plan or the one maneuver in a request, else the stored plan that it names. Raises PlanError."""
        if isinstance(request.arg, imc.PlanSpecification):
            return request.arg
        if request.arg is not None:
            name = type(request.arg).__name__
            quick = imc.PlanManeuver(maneuver_id=name, data=request.arg)
            return imc.PlanSpecification(plan_id=request.plan_id or name, start_man_id=name, maneuvers=(quick,))
        if not request.plan_id:
            raise PlanError("undefined plan id")
        return await self._stored(script, request.plan_id)

    async def _stored(self, script: Script, plan_id: str) -> imc.PlanSpecification:
        try:
            answer = await self.query_database(script, imc.PlanDB(op=imc.PlanDB.Op.GET, plan_id=plan_id))
        except TimeoutError:
            raise PlanError("failed loading from DB: no answer") from None
        if isinstance(answer.arg, imc.PlanSpecification):
            return answer.arg
        raise PlanError(answer.info if answer.info == "undefined plan" else f"failed loading from DB: {answer.info}")

    async def query_database(self, script: Script, request: imc.PlanDB) -> imc.PlanDB:
        """Send a request to the database of this vehicle; its answer. Raises TimeoutError."""
        task, number = self._task, self._next()
        task.publish(request.replace(request_id=number, dst=task.system))

        def ours(answer: imc.PlanDB) -> bool:
            matches = answer.request_id == number and answer.op == request.op
            return matches and answer.type in (Type.SUCCESS, Type.FAILURE) and task.is_reply_to_me(answer)

        return await script.receive(imc.PlanDB, where=ours, timeout=DATABASE_TIMEOUT)

    def _next(self) -> int:
        self._count = (self._count + 1) & 0xFFFF
        return self._count


class MessageCache(dict[type[imc.Message], imc.Message]):
    """The latest message of each type that is watched."""

    def of(self, kind: type[M]) -> M | None:
        """The latest of a type, None if there is none."""
        message = self.get(kind)
        return message if isinstance(message, kind) else None

    def subscribe(self, bus: Bus, kinds: Iterable[type[imc.Message]], owner: Task) -> None:
        """Forget everything and watch these types from now on."""
        for subscription in getattr(self, "_subscriptions", ()):
            bus.remove_subscription(subscription)
        self.clear()
        self._subscriptions = [Subscription(kind, self._keep, owner) for kind in sorted(kinds, key=lambda k: k.ID)]
        for subscription in self._subscriptions:
            bus.subscribe(subscription)

    def _keep(self, message: imc.Message) -> None:
        self[type(message)] = message
