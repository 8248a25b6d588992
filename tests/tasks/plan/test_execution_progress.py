"""A plan that DUNE flew, flown by an ideal vehicle: the same sequence of states and maneuvers."""

import json

import pytest
from flying import PLANS, changes, fly, modes, phases, recorded, replies, start

import imc

RECORDED = json.loads((PLANS / "three_gotos_states.json").read_text())


@pytest.fixture(scope="module")
def flight():
    return fly(start(recorded()), seconds=250)


def test_the_plan_completes(flight):
    assert replies(flight) == [
        ("SUCCESS", "plan loaded"),
        ("SUCCESS", "Goto1: executing maneuver"),
        ("SUCCESS", "plan completed"),
    ]
    last = flight.of(imc.PlanControlState)[-1]
    assert (last.state, last.last_outcome) == (
        imc.PlanControlState.State.READY,
        imc.PlanControlState.LastOutcome.SUCCESS,
    )


def test_the_engine_goes_through_the_recorded_states(flight):
    names = imc.PlanControlState.State
    states = flight.of(imc.PlanControlState)
    executing = [
        [names(m.state).name, m.man_id, m.man_type, m.last_outcome] for m in states if m.state == names.EXECUTING
    ]
    assert changes(executing) == RECORDED["plan"]
    assert [state for state, _ in phases(flight)][:4] == ["READY", "BLOCKED", "READY", "INITIALIZING"]


def test_the_vehicle_goes_through_the_recorded_modes(flight):
    names = imc.VehicleState.OpMode
    states = [[names(m.op_mode).name, m.maneuver_type, m.flags] for m in flight.of(imc.VehicleState)]
    assert [state for state in changes(states) if state[0] == "MANEUVER"] == RECORDED["vehicle"]
    assert modes(flight) == ["BOOT", "SERVICE", "MANEUVER", "SERVICE"]


def test_maneuvers_go_through_the_recorded_states(flight):
    names = imc.ManeuverControlState.State
    assert changes(names(m.state).name for m in flight.of(imc.ManeuverControlState)) == RECORDED["maneuver"]


def test_loops_are_enabled_once_and_disabled_at_the_station(flight):
    own = [m for m in flight.of(imc.ControlLoops) if m.mask in (0xFFFFFFFF, imc.CLoopsMask.PATH)]
    assert [(m.enable, m.mask, m.scope_ref) for m in own] == [(0, 0xFFFFFFFF, 1), (1, 1, 2), (0, 0xFFFFFFFF, 3)]


def test_paths_are_those_that_were_recorded(flight):
    assert [(m.path_ref, m.end_z, m.flags, m.lradius) for m in flight.of(imc.DesiredPath)] == [
        (1, 3.0, 0, 0.0),
        (2, 5.0, 0, 0.0),
        (3, 0.0, 0, 0.0),
        (4, 0.0, imc.DesiredPath.Flags.DIRECT, 0.0),
    ]


def test_durations_are_foreseen_and_reported_afterwards(flight):
    before, after = flight.of(imc.PlanStatistics)
    assert before.type == imc.PlanStatistics.Type.PREPLAN
    assert before.durations.startswith(
        "Total=228.1,Execution=228.1,Calibration=0.0,Maneuver Goto1=62.9,Maneuver Goto2=45."
    )
    assert after.type == imc.PlanStatistics.Type.POSTPLAN
    assert after.durations.startswith("Maneuver Goto1=")
    assert "Total=229" in after.durations


def test_progress_rises_and_time_left_falls(flight):
    states = [m for m in flight.of(imc.PlanControlState) if m.state == imc.PlanControlState.State.EXECUTING]
    progress = [m.plan_progress for m in states]
    assert progress == sorted(progress)
    assert progress[0] == pytest.approx(0.0, abs=1e-9)
    assert progress[-1] > 99.0
    assert (states[0].plan_eta, states[-1].plan_eta) == (228, 1)


def test_the_log_is_named_after_the_plan(flight):
    assert [m.name for m in flight.of(imc.LoggingControl)] == ["ref_public", ""]
