"""The plan database: digests as consoles compute them, and the documented reply to each mistake."""

import sqlite3
from hashlib import md5

import pytest
from flying import CCU, OWN, goto, plan_of, recorded

import imc
from runtime import State
from runtime.kernel import WallClock
from runtime.testing import simulate
from tasks.plan.db import DB
from tasks.plan.store import PlanChange, PlanStore, serialize_fields

Op = imc.PlanDB.Op
Type = imc.PlanDB.Type
A, B = plan_of(goto(1, 0), name="a"), plan_of(goto(2, 0), goto(3, 0), name="b")


def ask(op, plan_id="", arg=None, at=1.0, **fields):
    fields = {"src": CCU, "src_ent": 3, "dst": OWN, "request_id": 77, **fields}
    return imc.PlanDB(timestamp=at, op=op, plan_id=plan_id, arg=arg, **fields)


def served(*requests, **options):
    """The replies to requests, without progress reports."""
    run = simulate(DB, requests, seconds=20, **options)
    return [m for m in run.of(imc.PlanDB) if m.op != Op.BOOT and m.type != Type.IN_PROGRESS]


def told(replies):
    return [(Type(m.type).name, m.info) for m in replies]


def test_set_tells_the_digest_of_the_fields():
    plan = recorded()
    run = simulate(DB, [ask(Op.SET, plan.plan_id, plan)], seconds=3)
    progress, reply = [m for m in run.of(imc.PlanDB) if m.op == Op.SET]
    assert (progress.type, progress.info, progress.arg) == (Type.IN_PROGRESS, "in progress", None)
    assert (reply.type, reply.info) == (Type.SUCCESS, "OK (new entry)")
    assert {(m.dst, m.dst_ent, m.request_id, m.plan_id) for m in (progress, reply)} == {(CCU, 3, 77, plan.plan_id)}
    payload = imc.encode(plan)[20:-2]
    info = reply.arg
    assert (info.md5, info.plan_size) == (md5(payload).digest(), len(payload))
    assert (info.change_sid, info.change_sname, info.change_time) == (CCU, "0x4000", reply.timestamp)


def test_what_was_set_comes_back_to_the_byte():
    plan = recorded()
    _, got, info = served(ask(Op.SET, plan.plan_id, plan), ask(Op.GET, plan.plan_id), ask(Op.GET_INFO, plan.plan_id))
    assert serialize_fields(got.arg) == serialize_fields(plan)
    assert info.arg.md5 == md5(serialize_fields(plan)).digest()


@pytest.mark.parametrize("op", [Op.GET_STATE, Op.GET_DSTATE])
def test_the_state_has_the_digest_of_all_digests(op):
    *_, reply = served(ask(Op.SET, "b", B), ask(Op.SET, "a", A, at=2.0), ask(op, at=3.0))
    state = reply.arg
    assert (reply.op, state.plan_count, state.plan_size) == (op, 2, len(serialize_fields(A)) + len(serialize_fields(B)))
    assert [info.plan_id for info in state.plans_info] == ["a", "b"]
    assert state.md5 == md5(b"".join(md5(serialize_fields(plan)).digest() for plan in (A, B))).digest()
    assert state.change_time == pytest.approx(1_767_225_602.0)


def test_the_state_of_nothing():
    (reply,) = served(ask(Op.GET_STATE))
    assert (reply.arg.plan_count, reply.arg.plans_info, reply.arg.md5) == (0, (), md5(b"").digest())


@pytest.mark.parametrize(
    ("request_", "reason"),
    [
        (ask(Op.SET, "", A), "undefined plan id"),
        (ask(Op.SET, "a"), "no plan specification given"),
        (ask(Op.SET, "a", imc.Goto()), "no plan specification given"),
        (ask(Op.SET, "a", B), "plan id mismatch"),
        (ask(Op.GET, "x"), "undefined plan"),
        (ask(Op.GET_INFO, "x"), "undefined plan"),
        (ask(Op.GET, ""), "undefined plan"),
        (ask(Op.DEL, "x"), "undefined plan"),
        (ask(99, "a"), "no such operation: 99"),
    ],
)
def test_mistakes_change_nothing(request_, reason):
    replies = served(ask(Op.SET, "a", A), request_, ask(Op.GET_STATE))
    assert told(replies)[1:] == [("FAILURE", reason), ("SUCCESS", "OK")]
    assert (replies[1].request_id, replies[1].dst, replies[1].arg) == (77, CCU, None)
    assert replies[2].arg.md5 == md5(md5(serialize_fields(A)).digest()).digest()


def test_a_second_set_updates_and_the_same_request_twice_is_harmless():
    newer = plan_of(goto(9, 9), name="a")
    replies = served(ask(Op.SET, "a", A), ask(Op.SET, "a", newer), ask(Op.SET, "a", newer), ask(Op.GET_STATE))
    assert [info for _, info in told(replies)] == ["OK (new entry)", "OK (updated)", "OK (updated)", "OK"]
    assert replies[-1].arg.plan_count == 1


