"""The plans of a vehicle: its database, and the start, progress and end of one."""

import math
import time
from collections.abc import Callable
from contextlib import suppress
from dataclasses import dataclass, field, replace

import imc
from autonomy.plans import PlanEstimate
from shoal.network.link import NetworkError, NoAnswer, Refused
from shoal.network.network import GRACE, Network
from shoal.network.system_table import NetworkSystem
from support.terminal_text import suggestion

Op = imc.PlanControl.Op
Type = imc.PlanControl.Type
Phase = imc.PlanControlState.State
OVER = (Phase.READY, Phase.BLOCKED)
UNDEFINED = "undefined plan"  # DUNE has the same text
MOST_LATE = 4  # reports that come after an answer, since by another network, and are older
BATTERY_PATIENCE = 1.5  # s for a report of the battery, without which its charge is unknown
LAST_WORDS = 1.5  # s from the end of a plan to the reason, which is a message of its own


@dataclass(frozen=True)
class StoredPlan:
    """A plan in the vehicle's database; `changed` is in s since 1970 UTC, `by` the system that changed it."""

    name: str
    size: int
    changed: float
    by: str
    md5: str


@dataclass(frozen=True)
class PlanOutcome:
    """The end of a plan: whether it was completed, and the vehicle's words.

    `energy_used` is in % of a full battery; NaN if unknown.
    """

    plan: str
    completed: bool
    reason: str
    seconds: float
    estimate: PlanEstimate = field(default_factory=PlanEstimate)
    energy_used: float = math.nan


