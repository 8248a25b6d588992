"""A file in which the plan database cannot store plans: what it reports of it."""

import contextlib
import os
import re
import sqlite3
from pathlib import Path

import pytest
from flying import CCU, goto, plan_of

import imc
from runtime.kernel import VirtualClock
from runtime.profile import load_profile
from runtime.vehicle import build
from tasks.plan.store import PlanChange, PlanStore, describe_database_error
from tests.outside import TOO_LARGE, largest_file

ETC = Path(__file__).parents[3] / "etc"
Op, Type = imc.PlanDB.Op, imc.PlanDB.Type
PLAN = plan_of(*(goto(each, 0) for each in range(200)), name="long")


def path_in(folder):
    return folder / "db" / "lauv-noptilus-1" / "Plan.db"


def stored_in(folder, happen=None):
    """Start the shipped AUV and send it a plan; its answer, the state of its plan database, and its log book.

    With `happen`, that is called then, and the vehicle runs on for a while.
    """
    profile = load_profile("lauv-noptilus-1", [ETC], overrides=["Plan.DB:Storage=File"])
    vehicle = build(
        profile,
        ["Simulation"],
        clock=VirtualClock(),
        only=["Plan.DB"],
        log_root=folder / "log",
        state_folder=folder / "db",
    ).vehicle
    answers, log = [], []
    vehicle.observe(imc.PlanDB, answers.append)
    vehicle.observe(imc.LogBookEntry, lambda entry: log.append(entry.text))
    vehicle.start()
    vehicle.run(1.0)
    request = imc.PlanDB(op=Op.SET, plan_id="long", arg=PLAN, src=CCU, dst=profile.systems[vehicle.name], request_id=1)
    packet = imc.encode(request)
    vehicle.bus.deliver(imc.decode(packet), packet)
    vehicle.run(5.0)
    if happen is not None:
        happen()
        vehicle.run(20.0)
    state = next(task.entity.description for task in vehicle.tasks if task.name == "Plan.DB")
    vehicle.close()
    return [m for m in answers if m.op == Op.SET][-1], state, log


def test_a_file_that_another_program_holds_is_named_with_the_remedy(tmp_path):
    path = path_in(tmp_path)
    PlanStore(path).close()
    with contextlib.closing(sqlite3.connect(path)) as other:
        other.execute("BEGIN EXCLUSIVE")
        answer, state, log = stored_in(tmp_path)
    trouble = f"plans are kept in memory only: {path}: database is locked: end the other program that uses it"
    assert state == trouble
    assert trouble in log
    assert answer.type == Type.SUCCESS
    assert stored_in(tmp_path)[1] == "active", "when it is free again"


def test_plans_move_to_the_file_when_it_can_be_used(tmp_path):
    path = path_in(tmp_path)
    store = PlanStore(path)
    for plan in (PLAN.replace(maneuvers=()), plan_of(goto(0, 0), name="old")):
        store.set(plan, PlanChange())
    store.close()
    with contextlib.closing(sqlite3.connect(path)) as other:
        other.execute("BEGIN EXCLUSIVE")
        answer, state, log = stored_in(tmp_path, happen=other.rollback)
    assert (answer.type, state) == (Type.SUCCESS, "active")
    assert f"{path} can be used again: plans stored from memory: 1" in log
    store = PlanStore(path)
    assert [plan.plan_id for plan in store.all()] == ["long", "old"]
    assert store.get("long").specification().maneuvers == PLAN.maneuvers
    assert store.state().change_sid == CCU
    store.close()


def test_a_file_that_cannot_be_used_for_long_is_named_once(tmp_path):
    path_in(tmp_path).mkdir(parents=True)
    _, state, log = stored_in(tmp_path, happen=lambda: None)
    assert state.startswith("plans are kept in memory only: ")
    assert log.count(state) == 1


def test_a_file_of_another_program_is_named_and_stays(tmp_path):
    path = path_in(tmp_path)
    path.parent.mkdir(parents=True)
    with contextlib.closing(sqlite3.connect(path)) as other, other:
        other.execute("CREATE TABLE Plan (name TEXT)")
    content = path.read_bytes()
    _, state, _ = stored_in(tmp_path)
    remedy = "rename it: its tables are not those of a plan database"
    assert re.fullmatch(f"plans are kept in memory only: {re.escape(str(path))}: no such column: .*: {remedy}", state)
    assert path.read_bytes() == content


@pytest.mark.parametrize("what", ["folder", "link"])
def test_a_path_that_cannot_be_opened_is_named_with_the_remedy(tmp_path, what):
    path = path_in(tmp_path)
    if what == "folder":
        path.mkdir(parents=True)
    else:
        path.parent.mkdir(parents=True)
        os.symlink(tmp_path / "gone" / "Plan.db", path)
    reason = "unable to open database file: let the vehicle's user write the file and its folder"
    assert stored_in(tmp_path)[1] == f"plans are kept in memory only: {path}: {reason}"


def test_half_a_file_is_named_when_it_is_renamed(tmp_path):
    path = path_in(tmp_path)
    path.parent.mkdir(parents=True)
    path.write_bytes(b"no database" * 1000)
    _, state, log = stored_in(tmp_path)
    assert state == "active"
    assert f"{path}: file is not a database; renamed to Plan.damaged, of which 0 plans could be read" in log


def test_a_full_disk_at_the_start_or_later_is_named_with_the_remedy(tmp_path):
    path = path_in(tmp_path)
    with largest_file(5000):
        assert stored_in(tmp_path)[1].startswith(f"plans are kept in memory only: {path}: ")
    stored_in(tmp_path)
    store = PlanStore(path)
    plans = [PLAN.replace(plan_id=f"{number}") for number in range(100)]
    with largest_file(path.stat().st_size), pytest.raises(sqlite3.Error) as caught:
        list(map(store.set, plans, [PlanChange()] * 100))
    store.close()
    text = describe_database_error(caught.value, path)
    assert re.fullmatch(f"{re.escape(str(path))}: d.* (full|I/O error): make room on its disk.*", text), text


def test_a_full_disk_under_a_running_vehicle_is_an_answer_with_the_file(tmp_path):
    path = path_in(tmp_path)
    PlanStore(path).close()
    with largest_file(path.stat().st_size):
        answer, state, log = stored_in(tmp_path)
    assert (answer.type, state) == (Type.FAILURE, "active")
    assert answer.info.startswith(f"database: {path}: ")
    assert "make room on its disk" in answer.info
    assert any(answer.info in line for line in log)


def test_a_file_that_is_read_only_is_reported_at_the_start(tmp_path, monkeypatch):
    """As the administrator, the tests may write any file: SQLite opens this one to read only."""
    path, connect = path_in(tmp_path), sqlite3.connect
    PlanStore(path).close()
    monkeypatch.setattr(
        sqlite3, "connect", lambda name, **words: connect(f"file:{name}?mode=ro" if name == path else name, uri=True)
    )
    reason = "attempt to write a readonly database: let the vehicle's user write the file and its folder"
    assert stored_in(tmp_path)[1] == f"plans are kept in memory only: {path}: {reason}"


def test_a_folder_that_cannot_be_made_is_named(tmp_path):
    (tmp_path / "db").write_text("no folder")
    assert re.match(f"plans are kept in memory only: {tmp_path}/db/?.*: ", stored_in(tmp_path)[1])
    assert TOO_LARGE not in stored_in(tmp_path)[1]