def test_delete_and_clear():
    replies = served(
        ask(Op.SET, "a", A),
        ask(Op.SET, "b", B),
        ask(Op.DEL, "a"),
        ask(Op.GET, "a"),
        ask(Op.CLEAR, "b"),
        ask(Op.GET_STATE),
    )
    assert told(replies)[2:] == [("SUCCESS", "OK"), ("FAILURE", "undefined plan"), ("SUCCESS", "OK"), ("SUCCESS", "OK")]
    assert replies[4].plan_id == ""
    assert replies[5].arg.plan_count == 0


def test_what_is_for_others_and_replies_are_ignored():
    assert served(ask(Op.GET_STATE, dst=0x001B), ask(Op.GET_STATE, type=Type.SUCCESS)) == []


def test_a_request_of_another_vehicle_for_all_is_its_own_and_one_of_a_console_is_served():
    (reply,) = served(ask(Op.SET, "a", A, src=0x2201, dst=0xFFFF), ask(Op.GET_STATE, dst=0xFFFF))
    assert reply.arg.plan_count == 0


def answered(request, kind=imc.PlanControl.Type.SUCCESS):
    """A request, and the answer of the plan engine to it."""
    return request, request.replace(timestamp=1.1, type=kind, src=OWN, dst=CCU, arg=None)


def test_a_plan_that_is_started_with_its_specification_is_kept():
    start = imc.PlanControl(timestamp=1.0, src=CCU, dst=OWN, plan_id="a", arg=A, request_id=4)
    other = start.replace(plan_id="z", request_id=5)
    unchecked = start.replace(plan_id="b", arg=B, request_id=6)
    failed = answered(start.replace(plan_id="b", arg=B, request_id=7), imc.PlanControl.Type.FAILURE)
    kept, state = served(*answered(start), *answered(other), unchecked, *failed, ask(Op.GET_STATE, at=2.0))
    assert (kept.op, kept.type, kept.dst, kept.plan_id) == (Op.SET, Type.SUCCESS, 0xFFFF, "a")
    assert [info.plan_id for info in state.arg.plans_info] == ["a"]


def test_a_request_without_answer_is_not_stored_by_the_answer_to_another_one_of_its_number():
    start = imc.PlanControl(timestamp=1.0, src=CCU, dst=OWN, plan_id="a", arg=A, request_id=4)
    by_name = answered(start.replace(timestamp=1.05, plan_id="b", arg=None))
    (state,) = served(start, *by_name, ask(Op.GET_STATE, at=2.0))
    assert state.arg.plan_count == 0


def test_a_plan_that_is_started_and_cannot_be_kept_is_reported_and_harms_nothing():
    class Full(DB):
        """A database without space for plans."""

        def start(self) -> None:
            super().start()
            self._store.close()

    start = imc.PlanControl(timestamp=1.0, src=CCU, dst=OWN, plan_id="a", arg=A)
    run = simulate(Full, answered(start), seconds=3)
    kept = run.of(imc.PlanDB)[-1]
    assert (kept.op, kept.type, kept.dst, kept.plan_id) == (Op.SET, Type.FAILURE, 0xFFFF, "a")
    assert kept.info.startswith("database: ")
    assert run.log[-1] == f"{kept.info}: 'a'"
    assert run.task.entity.state is State.NORMAL


def test_too_many_plans_for_a_message_are_counted():
    sets = [ask(Op.SET, f"{i:0200d}", imc.PlanSpecification(plan_id=f"{i:0200d}")) for i in range(300)]
    *_, reply = served(*sets, ask(Op.GET_STATE, at=2.0))
    assert (reply.arg.plan_count, reply.arg.plans_info) == (300, ())


def test_a_full_database_refuses_new_plans_and_takes_changes(monkeypatch):
    monkeypatch.setattr("tasks.plan.store.MOST_PLANS", 2)
    longer = plan_of(goto(1, 0), goto(2, 0), goto(3, 0), name="b")
    sets = [ask(Op.SET, "a", A), ask(Op.SET, "b", B), ask(Op.SET, "c", plan_of(goto(1, 0), name="c"))]
    replies = served(*sets, ask(Op.SET, "b", longer), ask(Op.DEL, "a"), ask(Op.SET, "c", plan_of(name="c"), at=2.0))
    assert told(replies)[2:] == [
        ("FAILURE", "2 plans are stored, which is the limit: delete some"),
        ("SUCCESS", "OK (updated)"),
        ("SUCCESS", "OK"),
        ("SUCCESS", "OK (new entry)"),
    ]


def test_all_plans_together_have_a_limit(monkeypatch):
    monkeypatch.setattr("tasks.plan.store.MOST_BYTES", len(serialize_fields(B)) + 10)
    replies = served(ask(Op.SET, "b", B), ask(Op.SET, "a", A), ask(Op.SET, "b", B, at=2.0))
    assert [kind for kind, _ in told(replies)] == ["SUCCESS", "FAILURE", "SUCCESS"]
    assert "all plans together may have" in replies[1].info


