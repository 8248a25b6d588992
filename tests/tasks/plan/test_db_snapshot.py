"""The plan database in snapshots."""

import pytest
from flying import CCU, OWN, goto, plan_of

import imc
from runtime.kernel import VirtualClock
from runtime.snapshot import SnapshotError, load, restore, take_snapshot
from runtime.testing import NoProfile
from runtime.vehicle import Vehicle
from tasks.plan.db import DB

Op = imc.PlanDB.Op


def vehicle_of(tmp_path, time=0, **parameters):
    vehicle = Vehicle("kept", OWN, clock=VirtualClock(time), profile=NoProfile(), state_folder=tmp_path)
    vehicle.add(DB, "Plan.DB", **parameters)
    return vehicle


def ask(vehicle, op, **fields):
    """The last answer to a request."""
    answers = []
    vehicle.observe(imc.PlanDB, lambda m: answers.append(m) if m.type != imc.PlanDB.Type.REQUEST else None)
    request = imc.PlanDB(timestamp=1.0, src=CCU, dst=OWN, op=op, **fields)
    vehicle.bus.deliver_and_send(request, imc.encode(request), None)
    vehicle.run(0.5)
    return answers[-1]


def test_plans_go_on(tmp_path):
    vehicle = vehicle_of(tmp_path)
    vehicle.start()
    vehicle.run(1.0)
    for name in ("first", "zweite", "\udcff"):
        plan = plan_of(goto(30, 0)).replace(plan_id=name)
        assert ask(vehicle, Op.SET, plan_id=name, arg=plan).type == imc.PlanDB.Type.SUCCESS
    ask(vehicle, Op.DEL, plan_id="zweite")
    again = vehicle_of(tmp_path, vehicle.kernel.now_ns)
    restore(again, load(take_snapshot(vehicle)))
    for request in ({"op": Op.GET_DSTATE}, {"op": Op.GET, "plan_id": "first"}, {"op": Op.GET, "plan_id": "\udcff"}):
        assert ask(again, **request) == ask(vehicle, **request)
    assert ask(again, Op.GET, plan_id="zweite").info == "undefined plan"
    assert ask(vehicle, Op.CLEAR).info == "OK"
    assert ask(again, Op.GET_STATE).arg.plan_count == 2
    vehicle.close()
    again.close()


def test_plans_in_a_file_are_refused(tmp_path):
    vehicle = vehicle_of(tmp_path, storage="File")
    vehicle.start()
    vehicle.run(1.0)
    with pytest.raises(SnapshotError, match=r"Plan.DB keeps its plans in a file"):
        take_snapshot(vehicle)
    vehicle.close()
