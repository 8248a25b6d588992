"""Copies of requests, as a console sends them that got no answer."""

from flying import CCU, OWN, fly, goto, plan_of, replies

import imc
from runtime import Task, periodic
from runtime.testing import START
from tasks.plan.duplicate_requests import MOST, DuplicateRequests

PLAN = plan_of(goto(20, 0))
DELETE = imc.PlanDB(op=imc.PlanDB.Op.DEL, plan_id="test", src=CCU, dst=OWN, request_id=8, timestamp=START + 3.5)
BEGIN = imc.PlanControl(
    op=imc.PlanControl.Op.START, plan_id="test", arg=PLAN, src=CCU, dst=OWN, request_id=7, timestamp=START + 2.5
)


class Radio(Task):
    """Brings the same two packets five times a second."""

    @periodic(0.2)
    def bring(self) -> None:
        if self.now > START + 4.0:
            self.relay(imc.encode(BEGIN))
        if self.now > START + 5.0:  # the plan is stored by now
            self.relay(imc.encode(DELETE))


def test_a_copy_gets_the_same_answer_and_changes_nothing():
    run = fly(more=(Radio,), seconds=60)
    assert len([m for m in run.of(imc.VehicleCommand) if m.type == 0 and m.maneuver is not None]) == 1
    infos = replies(run)
    assert infos.count(("SUCCESS", "plan completed")) > 5
    assert not [info for kind, info in infos if kind == "FAILURE"]
    deleted = [m.info for m in run.of(imc.PlanDB) if m.op == imc.PlanDB.Op.DEL and m.type == imc.PlanDB.Type.SUCCESS]
    assert len(deleted) > 5
    assert set(deleted) == {"OK"}
    stored = [m.info for m in run.of(imc.PlanDB) if m.op == imc.PlanDB.Op.SET and m.type == imc.PlanDB.Type.SUCCESS]
    assert stored == ["OK (new entry)"]


def test_only_so_many_are_remembered():
    copies = DuplicateRequests(OWN)
    requests = [BEGIN.replace(request_id=number) for number in range(MOST + 1)]
    assert [copies.is_duplicate(request) for request in requests] == [False] * (MOST + 1)
    assert not copies.is_duplicate(requests[0])
    assert copies.is_duplicate(requests[-1])
    assert copies.last_answer(requests[-1]) is None
    copies.remember_answer(requests[-1], PLAN)
    assert copies.last_answer(requests[-1]) == PLAN


def test_what_has_no_time_or_is_our_own_is_never_a_copy():
    copies = DuplicateRequests(OWN)
    for request in (BEGIN.replace(timestamp=0.0), BEGIN.replace(src=OWN)):
        assert not copies.is_duplicate(request)
        assert not copies.is_duplicate(request)


class Flood(Task):
    """Asks for a start of an unknown plan 45 times a second, each time with another number."""

    def start(self):
        self.count = 0

    @periodic(45.0)
    def ask(self):
        self.count += 1
        request = BEGIN.replace(plan_id="none", arg=None, request_id=self.count, timestamp=self.now)
        self.relay(imc.encode(request))


def test_a_console_that_starts_plans_without_end_is_refused_and_others_are_not():
    other = imc.PlanControl(
        op=imc.PlanControl.Op.START,
        plan_id="test",
        arg=PLAN,
        src=CCU + 1,
        dst=OWN,
        request_id=7,
        timestamp=START + 20.0,
    )
    run = fly(other, more=(Flood,), seconds=30)
    infos = [m.info for m in run.of(imc.PlanControl) if m.dst == CCU]
    assert sum(info.startswith("too many requests") for info in infos) > 1000
    assert len([line for line in run.log if "too many requests" in line or "0x4000" in line]) < 150
    assert [m for m in run.of(imc.PlanControl) if m.dst == CCU + 1 and m.type == m.Type.SUCCESS]
