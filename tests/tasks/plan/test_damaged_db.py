"""The file of the plan database, cut or damaged: what of it is kept."""

import sqlite3

import pytest
from flying import CCU, OWN, goto, plan_of

import imc
from runtime.testing import simulate
from tasks.plan.db import DB
from tasks.plan.store import PlanChange, PlanStore

Op = imc.PlanDB.Op


def ask(op, at, **fields):
    return imc.PlanDB(timestamp=at, op=op, src=CCU, dst=OWN, request_id=77, **fields)


def plans_after_start(folder, *, is_second_damage=False):
    """The names of the plans that the database finds in a folder at its start, and its log book."""

    class Files(DB):
        """A database in a file."""

        def _open(self):
            path = folder / "Plan.db"
            target = self.vehicle.state_folder / self.system_name / "Plan.db"
            target.parent.mkdir(parents=True, exist_ok=True)
            target.write_bytes(path.read_bytes())
            if is_second_damage:
                target.with_suffix(".damaged").write_bytes(b"earlier")
            store = super()._open()
            assert not is_second_damage or target.with_suffix(".damaged").read_bytes() == b"earlier"
            return store

    question = ask(Op.GET_STATE, 0.1)
    run = simulate([(Files, {"storage": "File"})], [question], seconds=1.0)
    (answer,) = [m for m in run.of(imc.PlanDB) if m.op == Op.GET_STATE]
    return [info.plan_id for info in answer.arg.plans_info], run.log


def stored_file(folder, count=40):
    path = folder / "Plan.db"
    store = PlanStore(path)
    for n in range(count):
        plan = plan_of(*(goto(each, 0) for each in range(20)), name=f"plan{n:02d}")
        store.set(plan, PlanChange(1.0, 2, "x"))
    store.close()
    return path


@pytest.mark.parametrize("part", [0.3, 0.5, 0.9])
def test_half_a_file_is_put_aside_and_its_readable_plans_are_kept(tmp_path, part):
    path = stored_file(tmp_path)
    path.write_bytes(path.read_bytes()[: int(path.stat().st_size * part)])
    names, log = plans_after_start(tmp_path)
    assert 40 * part - 8 < len(names) < 40
    assert any(f"renamed to Plan.damaged, of which {len(names)} plans could be read" in line for line in log)


@pytest.mark.heavy
def test_the_plans_behind_a_damaged_page_are_kept_and_an_earlier_damaged_file_stays(tmp_path):
    path = stored_file(tmp_path)
    raw = bytearray(path.read_bytes())
    middle = len(raw) // 2 // 4096 * 4096
    raw[middle : middle + 4096] = bytes(4096)
    path.write_bytes(raw)
    names, log = plans_after_start(tmp_path, is_second_damage=True)
    assert {"plan00", "plan39"} < set(names)
    assert 30 < len(names) < 40
    assert any(f"renamed to Plan.damaged1, of which {len(names)} plans" in line for line in log)


def test_a_row_with_other_types_loses_no_other_plan(tmp_path):
    path = stored_file(tmp_path, 3)
    with sqlite3.connect(path) as base:
        base.execute("UPDATE Plan SET md5 = NULL, data = 7 WHERE plan_id = 'plan01'")
    base.close()
    names, log = plans_after_start(tmp_path)
    assert names == ["plan00", "plan02"]
    assert any("1 plans have fields of other types; renamed to Plan.damaged" in line for line in log)


@pytest.mark.parametrize("change", ["md5 = NULL", "change_sname = CAST(x'ff41' AS TEXT)", "change_time = 'x'"])
def test_a_damaged_field_beside_a_good_plan_is_replaced(tmp_path, change):
    path = stored_file(tmp_path, 3)
    with sqlite3.connect(path) as base:
        base.execute(f"UPDATE Plan SET {change} WHERE plan_id = 'plan01'")
    base.close()
    names, log = plans_after_start(tmp_path)
    assert names == ["plan00", "plan01", "plan02"]
    assert any("renamed to Plan.damaged, of which 3 plans could be read" in line for line in log)


def test_a_damaged_file_is_put_aside(tmp_path):
    class Files(DB):
        """A database whose file is damaged."""

        def start(self) -> None:
            folder = self.vehicle.state_folder / self.system_name
            folder.mkdir(parents=True, exist_ok=True)
            (folder / "Plan.db").write_bytes(b"no database at all" * 100)
            super().start()
            assert (folder / "Plan.damaged").exists()

    run = simulate(Files, [ask(Op.SET, 1.0, plan_id="a", arg=plan_of(goto(1, 0), name="a"))], seconds=3, storage="File")
    assert any("renamed to Plan.damaged" in text for text in run.log)
    assert run.of(imc.PlanDB)[-1].info == "OK (new entry)"