class AsyncRemotePlans:
    """The plans of one vehicle."""

    def __init__(self, network: Network, system: NetworkSystem) -> None:
        self._network = network
        self._system = system
        self._answered = -math.inf  # time stamp of the vehicle's last answer to a change that we asked for

    async def list(self) -> list[StoredPlan]:
        """All plans that are stored, by name. Raises Refused if they are too many to be listed at once."""
        state = await self._database(imc.PlanDB.Op.GET_STATE)
        if not isinstance(state, imc.PlanDBState):
            raise Refused(f"{self._system.name} sent no list of its plans")
        found = [info for info in state.plans_info if isinstance(info, imc.PlanDBInformation)]
        if len(found) < state.plan_count:
            raise Refused(f"{self._system.name} has {state.plan_count} plans, too many for one message")
        plans = [StoredPlan(i.plan_id, i.plan_size, i.change_time, i.change_sname, i.md5.hex()) for i in found]
        return sorted(plans, key=lambda plan: plan.name)

    async def get(self, name: str) -> imc.PlanSpecification:
        """A stored plan. Raises Refused if there is none of this name."""
        plan = await self._database(imc.PlanDB.Op.GET, name)
        if not isinstance(plan, imc.PlanSpecification):
            raise Refused(f"{self._system.name} sent no plan")
        return plan

    async def put(self, plan: imc.PlanSpecification) -> None:
        """Store a plan under its own name; one that is there is replaced. Raises EncodeError if it is too large."""
        await self._database(imc.PlanDB.Op.SET, plan.plan_id, plan)

    async def estimate(self, name: str) -> PlanEstimate:
        """The time and energy that a stored plan takes if it starts now; unknown while the vehicle carries out a plan.

        Raises NoAnswer.
        """
        if (await self.status()).state not in OVER:
            return await self._estimate()
        request = imc.PlanControl(op=Op.LOAD, plan_id=name, request_id=self._network.next_request_id())
        ask = self._network.request
        answer = await ask(self._system, request, (imc.PlanControl,), lambda message: self._answer(message, request))
        found = await self._estimate(answer.arg)
        return replace(found, rejected=answer.info) if answer.type == Type.FAILURE else found

    async def _estimate(self, statistics: imc.Message | None = None) -> PlanEstimate:
        """The estimate in a reply, beside the charge of the battery, if the vehicle reports it soon."""
        self._network.subscribe(self._system, (imc.FuelLevel,))
        fuel = self._system.latest_message(imc.FuelLevel)
        if fuel is None:
            with suppress(NoAnswer):
                fuel = await self._network.next_message(self._system, imc.FuelLevel, BATTERY_PATIENCE, takes_old=True)
        return PlanEstimate.from_statistics(statistics, fuel)

    async def delete(self, name: str) -> None:
        """Delete a stored plan. Raises Refused if there is none of this name."""
        await self._database(imc.PlanDB.Op.DEL, name)

    async def status(self, timeout: float | None = None) -> imc.PlanControlState:
        """The state of the plan engine: its last report, but none from before it answered a change of ours.

        A report of the very instant of the answer may still name the plan before.
        """
        self._network.check_is_there(self._system)
        last = self._system.latest_message(imc.PlanControlState)
        if last is not None and self._system.age < 1.0 and last.timestamp > self._answered:
            return last
        state = await self._network.next_message(self._system, imc.PlanControlState, timeout)
        for _ in range(MOST_LATE):
            if state.timestamp > self._answered:
                break
            state = await self._network.next_message(self._system, imc.PlanControlState, timeout)
        return state  # an old one only if its clock was set back

    async def start(
        self,
        plan: str | imc.PlanSpecification,
        *,
        wait: bool = True,
        calibrate: bool = False,
        ignore_errors: bool = False,
        progress: Callable[[imc.PlanControlState], object] | None = None,
        estimated: Callable[[PlanEstimate], object] | None = None,
    ) -> PlanOutcome | None:
        """Start a stored plan, or one that is sent with the request, which the vehicle stores once it has accepted it.

        Waits for the end, unless `wait` is False; `estimated` gets what the plan takes when it is accepted, `progress`
        each report until the end. Raises Refused if the vehicle does not start it.
        """
        flags = (imc.PlanControl.Flags.CALIBRATE if calibrate else 0) | (
            imc.PlanControl.Flags.IGNORE_ERRORS if ignore_errors else 0
        )
        is_name = isinstance(plan, str)
        name = plan if is_name else plan.plan_id
        request = imc.PlanControl(op=Op.START, plan_id=name, flags=flags, arg=None if is_name else plan)
        request = request.replace(request_id=self._network.next_request_id())
        network, system = self._network, self._system
        listener = network.listen(system, (imc.PlanControl, imc.PlanControlState))
        try:
            answer = await network.request(system, request, (imc.PlanControl,), lambda m: self._answer(m, request))
            if answer.type == Type.FAILURE:
                raise await self._refused(name, answer.info)
            began = time.monotonic()
            estimate = await self._estimate(answer.arg)
            if estimated is not None:
                estimated(estimate)
            if not wait:
                return None
            over, words, flown = 0.0, "", False
            while True:
                try:
                    _, message = await listener.next(GRACE)
                except TimeoutError:
                    network.check_is_there(system)
                    message = None
                if isinstance(message, imc.PlanControlState) and message.src == system.id:
                    flown = flown or message.state in (Phase.INITIALIZING, Phase.EXECUTING)
                    if flown and message.state in OVER:
                        # The reply with the reason may still come, or be lost: wait LAST_WORDS s for it.
                        over = over or time.monotonic()
                        done = message.last_outcome == imc.PlanControlState.LastOutcome.SUCCESS
                        failed = message.last_outcome == imc.PlanControlState.LastOutcome.FAILURE
                        if time.monotonic() - over > LAST_WORDS:
                            unknown = "plan has failed" if failed else "plan has ended, and its outcome did not arrive"
                            text = (words or "plan completed") if done else unknown
                            return self._outcome(name, done, text, began, estimate)
                    elif progress is not None:
                        progress(message)
                elif message is not None and (reply := self._answer(message, request)) is not None:
                    words = reply.info
                    if reply.type == Type.FAILURE or words.startswith("plan completed"):
                        return self._outcome(name, reply.type == Type.SUCCESS, words, began, estimate)
        finally:
            network.close_listener(listener)

    def _outcome(self, name: str, done: bool, reason: str, began: float, estimate: PlanEstimate) -> PlanOutcome:
        fuel = self._system.latest_message(imc.FuelLevel)
        used = math.nan if fuel is None else estimate.battery - fuel.value
        return PlanOutcome(name, done, reason, time.monotonic() - began, estimate, used)

    async def stop(self) -> None:
        """Stop the plan that is running. Raises Refused if none is."""
        request = imc.PlanControl(op=Op.STOP, request_id=self._network.next_request_id())
        ask = self._network.request
        answer = await ask(self._system, request, (imc.PlanControl,), lambda message: self._answer(message, request))
        if answer.type == Type.FAILURE:
            raise Refused(answer.info)

    def _answer(self, message: imc.Message, request: imc.PlanControl) -> imc.PlanControl | None:
        """A final reply to a request of ours."""
        if not isinstance(message, imc.PlanControl) or message.type not in (Type.SUCCESS, Type.FAILURE):
            return None
        ours = (message.dst, message.op, message.request_id, message.src)
        wanted = (self._network.console.id, request.op, request.request_id, self._system.id)
        if ours != wanted:
            return None
        self._answered = message.timestamp
        return message

    async def _database(
        self, op: imc.PlanDB.Op, name: str = "", plan: imc.PlanSpecification | None = None
    ) -> imc.Message | None:
        request = imc.PlanDB(op=op, plan_id=name, arg=plan, request_id=self._network.next_request_id())

        def answer(message: imc.Message) -> imc.PlanDB | None:
            if not isinstance(message, imc.PlanDB) or message.dst != self._network.console.id:
                return None
            ours = (message.op, message.request_id) == (request.op, request.request_id)
            return message if ours and message.type in (imc.PlanDB.Type.SUCCESS, imc.PlanDB.Type.FAILURE) else None

        reply = await self._network.request(self._system, request, (imc.PlanDB,), answer)
        if reply.type == imc.PlanDB.Type.FAILURE:
            raise await self._refused(name, reply.info)
        return reply.arg

    async def _refused(self, name: str, reason: str) -> Refused:
        """The vehicle's reason for rejecting a plan, and the plans that it has if it has none of this name."""
        hint = ""
        if reason == UNDEFINED:
            with suppress(NetworkError):
                hint = suggestion(name, [plan.name for plan in await self.list()])
            hint = f"; {hint or '`shoal plan VEHICLE list` lists what it has'}"
        return Refused(f"{name and f'{name}: '}{reason}{hint}")
