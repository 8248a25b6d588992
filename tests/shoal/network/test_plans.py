"""What the plan engine does, told by reports that overtake answers."""

import asyncio
import math
from types import SimpleNamespace
from typing import Any

import imc
from shoal.network import NoAnswer, PlanEstimate, PlanOutcome
from shoal.network.plans import MOST_LATE, AsyncRemotePlans

ID, CONSOLE = 0x001A, 0x4101


class Told:
    """A network that has these reports to come, and answers each request at a time (s)."""

    def __init__(self, answered: float, *reports: imc.PlanControlState) -> None:
        self.console, self.reports, self.answered = SimpleNamespace(id=CONSOLE), list(reports), answered

    def check_is_there(self, _: object) -> None: ...

    def next_request_id(self) -> int:
        return 7

    async def request(self, _: object, request: imc.PlanControl, __: object, answer: Any) -> Any:
        kind = imc.PlanControl.Type.SUCCESS
        return answer(request.replace(type=kind, src=ID, dst=CONSOLE, timestamp=self.answered))

    async def next_message(self, *_: object) -> imc.PlanControlState:
        return self.reports.pop(0)


def report(plan: str, timestamp: float) -> imc.PlanControlState:
    return imc.PlanControlState(plan_id=plan, timestamp=timestamp, src=ID)


def stopped(last: imc.PlanControlState, *reports: imc.PlanControlState, answered: float = 5.0) -> imc.PlanControlState:
    """The status after a stop that was answered at a time (s)."""
    plans = AsyncRemotePlans(Told(answered, *reports), SimpleNamespace(id=ID, age=0.1, latest_message=lambda _: last))

    async def act() -> imc.PlanControlState:
        await plans.stop()
        return await plans.status()

    return asyncio.run(act())


def test_a_report_from_before_the_answer_is_no_status() -> None:
    late, fresh = report("before", 4.9), report("after", 5.1)
    assert stopped(late, late, late, fresh) is fresh
    assert stopped(fresh) is fresh, "it need not wait for another one"


def test_a_report_of_the_instant_of_the_answer_is_no_status() -> None:
    """A vehicle that begins a plan tells so before it knows its name, and answers in the same instant."""
    same, fresh = report("before", 5.0), report("after", 5.1)
    assert stopped(same, same, fresh) is fresh


def test_a_clock_that_was_set_back_does_not_keep_the_status_waiting() -> None:
    old = [report("now", 1.0 + n) for n in range(MOST_LATE + 1)]
    assert stopped(report("before", 0.5), *old, answered=1e9) is old[-1]


class WithoutBattery(Told):
    """A vehicle that reports no battery, and whose plan ends while somebody waits for that."""

    def subscribe(self, *_: object) -> None: ...

    def listen(self, *_: object) -> "WithoutBattery":
        return self

    def close_listener(self, _: object) -> None: ...

    async def next_message(self, *_: object, **__: object) -> imc.PlanControlState:
        await asyncio.sleep(0.3)
        raise NoAnswer("no FuelLevel")

    async def next(self, _: float) -> tuple[object, imc.PlanControl]:
        op, kind = imc.PlanControl.Op.START, imc.PlanControl.Type.SUCCESS
        return None, imc.PlanControl(op=op, type=kind, request_id=7, src=ID, dst=CONSOLE, info="plan completed")


def test_the_time_of_a_plan_begins_when_it_is_accepted() -> None:
    """Not when the charge of the battery is known."""
    system = SimpleNamespace(id=ID, age=0.1, latest_message=lambda _: None)
    outcome = asyncio.run(AsyncRemotePlans(WithoutBattery(5.0), system).start("dive"))
    assert isinstance(outcome, PlanOutcome)
    assert (outcome.plan, outcome.completed, outcome.reason) == ("dive", True, "plan completed")
    assert outcome.seconds >= 0.3


def test_an_estimate_names_what_is_unknown() -> None:
    assert (
        PlanEstimate(61.2, 3.0, 80.0).describe() == "estimated time 61 s, energy 3.0 % of the battery, which has 80.0 %"
    )
    assert PlanEstimate().describe() == "time and energy unknown, charge of the battery unknown"
    text = "estimated time 5 s, energy unknown, charge of the battery 80.0 %"
    assert PlanEstimate(5.0, math.nan, 80.0).describe() == text
