"""Plans from templates."""

import math

import pytest
from flying import BOARD, CCU, LAT, LON, OWN, control, phases, replies
from ideal_vehicle import IdealVehicle

import imc
from runtime.testing import simulate
from tasks.plan.generator import Generator

Cmd, Op = imc.PlanGeneration.Cmd, imc.PlanGeneration.Op


def ask(name, params="", cmd=Cmd.GENERATE, at=2.0, **fields):
    return imc.PlanGeneration(timestamp=at, src=CCU, dst=OWN, cmd=cmd, plan_id=name, params=params, **fields)


def asked(*feed, seconds=10.0, board=BOARD, **parameters):
    tasks = [*board, (Generator, {"entity_label": "Plan Generator", **parameters}), IdealVehicle]
    return simulate(tasks, feed, seconds=seconds)


def answers(run):
    return [(Op(m.op).name, m.params) for m in run.of(imc.PlanGeneration)]


def stored(run):
    """The maneuver of the plan that was put into the database."""
    (put,) = [m for m in run.of(imc.PlanDB) if m.op == imc.PlanDB.Op.SET and m.type == imc.PlanDB.Type.REQUEST]
    return put.arg.maneuvers[0].data


@pytest.mark.parametrize(
    ("name", "params", "kind", "fields"),
    [
        ("go", "lat=41.2;lon=-8.7;depth=3", imc.Goto, {"lat": math.radians(41.2), "z": 3.0, "speed": 1000.0}),
        ("sk", "", imc.StationKeeping, {"lat": LAT, "lon": LON, "radius": 10.0, "z": 0.0}),
        ("loiter", "duration=60;radius=20", imc.Loiter, {"duration": 60, "radius": 20.0, "z": 0.0}),
        ("dive", "duration=60", imc.Loiter, {"duration": 60, "z": 2.0}),
        ("surface", "", imc.Elevator, {"end_z": 0.0, "flags": 1}),
        ("dislodge", "rpm=1200", imc.Dislodge, {"rpm": 1200.0}),
    ],
)
def test_templates_are_stored(name, params, kind, fields):
    run = asked(ask(name, params))
    assert answers(run) == [("SUCCESS", "")]
    maneuver = stored(run)
    assert isinstance(maneuver, kind)
    assert {key: getattr(maneuver, key) for key in fields} == pytest.approx(fields)
    assert phases(run)[-1][0] == "READY"


def test_a_flight_takes_off_circles_and_lands():
    run = asked(ask("flight", "altitude=20;duration=60;radius=15"))
    assert answers(run) == [("SUCCESS", "")]
    (put,) = [m for m in run.of(imc.PlanDB) if m.op == imc.PlanDB.Op.SET and m.type == imc.PlanDB.Type.REQUEST]
    takeoff, circles, land = (item.data for item in put.arg.maneuvers)
    assert [type(m) for m in (takeoff, circles, land)] == [imc.Takeoff, imc.Loiter, imc.Land]
    assert {(m.z, m.z_units) for m in (takeoff, circles, land)} == {(20.0, imc.ZUnits.ALTITUDE)}
    assert (circles.radius, circles.duration, circles.lat, land.lon) == (15.0, 60, LAT, LON)
    arrows = [(arrow.source_man, arrow.dest_man) for arrow in put.arg.transitions]
    assert arrows == [("takeoff", "circles"), ("circles", "land")]


def test_near_whom_it_has_to_come():
    here = imc.Announce(timestamp=1.0, src=CCU, lat=0.72, lon=-0.15)
    run = asked(here, ask("come_near"))
    assert (stored(run).lat, stored(run).lon) == (0.72, -0.15)
    assert answers(asked(ask("come_near"))) == [("ERROR", "error=position is unknown")]


def test_a_template_is_executed():
    run = asked(ask("dive", "calibrate=false", Cmd.EXECUTE))
    assert phases(run)[-1] == ("EXECUTING", "dive")
    assert not run.of(imc.Calibration)
    assert len(asked(ask("dive", "", Cmd.EXECUTE)).of(imc.Calibration)) == 1


def test_the_recovery_plan_is_the_generators():
    run = asked(ask("dislodge", "calibrate=false", Cmd.EXECUTE), seconds=4)
    assert ("EXECUTING", "dislodge") in phases(run)
    refused = asked(ask("dislodge"), control(imc.PlanControl.Op.START, 3.0, "dislodge"))
    assert replies(refused) == [("FAILURE", "only the plan generator may start the recovery plan")]


@pytest.mark.parametrize(
    ("name", "params", "reason"),
    [
        ("", "", "Given plan id was not understood."),
        ("fly", "", "Given plan id was not understood."),
        ("go", "lat=95;lon=0", "lat and lon are not a position in degrees"),
        ("go", "lat=41", "lat and lon are not a position in degrees"),
        ("go", "lat=x;lon=y", "lat is not a number"),
        ("dive", "duration=inf", "duration is not a number"),
        ("dive", "depth=nan", "depth is not a number"),
        ("dive", ";;==;a", None),
    ],
)
def test_bad_requests(name, params, reason):
    expected = ("ERROR", f"error={reason}") if reason else ("SUCCESS", "")
    assert answers(asked(ask(name, params))) == [expected]


def test_requests_for_others_and_replies_are_ignored():
    assert answers(asked(ask("sk").replace(dst=0x1B), ask("sk").replace(op=Op.SUCCESS))) == []


def test_without_a_database():
    from tasks.plan.db import DB

    assert answers(asked(ask("sk"), board=[task for task in BOARD if task is not DB])) == [
        ("ERROR", "error=no answer from the plan database")
    ]


def test_a_plan_at_boot():
    run = asked(generate_at_boot="dislodge", seconds=2)
    assert isinstance(stored(run), imc.Dislodge)
