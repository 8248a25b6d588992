"""Requests of MAVLink to the plan engine and the plan database; each gets one answer."""

from collections.abc import Callable
from typing import NamedTuple

import imc
from mavlink.vehicle.interfaces import VehiclePort

PATIENCE = 3.0  # s for an answer


class PlanReply(NamedTuple):
    """Whether a request was carried out, why not, and what came with the answer."""

    done: bool
    reason: str = ""
    arg: imc.Message | None = None


OnReply = Callable[[PlanReply], object]


class _Asked(NamedTuple):
    until: float
    then: OnReply


class PlanClient:
    """Requests to the vehicle at a port."""

    def __init__(self, port: VehiclePort) -> None:
        self._port = port
        self._number = 0
        self._asked: dict[int, _Asked] = {}
        self.started: imc.PlanSpecification | None = None

    def start(self, plan: imc.PlanSpecification, then: OnReply, now: float) -> None:
        """Start a plan, which also goes to the plan database; the last one that the vehicle accepts is `started`."""

        def note(outcome: PlanReply) -> None:
            self.started = plan if outcome.done else self.started
            then(outcome)

        self._control(imc.PlanControl.Op.START, plan.plan_id, plan, note, now)

    def load(self, plan_id: str, then: OnReply, now: float) -> None:
        """Request a check of a plan of the database, without starting it."""
        self._control(imc.PlanControl.Op.LOAD, plan_id, None, then, now)

    def stop(self, now: float, then: OnReply = lambda _: None) -> None:
        """Stop the plan that is executed."""
        self._control(imc.PlanControl.Op.STOP, "", None, then, now)

    def store(self, plan: imc.PlanSpecification, then: OnReply, now: float) -> None:
        """Put a plan into the database."""
        kind = imc.PlanDB
        self._ask(kind(type=kind.Type.REQUEST, op=kind.Op.SET, plan_id=plan.plan_id, arg=plan), then, now)

    def remove(self, plan_id: str, then: OnReply, now: float) -> None:
        """Delete a plan from the database."""
        kind = imc.PlanDB
        self._ask(kind(type=kind.Type.REQUEST, op=kind.Op.DEL, plan_id=plan_id), then, now)

    def fetch(self, plan_id: str, then: OnReply, now: float) -> None:
        """Get a plan from the database, as `arg` of the outcome."""
        kind = imc.PlanDB
        self._ask(kind(type=kind.Type.REQUEST, op=kind.Op.GET, plan_id=plan_id), then, now)

    def receive(self, reply: imc.PlanControl | imc.PlanDB) -> None:
        """Take a reply that is addressed to us."""
        kind = imc.PlanControl.Type  # PlanDB numbers its types in the same way
        if reply.type in (kind.REQUEST, kind.IN_PROGRESS):
            return
        asked = self._asked.pop(reply.request_id, None)
        if asked is not None:
            done = reply.type == kind.SUCCESS
            asked.then(PlanReply(done, "" if done else reply.info or "the vehicle refuses", reply.arg))

    def tick(self, now: float) -> None:
        """End unanswered requests."""
        for number, asked in list(self._asked.items()):
            if now >= asked.until and self._asked.pop(number, None) is not None:
                asked.then(PlanReply(False, "the vehicle does not answer"))

    @property
    def next_deadline(self) -> float | None:
        """Time at which the next request has been waiting too long, in s since 1970."""
        return min((asked.until for asked in self._asked.values()), default=None)

    def _control(self, op: int, plan_id: str, plan: imc.PlanSpecification | None, then: OnReply, now: float) -> None:
        self._ask(imc.PlanControl(type=imc.PlanControl.Type.REQUEST, op=op, plan_id=plan_id, arg=plan), then, now)

    def _ask(self, request: imc.PlanControl | imc.PlanDB, then: OnReply, now: float) -> None:
        self._number = self._number % 0xFFFF + 1
        self._asked[self._number] = _Asked(now + PATIENCE, then)
        self._port.publish(request.replace(dst=self._port.imc_id, request_id=self._number))
