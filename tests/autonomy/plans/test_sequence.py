"""What is left of a plan from a maneuver on."""

import pytest

import imc
from autonomy.plans import remaining_plan, sequential_plan


def names(plan):
    return [maneuver.maneuver_id for maneuver in plan.maneuvers]


def test_branches_and_cycles_that_can_be_reached_stay():
    arrows = [("a", "b", "FuelLevel.value < 20"), ("a", "c", ""), ("c", "d", ""), ("d", "c", "")]
    plan = imc.PlanSpecification(
        plan_id="test",
        start_man_id="a",
        maneuvers=tuple(imc.PlanManeuver(maneuver_id=name, data=imc.IdleManeuver(duration=1)) for name in "abcd"),
        transitions=tuple(imc.PlanTransition(source_man=a, dest_man=b, conditions=c) for a, b, c in arrows),
    )
    assert names(remaining_plan(plan, "d")) == ["c", "d"]
    assert names(remaining_plan(plan, "b")) == ["b"]
    with pytest.raises(ValueError, match="the plan has no maneuver 'x'"):
        remaining_plan(plan, "x")


def test_maneuvers_in_sequence_are_a_plan():
    plan = sequential_plan("test", {"first": imc.IdleManeuver(duration=1), "second": imc.IdleManeuver(duration=2)})
    assert (plan.start_man_id, names(plan)) == ("first", ["first", "second"])
    assert [(t.source_man, t.dest_man, t.conditions) for t in plan.transitions] == [
        ("first", "second", "ManeuverIsDone")
    ]
    assert names(remaining_plan(plan, "second")) == ["second"]