def test_a_plan_that_is_started_and_finds_no_room_is_reported(monkeypatch):
    monkeypatch.setattr("tasks.plan.store.MOST_PLANS", 0)
    (kept,) = served(*answered(imc.PlanControl(timestamp=1.0, src=CCU, dst=OWN, plan_id="a", arg=A)))
    assert (kept.type, kept.info) == (Type.FAILURE, "database: 0 plans are stored, which is the limit: delete some")


def test_a_console_that_asks_in_vain_without_end_does_not_fill_the_log_book():
    run = simulate(DB, [ask(Op.GET, f"p{i}", at=1.0 + i / 45.0, request_id=i) for i in range(450)], seconds=20)
    assert len([m for m in run.of(imc.PlanDB) if m.type == Type.FAILURE]) == 450
    assert 60 <= len(run.log) < 75
    assert run.log[0].endswith("undefined plan: 'p0'")
    assert "more requests are rejected, which are not logged one by one" in run.log


def slow_file(tmp_path, requests, seconds=20):
    """The answers of a plan database in a file, with the times of its results."""
    run = simulate(DB, requests, seconds=seconds, log_root=tmp_path, storage="File")
    found = [m for m in run.of(imc.PlanDB) if m.op != Op.BOOT]
    return found, [m for m in found if m.type != Type.IN_PROGRESS]


def test_changes_wait_for_the_disk_in_their_order_and_others_read_meanwhile(tmp_path):
    many = [ask(Op.SET, f"p{i}", plan_of(goto(1, 0), name=f"p{i}"), request_id=i) for i in range(40)]
    own, other = ask(Op.GET, "p39", request_id=100), ask(Op.GET, "p0", src=CCU + 1, request_id=101)
    progress, results = slow_file(tmp_path, [*many, own, other])
    assert [(m.request_id, m.type) for m in results if m.dst == CCU] == [(i, Type.SUCCESS) for i in (*range(40), 100)]
    began = progress[0].timestamp
    of_other = next(m for m in results if m.dst == CCU + 1)
    assert (of_other.type, of_other.timestamp - began) == (Type.SUCCESS, 0.0)
    assert 3.4 < next(m for m in results if m.request_id == 39).timestamp - began < 3.8
    for second in range(4):
        within = [m for m in results if second <= m.timestamp - began < second + 1 and m.op == Op.SET]
        assert len(within) <= 14
    assert {m.request_id for m in progress if m.type == Type.IN_PROGRESS} >= set(range(40)), "nobody waits in silence"


def test_a_console_that_stores_plans_without_end_waits_for_the_disk_alone(tmp_path):
    flood = [ask(Op.SET, f"p{i}", plan_of(goto(1, 0), name=f"p{i}"), request_id=i) for i in range(500)]
    other = ask(Op.SET, "a", A, src=CCU + 1)
    _, results = slow_file(tmp_path, [*flood, other])
    assert sum(m.type == Type.SUCCESS for m in results if m.dst == CCU) == 54
    refused = [m for m in results if m.type == Type.FAILURE]
    assert len(refused) == 446
    assert {m.info for m in refused} == {"too many requests wait for the disk: ask again later"}
    assert [m.type for m in results if m.dst == CCU + 1] == [Type.SUCCESS]


def test_the_state_is_made_from_the_digests_and_not_from_the_plans():
    """Reading all plans for each answer once kept all tasks waiting for seconds."""
    store = PlanStore(None)
    for name in ("a", "b"):
        store.set(plan_of(goto(1, 0), name=name), PlanChange(1.0, 2, "x"))
    read: list[str] = []
    store._base.set_trace_callback(read.append)
    assert store.state().plan_count == 2
    assert all(" data " not in query and ", data" not in query for query in read)


@pytest.mark.heavy
def test_the_state_for_all_is_published_once_a_second_however_fast_plans_change():
    sets = [ask(Op.SET, f"p{n}", plan_of(goto(1, 0), name=f"p{n}"), at=1.0 + 0.01 * n) for n in range(100)]
    run = simulate([(DB, {"storage": "Memory"})], sets, seconds=4.0, clock=WallClock())
    states = run.of(imc.PlanDBState)
    assert 2 <= len(states) <= 5
    assert states[-1].plan_count == 100


def test_virtual_runs_begin_without_plans_and_a_file_keeps_them(tmp_path):
    path = tmp_path / "Plan.db"
    store = PlanStore(path)
    store.set(A, PlanChange(1.0, 2, "x"))
    store.close()
    again = PlanStore(path)
    stored = again.get("a")
    assert stored is not None
    assert (stored.change, stored.specification().plan_id) == (PlanChange(1.0, 2, "x"), "a")
    again.close()


def test_a_wall_clock_uses_the_file():
    class Look(DB):
        """Checks its file in stop()."""

        def stop(self) -> None:
            file = self.vehicle.state_folder / self.system_name / "Plan.db"
            Look.found = file.exists() and sqlite3.connect(file).execute("SELECT COUNT(*) FROM Plan").fetchone()[0] == 0
            super().stop()

    simulate(Look, seconds=0.05, clock=WallClock())
    assert Look.found
